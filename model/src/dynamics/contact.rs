//! The forces between wheel and ground that pure rolling needs (chapter 4).

use super::planar::{PHI, PHI_RATE, Planar, PlanarState, THETA_RATE};
use crate::real::Real;

/// The ground's forces on the wheel, over `(M + m) g`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ContactForces<T> {
    /// Friction, positive up-slope; equal to `-lambda_f` of (4.11).
    pub friction: T,
    /// Normal force, positive out of the ground, equal to `lambda_n` of (4.11); at or below 0 the vehicle
    /// would leave the ground, and the model no longer applies.
    pub normal: T,
}

impl<T: Real> ContactForces<T> {
    /// The friction coefficient that rolling needs, `|F| / N`; `None` if the normal force does not press
    /// the wheel down.
    pub fn friction_coefficient(&self) -> Option<T> {
        (self.normal > T::ZERO).then(|| self.friction.abs() / self.normal)
    }
}

impl<T: Real> Planar<T> {
    /// The contact forces under the voltage `u`, by Newton and Euler: the friction follows from the wheel's
    /// moment balance alone, the normal force from the momentum of both bodies along the ground's normal.
    pub fn contact_forces(&self, x: &PlanarState<T>, u: T) -> ContactForces<T> {
        let p = self.parameters();
        let [theta_acceleration, phi_acceleration] = self.accelerations(x, u);
        let (sin_phi, cos_phi) = x[PHI].sin_cos();
        let sin_pb = sin_phi * self.cos_beta - cos_phi * self.sin_beta;
        let cos_pb = cos_phi * self.cos_beta + sin_phi * self.sin_beta;
        let relative_acceleration = theta_acceleration + phi_acceleration;
        let torque = u - p.zeta * (x[THETA_RATE] + x[PHI_RATE]) - p.nu * relative_acceleration;
        ContactForces {
            friction: torque - p.mu * theta_acceleration,
            normal: self.cos_beta + self.al * (sin_pb * phi_acceleration + cos_pb * x[PHI_RATE] * x[PHI_RATE]),
        }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::dynamics::planar::PlanarParameters;

    /// The oracle, by Lagrange's multipliers: theta, phi and the axle's place x, y are four coordinates
    /// with the constraints (4.8), (4.9). One system of equations gives the accelerations and the
    /// multipliers.
    fn by_multipliers(planar: &Planar<f64>, x: &PlanarState<f64>, u: f64) -> ContactForces<f64> {
        let p = planar.parameters();
        let (sin_phi, cos_phi) = x[PHI].sin_cos();
        let sin_pb = sin_phi * planar.cos_beta - cos_phi * planar.sin_beta;
        let cos_pb = cos_phi * planar.cos_beta + sin_phi * planar.sin_beta;
        let torque = u - p.zeta * (x[THETA_RATE] + x[PHI_RATE]);
        let centripetal = planar.al * x[PHI_RATE] * x[PHI_RATE];
        let (o, i, al, nu) = (0.0, 1.0, planar.al, p.nu);
        // Rows: the equations of theta, phi, x, y, then the constraints twice differentiated.
        // Columns: theta'', phi'', x'', y'', lambda_f, lambda_n, right-hand side.
        let rows = [
            [p.mu + nu, nu, o, o, -i, o, torque],
            [nu, al * p.l + nu, al * cos_pb, al * sin_pb, o, o, torque - al * sin_phi],
            [o, al * cos_pb, i, o, i, o, sin_pb * centripetal - planar.sin_beta],
            [o, al * sin_pb, o, i, o, -i, -(cos_pb * centripetal) - planar.cos_beta],
            [i, o, -i, o, o, o, o],
            [o, o, o, i, o, o, o],
        ];
        let [_, _, _, _, lambda_f, lambda_n] = solve(rows);
        ContactForces {
            friction: -lambda_f,
            normal: lambda_n,
        }
    }

    /// Gauss's elimination with partial pivoting of six equations.
    fn solve(mut a: [[f64; 7]; 6]) -> [f64; 6] {
        for column in 0..6 {
            let mut pivot = column;
            for row in column + 1..6 {
                if a[row][column].abs() > a[pivot][column].abs() {
                    pivot = row;
                }
            }
            a.swap(column, pivot);
            let upper = a[column];
            for (row, line) in a.iter_mut().enumerate() {
                if row != column {
                    let factor = line[column] / upper[column];
                    for (value, above) in line.iter_mut().zip(upper) {
                        *value += -factor * above;
                    }
                }
            }
        }
        core::array::from_fn(|row| a[row][6] / a[row][row])
    }

    proptest! {
        #[test]
        fn two_routes_give_one_force(
            l in 0.2_f64..1.5, alpha in 0.1_f64..0.95, zeta in 0.0_f64..4.0, mu in 0.0_f64..0.5, nu in 0.0_f64..0.2,
            beta in -1.2_f64..1.2, phi in -7.0_f64..7.0, theta_rate in -5.0_f64..5.0, phi_rate in -5.0_f64..5.0,
            u in -9.0_f64..9.0,
        ) {
            let planar = Planar::new(PlanarParameters { l, alpha, zeta, mu, nu, beta });
            let x = [0.4, phi, theta_rate, phi_rate];
            let (a, b) = (planar.contact_forces(&x, u), by_multipliers(&planar, &x, u));
            let [wheel, arm] = planar.accelerations(&x, u);
            let size = 1.0 + wheel.abs() + arm.abs() + 25.0;
            prop_assert!((a.friction - b.friction).abs() < 1e-12 * size, "{a:?} {b:?}");
            prop_assert!((a.normal - b.normal).abs() < 1e-12 * size, "{a:?} {b:?}");
            // A third way to the friction: the momentum of both bodies along the ground.
            let along = wheel + alpha * l * ((phi - beta).cos() * arm - (phi - beta).sin() * phi_rate * phi_rate) + beta.sin();
            prop_assert!((a.friction - along).abs() < 1e-12 * size, "{a:?} {along}");
        }
    }

    #[test]
    fn a_resting_vehicle_is_held_by_its_weight() {
        let parameters = PlanarParameters {
            beta: 0.0873_f64,
            ..PlanarParameters::thesis()
        };
        let phi = (parameters.beta.sin() / 0.72).asin();
        let forces = Planar::new(parameters).contact_forces(&[0.0, phi, 0.0, 0.0], parameters.beta.sin());
        assert!((forces.friction - 0.0873_f64.sin()).abs() < 1e-15 && (forces.normal - 0.0873_f64.cos()).abs() < 1e-15);
        // Standing alone needs tan(beta) = 0.0875: 1750 % of greased steel's 0.005.
        assert!((forces.friction_coefficient().unwrap() - 0.08752).abs() < 5e-6);
    }

    #[test]
    fn the_step_of_chapter_3_needs_a_friction_coefficient_of_3_845() {
        let planar = Planar::new(PlanarParameters::<f64>::thesis());
        let phi = (0.0873_f64.sin() / 0.72).asin();
        let start = [0.0, phi, 0.0, 0.0];
        let forces = planar.contact_forces(&start, 5.02);
        assert!(
            (forces.friction - 5.5058).abs() < 5e-5 && (forces.normal - 1.4321).abs() < 5e-5,
            "{forces:?}"
        );
        assert!((forces.friction_coefficient().unwrap() - 3.845).abs() < 5e-4);
        // The wheel first rolls backwards, and on a downhill step the vehicle hops.
        assert!((planar.accelerations(&start, 5.02)[0] + 7.36).abs() < 5e-3);
        let downhill = Planar::new(PlanarParameters {
            beta: -0.3_f64,
            ..PlanarParameters::thesis()
        });
        let phi = ((-0.3_f64).sin() / 0.72).asin();
        let forces = downhill.contact_forces(&[0.0, phi, 0.0, 0.0], 4.46);
        assert!(forces.normal < 0.0 && forces.friction_coefficient().is_none());
    }
}
