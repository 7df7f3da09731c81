//! The arm's angle in a steady acceleration.
//!
//! Subtracting (3.13) from (3.12) with `phi'' = phi' = 0` eliminates the motor torque and the friction of the
//! drive:
//!
//! ```text
//! alpha L sin(phi) + a alpha L cos(beta - phi) = (1 + S) sin(beta) + (1 + S + mu) a
//! ```
//!
//! with the axle's acceleration `a` in g and the spar's mass S over M + m (Eq. 8.8, corrected). The second term
//! is the arm's inertia: an accelerating axle throws the arm back. This inertia balances part of the drive's
//! reaction, so the arm leans less.

use crate::real::Real;

/// The parameters that determine the arm's angle in a steady acceleration.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Equilibrium<T> {
    /// `alpha L`, > 0.
    pub alpha_l: T,
    /// `1 + S`: all mass over M + m, >= 1.
    pub mass: T,
    /// `mu`: inertia of the wheels, >= 0.
    pub mu: T,
}

/// The arm's angle, and whether it is an equilibrium.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ArmAngle<T> {
    /// Sine of the angle.
    pub sin: T,
    /// Cosine of the angle.
    pub cos: T,
    /// Whether the arm's weight can balance slope and acceleration. If not, the angle is the one that balances
    /// the most.
    pub exists: bool,
}

impl<T: Real> Equilibrium<T> {
    /// The stable one of the two arm angles at which the arm rests relative to the vertical while the axle
    /// accelerates at `a`, in g, on a slope of sine `sin_beta` and cosine `cos_beta`.
    ///
    /// The balance is `P sin(phi) + Q cos(phi) = C`; a few products and one square root solve it.
    ///
    /// ```
    /// use model::control::equilibrium::Equilibrium;
    /// let vehicle = Equilibrium { alpha_l: 0.72_f64, mass: 1.3, mu: 0.066 };
    /// // Standing on 5 degrees: alpha L sin(phi) = (1 + S) sin(beta).
    /// let (sin_beta, cos_beta) = 5.0_f64.to_radians().sin_cos();
    /// let arm = vehicle.arm(0.0, sin_beta, cos_beta);
    /// assert!((0.72 * arm.sin - 1.3 * sin_beta).abs() < 1e-15);
    /// // Accelerating with 0.08 g on the level leans the arm by 4.1 degrees.
    /// assert!((vehicle.arm(0.08, 0.0, 1.0).sin.asin().to_degrees() - 4.13).abs() < 0.01);
    /// // Steeper than the arm's weight can carry.
    /// assert!(!vehicle.arm(0.0, 0.6, 0.8).exists);
    /// ```
    #[inline]
    pub fn arm(&self, a: T, sin_beta: T, cos_beta: T) -> ArmAngle<T> {
        let p = self.alpha_l * (T::ONE + a * sin_beta);
        let q = self.alpha_l * a * cos_beta;
        let needed = self.mass * sin_beta + (self.mass + self.mu) * a;
        let square = p * p + q * q;
        let discriminant = square - needed * needed;
        let exists = discriminant > T::ZERO;
        let (carried, root) = if exists {
            (needed, discriminant.sqrt())
        } else {
            // The most that the weight can balance, on the required side.
            let most = square.sqrt();
            (if needed < T::ZERO { -most } else { most }, T::ZERO)
        };
        let inverse = T::ONE / square;
        ArmAngle {
            sin: (p * carried - q * root) * inverse,
            cos: (q * carried + p * root) * inverse,
            exists,
        }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::dynamics::planar::{PHI, Planar, PlanarParameters};

    proptest! {
        /// The oracle: at this angle, under the torque that gives the acceleration, the equations of motion leave
        /// the arm at rest.
        #[test]
        fn the_arm_stays_where_the_equations_of_motion_leave_it(
            l in 0.2_f64..1.2, alpha in 0.3_f64..0.95, mu in 0.0_f64..0.3, nu in 0.0_f64..0.2,
            beta in -0.3_f64..0.3, a in -0.25_f64..0.25,
        ) {
            let planar = Planar::new(PlanarParameters { l, alpha, zeta: 0.0, mu, nu, beta });
            let equilibrium = Equilibrium { alpha_l: alpha * l, mass: 1.0, mu };
            let arm = equilibrium.arm(a, beta.sin(), beta.cos());
            prop_assume!(arm.exists);
            prop_assert!((arm.sin.hypot(arm.cos) - 1.0).abs() < 1e-12);
            let mut x = [0.0; 4];
            x[PHI] = arm.sin.atan2(arm.cos);
            // The wheel's acceleration is linear in the torque, so two accelerations determine the torque for
            // `a`.
            let [none, _] = planar.accelerations(&x, 0.0);
            let [one, _] = planar.accelerations(&x, 1.0);
            prop_assume!((one - none).abs() > 1e-3);
            let [wheel, swing] = planar.accelerations(&x, (a - none) / (one - none));
            prop_assert!((wheel - a).abs() < 1e-9 && swing.abs() < 1e-7, "{wheel} {swing}");
        }
    }

    #[test]
    fn without_an_equilibrium_the_arm_carries_the_most_it_can() {
        let equilibrium = Equilibrium {
            alpha_l: 0.72_f64,
            mass: 1.3,
            mu: 0.066,
        };
        for sin_beta in [0.7_f64, -0.7] {
            let arm = equilibrium.arm(0.0, sin_beta, 0.51_f64.sqrt());
            assert_eq!((arm.sin, arm.exists), (sin_beta.signum(), false));
            assert!(arm.cos.abs() < 1e-12);
        }
    }
}
