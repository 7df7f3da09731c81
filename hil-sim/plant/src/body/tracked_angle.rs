//! An angle whose sine and cosine are tracked.

use model::real::Real;

/// Largest turn for which the series are used, in rad. The omitted terms turn the result by less than a thirtieth of
/// the turn's fifth power: by a rounding error, 1e-15.
const SERIES_MAX_RAD: f64 = 0.002;

/// An angle with its sine and cosine.
#[derive(Debug, Clone, Copy)]
pub(super) struct TrackedAngle {
    /// The angle, in rad.
    pub(super) angle: f64,
    /// Its sine and cosine.
    pub(super) sin_cos: (f64, f64),
}

impl TrackedAngle {
    /// An angle with newly computed sine and cosine.
    pub(super) fn new(angle: f64) -> Self {
        Self {
            angle,
            sin_cos: Real::sin_cos(angle),
        }
    }

    /// Moves to another angle. For a small turn, as usual between two substeps, the series save most of the cost of a
    /// sine and a cosine; a larger turn computes both anew. Each call normalises the length of (sine, cosine) to 1,
    /// so neither the series' omitted terms nor rounding errors of many turns accumulate in the length.
    #[inline]
    pub(super) fn to(self, angle: f64) -> Self {
        let turn = angle - self.angle;
        // NaN is computed anew, too.
        if turn.abs() < SERIES_MAX_RAD {
            let (sin, cos) = self.sin_cos;
            let square = turn * turn;
            let s = turn - turn * square * (1.0 / 6.0);
            let c = 1.0 - 0.5 * square;
            let (sin, cos) = (sin * c + cos * s, cos * c - sin * s);
            let length = 1.5 - 0.5 * (sin * sin + cos * cos);
            Self {
                angle,
                sin_cos: (sin * length, cos * length),
            }
        } else {
            Self::new(angle)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_million_turns_by_series_end_where_they_should() {
        // A swinging arm, and a heading that keeps turning in steps of up to the series' largest turn.
        for (swing, turn) in [(0.6, 0.0), (0.0, 0.00199), (3.0, -0.001)] {
            let mut tracked = TrackedAngle::new(0.3);
            for step in 0..1_000_000_u32 {
                let time = f64::from(step);
                tracked = tracked.to(0.3 + swing * libm::sin(1e-3 * time) + turn * time);
            }
            let exact = TrackedAngle::new(tracked.angle);
            let error = (tracked.sin_cos.0 - exact.sin_cos.0).hypot(tracked.sin_cos.1 - exact.sin_cos.1);
            // A rounding error and the series' omitted terms, each at most 1e-15 and all of one sign, add up to 2e-9.
            assert!(error < 2e-9, "{swing} {turn}: {error}");
            let length = tracked.sin_cos.0.hypot(tracked.sin_cos.1);
            assert!((length - 1.0).abs() < 1e-15, "{length}");
        }
    }

    #[test]
    fn a_large_turn_is_computed_afresh() {
        for angle in [0.31, -2.0, 1e6, f64::NAN] {
            let (sin, cos) = TrackedAngle::new(0.3).to(angle).sin_cos;
            let exact = TrackedAngle::new(angle).sin_cos;
            assert_eq!((sin.to_bits(), cos.to_bits()), (exact.0.to_bits(), exact.1.to_bits()));
        }
    }
}
