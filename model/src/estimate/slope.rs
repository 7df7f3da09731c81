//! The slope under the wheels, from the balance of forces: no sensor measures it.
//!
//! Subtracting (3.13) from (3.12) eliminates the motor torque and the friction of the drive:
//!
//! ```text
//! (1 + S) sin(beta) = alpha L sin(phi) - (1 + S + mu - alpha L cos(beta - phi)) theta''
//!                   + (alpha L^2 - alpha L cos(beta - phi)) phi'' - alpha L sin(beta - phi) phi'^2
//! ```
//!
//! with S the spar's mass over M + m (Eq. 8.8, corrected). At rest the equation reduces to `alpha L sin(phi_o) = (1 + S)
//! sin(beta)`; while driving, its other terms compensate the accelerations. The estimator low-passes the result, because
//! the accelerations are differentiated rates.

use super::rate_filter::LowPass;
use crate::bounded::Bounded;

/// Slope estimator, nondimensional inside.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SlopeEstimator {
    alpha_l: f32,
    alpha_l2: f32,
    inertia: f32,
    weight: f32,
    filtered: LowPass,
    sin: f32,
    cos: f32,
}

/// Sine of the steepest slope that the estimator accepts.
const SIN_MAX: f32 = 0.9;

impl SlopeEstimator {
    /// An estimator with the time constant `tau_s`, called every `dt_s` seconds, for a vehicle with the given
    /// nondimensional parameters (`spar` is S, 0 without a spar).
    pub fn new(dt_s: f32, tau_s: f32, l: f32, alpha: f32, mu: f32, spar: f32) -> Self {
        Self {
            alpha_l: alpha * l,
            alpha_l2: alpha * l * l,
            inertia: 1.0 + spar + mu,
            weight: 1.0 / (1.0 + spar),
            filtered: LowPass::new(dt_s, tau_s),
            sin: 0.0,
            cos: 1.0,
        }
    }

    /// Follows a turn of the vehicle, which changes the sine of the slope along its heading by `change`: the angle turned
    /// by times the sine of the axle's roll (left end up).
    pub fn turn(&mut self, change: f32) {
        self.filtered
            .reset((self.filtered.value() + change).bounded(-SIN_MAX, SIN_MAX));
    }

    /// Updates the estimate with the arm's angle (as sine and cosine), and rates and accelerations in rad per time unit.
    pub fn update(
        &mut self,
        sin_phi: f32,
        cos_phi: f32,
        phi_rate: f32,
        phi_acceleration: f32,
        theta_acceleration: f32,
    ) {
        let balance = self.balance(sin_phi, cos_phi, phi_rate, phi_acceleration, theta_acceleration);
        self.filtered.update(balance.bounded(-SIN_MAX, SIN_MAX));
        self.set(self.filtered.value());
    }

    /// Sets the slope from the arm's angle alone, which is right only while the vehicle and its arm are at rest.
    pub fn align(&mut self, sin_phi: f32) {
        let sin = (self.alpha_l * sin_phi * self.weight).bounded(-SIN_MAX, SIN_MAX);
        self.filtered.reset(sin);
        self.set(sin);
    }

    /// Applies the change of the slope's sine that the speed law's observers found.
    pub fn learn(&mut self, change: f32) {
        self.reset((self.filtered.value() + change).bounded(-SIN_MAX, SIN_MAX));
    }

    /// Sets the sine of the slope.
    pub fn reset(&mut self, sin: f32) {
        self.filtered.reset(sin);
        self.set(sin);
    }

    /// Sine of the arm's angle at which the vehicle stands still on a slope of the sine `sin_slope`.
    pub fn sin_equilibrium(&self, sin_slope: f32) -> f32 {
        sin_slope / (self.alpha_l * self.weight)
    }

    /// sin(beta) from the balance of forces, unfiltered.
    fn balance(
        &self,
        sin_phi: f32,
        cos_phi: f32,
        phi_rate: f32,
        phi_acceleration: f32,
        theta_acceleration: f32,
    ) -> f32 {
        let cos_relative = self.cos * cos_phi + self.sin * sin_phi;
        let sin_relative = self.sin * cos_phi - self.cos * sin_phi;
        let coupling = self.alpha_l * cos_relative;
        self.weight
            * (self.alpha_l * sin_phi - (self.inertia - coupling) * theta_acceleration
                + (self.alpha_l2 - coupling) * phi_acceleration
                - self.alpha_l * sin_relative * phi_rate * phi_rate)
    }

    fn set(&mut self, sin: f32) {
        self.sin = sin;
        self.cos = square_root::sqrtf(1.0 - sin * sin);
    }

    /// Sine of the slope.
    pub fn sin(&self) -> f32 {
        self.sin
    }

    /// Cosine of the slope.
    pub fn cos(&self) -> f32 {
        self.cos
    }

    /// The slope in rad, positive uphill.
    pub fn angle_rad(&self) -> f32 {
        libm::asinf(self.sin)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dynamics::planar::{PHI, PHI_RATE, Planar, PlanarParameters};

    /// Along an open-loop run of the exact equations of motion the balance gives the true slope at every instant,
    /// whatever the voltage.
    #[test]
    fn the_balance_is_exact_along_any_motion() {
        for beta in [-0.3_f64, 0.0, 0.0873, 0.4] {
            let parameters = PlanarParameters {
                beta,
                nu: 0.0583,
                ..PlanarParameters::thesis()
            };
            let planar = Planar::new(parameters);
            let mut estimator = SlopeEstimator::new(0.001, 1.0, 0.8, 0.9, 0.066, 0.0);
            estimator.set(beta.sin() as f32);
            let mut x = [0.0, 0.1, 0.0, 0.0];
            for k in 0..3000 {
                let u = 1.5 * (f64::from(k) * 0.003).sin();
                x = planar.rk4(&x, u, 0.005);
                let [theta_acceleration, phi_acceleration] = planar.accelerations(&x, u);
                let (s, c) = x[PHI].sin_cos();
                let sin_beta = estimator.balance(
                    s as f32,
                    c as f32,
                    x[PHI_RATE] as f32,
                    phi_acceleration as f32,
                    theta_acceleration as f32,
                );
                assert!((f64::from(sin_beta) - beta.sin()).abs() < 2e-5, "{beta}: {sin_beta}");
            }
        }
    }

    #[test]
    fn a_resting_vehicle_with_a_spar_shows_its_slope() {
        let mut estimator = SlopeEstimator::new(0.001, 1.0, 0.8, 0.9, 0.066, 0.3);
        let beta = 0.2_f32;
        let sin_phi = 1.3 * beta.sin() / 0.72;
        estimator.align(sin_phi);
        assert!((estimator.angle_rad() - beta).abs() < 1e-6);
        let cos_phi = (1.0 - sin_phi * sin_phi).sqrt();
        for _ in 0..1000 {
            estimator.update(sin_phi, cos_phi, 0.0, 0.0, 0.0);
        }
        assert!((estimator.angle_rad() - beta).abs() < 1e-5, "{}", estimator.angle_rad());
    }
}
