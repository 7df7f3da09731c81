//! The speed law, Eq. 3.25 corrected: feed-forward of the steady state, compensation of the arm's weight, and
//! rate feedback.

use crate::real::Real;

/// The nondimensional speed law (3.25), corrected (errata E4, E5, E6):
/// `U = z_ff th'_ref + alpha L sin(phi) + kp (th' - th'_ref) - kd phi'`.
///
/// The weight term makes the law independent of the slope: at a steady speed `sin(beta) = alpha L sin(phi)`, so the term
/// equals the voltage that holds the slope, and the speed error is zero when `feed_forward_zeta` equals the plant's total
/// damping.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SpeedLaw<T> {
    /// Damping assumed in the feed-forward: the *total* damping, back-EMF included (2.2 for the
    /// thesis's vehicle), >= 0.
    pub feed_forward_zeta: T,
    /// `alpha L = m l / ((M + m) r)`, in (0, inf).
    pub alpha_l: T,
    /// Gain on the speed error `theta' - theta'_ref`: +0.8 in the thesis's example, i.e. *positive*
    /// feedback of the speed error. Stable only while `kp < zeta`.
    pub kp: T,
    /// Gain on phi', which enters with a minus sign: 10 in the thesis's example, >= 0.
    pub kd: T,
}

impl<T: Real> SpeedLaw<T> {
    /// The gains of (3.25) for a vehicle of total damping `zeta` and weight moment `alpha_l`.
    pub fn thesis(zeta: T, alpha_l: T) -> Self {
        Self {
            feed_forward_zeta: zeta,
            alpha_l,
            kp: T::from_f64(0.8),
            kd: T::from_f64(10.0),
        }
    }

    /// The terms for the reference speed `theta_rate_ref` and the sensed `phi` (rad from the vertical),
    /// `theta_rate` and `phi_rate` (rad per time unit).
    #[inline]
    pub fn terms(&self, theta_rate_ref: T, phi: T, theta_rate: T, phi_rate: T) -> SpeedLawTerms<T> {
        SpeedLawTerms {
            feed_forward: self.feed_forward_zeta * theta_rate_ref,
            weight: self.alpha_l * phi.sin(),
            speed_feedback: self.kp * (theta_rate - theta_rate_ref),
            swing_rate: -(self.kd * phi_rate),
        }
    }

    /// The nondimensional voltage U, the sum of [`SpeedLaw::terms`]. Not limited.
    ///
    /// ```
    /// use model::control::speed_law::SpeedLaw;
    /// let law = SpeedLaw::thesis(2.2_f64, 0.72);
    /// // At the reference speed with the arm hanging straight down, only the feed-forward remains.
    /// assert_eq!(law.voltage(1.0, 0.0, 1.0, 0.0), 2.2);
    /// ```
    #[inline]
    pub fn voltage(&self, theta_rate_ref: T, phi: T, theta_rate: T, phi_rate: T) -> T {
        self.terms(theta_rate_ref, phi, theta_rate, phi_rate).sum()
    }
}

/// The four terms of (3.25), nondimensional.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SpeedLawTerms<T> {
    /// `z_ff th'_ref`: holds the reference speed on the level.
    pub feed_forward: T,
    /// `alpha L sin(phi)`: carries the arm's weight.
    pub weight: T,
    /// `kp (th' - th'_ref)`: the speed error, fed back positively.
    pub speed_feedback: T,
    /// `-kd phi'`: the arm's rate, fed back.
    pub swing_rate: T,
}

