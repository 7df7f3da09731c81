//! The full-state feedback that levels the spar: Eq. 7.19 with the gains of (7.20) and (7.21).

use crate::real::Real;

/// The law `v = -g . x` on the spar's angle from the vertical, the ballast's angle relative to the spar,
/// and their rates.
///
/// With the gains of ch. 7 every quantity is in the units of ch. 7 (time in 1/w_c, v as a torque over m_c g
/// l_c); `CoupledParameters::gains_in_vehicle_units` converts the gains to the vehicle's units.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SparLaw<T> {
    /// g: feedback of spar, ballast, spar rate, ballast rate.
    pub gains: [T; 4],
}

impl<T: Real> SparLaw<T> {
    /// The four products of Eq. 7.19, `-g_i x_i`, for the measured angles (rad) and rates.
    #[inline]
    pub fn terms(&self, spar: T, ballast: T, spar_rate: T, ballast_rate: T) -> [T; 4] {
        let [g1, g2, g3, g4] = self.gains;
        [-(g1 * spar), -(g2 * ballast), -(g3 * spar_rate), -(g4 * ballast_rate)]
    }

    /// The sum of the four products.
    #[inline]
    pub fn sum(terms: [T; 4]) -> T {
        let [spar, ballast, spar_rate, ballast_rate] = terms;
        spar + ballast + spar_rate + ballast_rate
    }

    /// The motor voltage for the measured angles (rad) and rates.
    ///
    /// ```
    /// use model::control::spar_law::SparLaw;
    /// // A spar turned anticlockwise (its camera leaning back) is righted by swinging the ballast forward.
    /// let law = SparLaw { gains: [-92.06, 6.84, -49.14, -6.50] };
    /// let v = law.voltage(0.01, 0.0, 0.0, 0.0);
    /// assert!((v - 0.9206_f32).abs() < 1e-6);
    /// ```
    #[inline]
    pub fn voltage(&self, spar: T, ballast: T, spar_rate: T, ballast_rate: T) -> T {
        Self::sum(self.terms(spar, ballast, spar_rate, ballast_rate))
    }
}
