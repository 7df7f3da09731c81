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

/// The optimal gains of the thesis's spar for Q = diag(10000, 100, 0, 0), r = 1.
///
/// (7.21), corrected: `g = (1/r) b^T P` with `v = -g . x`. The printed vector [92.06, 6.84, -49.14, -6.96]
/// lacks the sign of its first element and misprints 6.496 as 6.96; it is unstable with either sign of v
/// (erratum E28).
pub const THESIS_SPAR_GAINS: [f32; 4] = [-92.06057, 6.84090, -49.14485, -6.49598];

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
    /// use model::control::spar_law::{SparLaw, THESIS_SPAR_GAINS};
    /// // A spar turned anticlockwise (its camera leaning back) is righted by swinging the ballast forward.
    /// let law = SparLaw { gains: THESIS_SPAR_GAINS };
    /// let v = law.voltage(0.01, 0.0, 0.0, 0.0);
    /// assert!((v - 0.920_605_7).abs() < 1e-6);
    /// ```
    #[inline]
    pub fn voltage(&self, spar: T, ballast: T, spar_rate: T, ballast_rate: T) -> T {
        Self::sum(self.terms(spar, ballast, spar_rate, ballast_rate))
    }
}