impl<T: Real> SpeedLawTerms<T> {
    /// Their sum, U.
    #[inline]
    pub fn sum(&self) -> T {
        self.feed_forward + self.weight + self.speed_feedback + self.swing_rate
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// The oracle: the same law in SI units, (3.25) corrected: `1/(M+m)` on *all* of the damping and `g/r` on the weight.
    #[derive(Debug, Clone, Copy, PartialEq)]
    struct DimensionalSpeedLaw<T> {
        /// `C + K_T K_B / R_a`: damping of the drive, back-EMF included, in N m s/rad, >= 0.
        damping_n_m_s_rad: T,
        /// Wheel radius r in m, > 0.
        wheel_radius_m: T,
        /// Distance l of the arm's centre of mass from the axle in m, > 0.
        arm_length_m: T,
        /// Mass m of the arm in kg, > 0.
        arm_mass_kg: T,
        /// M + m in kg, > `arm_mass_kg`.
        total_mass_kg: T,
        /// g in m/s^2, > 0.
        gravity_m_s2: T,
        /// Nondimensional gain on the speed error (as in [`SpeedLaw::kp`]).
        kp: T,
        /// Nondimensional gain on phi' (as in [`SpeedLaw::kd`]).
        kd: T,
    }

    impl<T: Real> DimensionalSpeedLaw<T> {
        /// `u_hat = K_T V_a / (R_a r^2 (M+m)) = U w^2` in 1/s^2, from rates in rad/s.
        fn voltage_per_s2(&self, theta_rate_ref_rad_s: T, phi_rad: T, theta_rate_rad_s: T, phi_rate_rad_s: T) -> T {
            let r = self.wheel_radius_m;
            let w2 = self.gravity_m_s2 / r;
            theta_rate_ref_rad_s * self.damping_n_m_s_rad / (r * r * self.total_mass_kg)
                + w2 * self.arm_mass_kg * self.arm_length_m / (self.total_mass_kg * r) * phi_rad.sin()
                + (self.kp * (theta_rate_rad_s - theta_rate_ref_rad_s) - self.kd * phi_rate_rad_s) * w2.sqrt()
        }
    }

    fn reference_vehicle() -> DimensionalSpeedLaw<f64> {
        DimensionalSpeedLaw {
            damping_n_m_s_rad: 11.7,
            wheel_radius_m: 0.25,
            arm_length_m: 0.2,
            arm_mass_kg: 12.24,
            total_mass_kg: 13.6,
            gravity_m_s2: 9.81,
            kp: 0.8,
            kd: 10.0,
        }
    }

    /// The result that [`DimensionalSpeedLaw`] must equal: the nondimensional law between two conversions of units.
    fn through_nondimensional(
        d: &DimensionalSpeedLaw<f64>,
        reference: f64,
        phi: f64,
        theta_rate: f64,
        phi_rate: f64,
    ) -> f64 {
        let w = (d.gravity_m_s2 / d.wheel_radius_m).sqrt();
        let law = SpeedLaw {
            feed_forward_zeta: d.damping_n_m_s_rad / (d.wheel_radius_m.powi(2) * d.total_mass_kg * w),
            alpha_l: d.arm_mass_kg / d.total_mass_kg * d.arm_length_m / d.wheel_radius_m,
            kp: d.kp,
            kd: d.kd,
        };
        law.voltage(reference / w, phi, theta_rate / w, phi_rate / w) * w * w
    }

    /// Eq. 3.25 exactly as printed, with `C` and `K_B K_T / R_a` apart: no `1/(M+m)` on C, no `g/r` on sin(phi).
    fn as_printed(d: &DimensionalSpeedLaw<f64>, c: f64, back_emf: f64, rates: [f64; 3], phi: f64) -> f64 {
        let [reference, theta_rate, phi_rate] = rates;
        let (r, mass) = (d.wheel_radius_m, d.total_mass_kg);
        reference / (r * r) * (c + back_emf / mass)
            + d.arm_mass_kg * d.arm_length_m / (mass * r) * phi.sin()
            + (0.8 * (theta_rate - reference) - 10.0 * phi_rate) * (d.gravity_m_s2 / r).sqrt()
    }

    proptest! {
        #[test]
        fn both_forms_are_one_law(
            r in 0.05_f64..1.0, l in 0.02_f64..1.5, m in 0.1_f64..40.0, wheels in 0.05_f64..20.0, c in 0.0_f64..30.0,
            g in 1.0_f64..12.0, reference in -20.0_f64..20.0, phi in -3.0_f64..3.0,
            theta_rate in -30.0_f64..30.0, phi_rate in -10.0_f64..10.0,
        ) {
            let d = DimensionalSpeedLaw {
                damping_n_m_s_rad: c, wheel_radius_m: r, arm_length_m: l, arm_mass_kg: m, total_mass_kg: m + wheels,
                gravity_m_s2: g, kp: 0.8, kd: 10.0,
            };
            let a = d.voltage_per_s2(reference, phi, theta_rate, phi_rate);
            let b = through_nondimensional(&d, reference, phi, theta_rate, phi_rate);
            let scale = 1.0 + d.voltage_per_s2(reference.abs(), 1.5, 0.0, 0.0).abs() + 300.0 * (g / r).sqrt();
            prop_assert!((a - b).abs() < 1e-12 * scale, "{a} {b}");
        }
    }

    #[test]
    fn the_printed_law_commands_something_else() {
        let d = reference_vehicle();
        let (c, back_emf) = (1.065, d.damping_n_m_s_rad - 1.065);
        // Standing on the 5 degree slope: the weight term must command sin(beta) w^2; as printed it commands 1/w^2 of
        // that.
        let phi = (0.0873_f64.sin() / 0.72).asin();
        let w2 = 9.81 / 0.25;
        let hold = w2 * 0.0873_f64.sin();
        assert!((d.voltage_per_s2(0.0, phi, 0.0, 0.0) - hold).abs() < 1e-12);
        assert!((as_printed(&d, c, back_emf, [0.0; 3], phi) * w2 - hold).abs() < 1e-12);
        // Driving on the level at 6 rad/s: without 1/(M+m), C counts the bearing's damping 13.6 times.
        let (right, printed) = (
            d.voltage_per_s2(6.0, 0.0, 6.0, 0.0),
            as_printed(&d, c, back_emf, [6.0, 6.0, 0.0], 0.0),
        );
        let excess = 6.0 / 0.0625 * c * (1.0 - 1.0 / 13.6);
        assert!(
            (printed - right - excess).abs() < 1e-9 && printed / right > 2.0,
            "{printed} {right}"
        );
    }
}
