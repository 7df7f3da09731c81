//! Angles whose sines and cosines are tracked.

use model::real::Real;

/// Largest turn for which the series are used, in rad. The omitted terms turn the result by less than a thirtieth of
/// the turn's fifth power: by a rounding error, 1e-15.
const SERIES_MAX_RAD: f64 = 0.002;

/// Angles with their sines and cosines.
// Separate arrays of each quantity let one instruction process two angles.
#[derive(Debug, Clone, Copy)]
pub(super) struct TrackedAngles<const N: usize> {
    angle: [f64; N],
    sin: [f64; N],
    cos: [f64; N],
}

impl<const N: usize> TrackedAngles<N> {
    /// Angles with newly computed sines and cosines.
    pub(super) fn new(angle: [f64; N]) -> Self {
        let (sin, cos) = (angle.map(|a| Real::sin_cos(a).0), angle.map(|a| Real::sin_cos(a).1));
        Self { angle, sin, cos }
    }

    /// The angles, in rad.
    pub(super) fn angles(&self) -> &[f64; N] {
        &self.angle
    }

    /// Sine and cosine of each angle.
    #[inline]
    pub(super) fn sin_cos(&self) -> [(f64, f64); N] {
        core::array::from_fn(|i| (self.sin[i], self.cos[i]))
    }

    /// Moves to other angles. For small turns, as usual between two substeps, the series save most of the cost of a
    /// sine and a cosine; a larger turn computes both anew. Each call normalises the length of (sine, cosine) to 1,
    /// so neither the series' omitted terms nor rounding errors of many turns accumulate in the length.
    #[inline]
    pub(super) fn to(&self, angle: [f64; N]) -> Self {
        let mut next = *self;
        let mut small = true;
        // Four arrays side by side, which the compiler takes two at a time.
        #[allow(clippy::needless_range_loop)]
        for i in 0..N {
            let turn = angle[i] - self.angle[i];
            // NaN is computed anew, too.
            small &= turn.abs() < SERIES_MAX_RAD;
            let square = turn * turn;
            let s = turn - turn * square * (1.0 / 6.0);
            let c = 1.0 - 0.5 * square;
            let (sin, cos) = (self.sin[i] * c + self.cos[i] * s, self.cos[i] * c - self.sin[i] * s);
            let length = 1.5 - 0.5 * (sin * sin + cos * cos);
            (next.angle[i], next.sin[i], next.cos[i]) = (angle[i], sin * length, cos * length);
        }
        if !small {
            next.compute_large(&self.angle);
        }
        next
    }

    /// Computes anew what has turned far from the angles `before`.
    #[cold]
    fn compute_large(&mut self, before: &[f64; N]) {
        let turned = self.angle.iter().zip(before);
        for ((sin, cos), (angle, before)) in self.sin.iter_mut().zip(&mut self.cos).zip(turned) {
            if (angle - before).abs() < SERIES_MAX_RAD {
                continue;
            }
            (*sin, *cos) = Real::sin_cos(*angle);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_million_turns_by_series_end_where_they_should() {
        // A swinging arm, and a heading that keeps turning in steps of up to the series' largest turn.
        let motions = [(0.6, 0.0), (0.0, 0.00199), (3.0, -0.001)];
        let mut tracked = TrackedAngles::new([0.3; 3]);
        for step in 0..1_000_000_u32 {
            let time = f64::from(step);
            tracked = tracked.to(motions.map(|(swing, turn)| 0.3 + swing * libm::sin(1e-3 * time) + turn * time));
        }
        let exact = TrackedAngles::new(*tracked.angles());
        for ((sin, cos), (exact_sin, exact_cos)) in tracked.sin_cos().into_iter().zip(exact.sin_cos()) {
            let error = (sin - exact_sin).hypot(cos - exact_cos);
            // A rounding error and the series' omitted terms, each at most 1e-15 and all of one sign, add up to 2e-9.
            assert!(error < 2e-9, "{error}");
            let length = sin.hypot(cos);
            assert!((length - 1.0).abs() < 1e-15, "{length}");
        }
    }

    #[test]
    fn a_large_turn_is_computed_afresh_and_alone() {
        let bits = |(sin, cos): (f64, f64)| (sin.to_bits(), cos.to_bits());
        for angle in [0.31, -2.0, 1e6, f64::NAN] {
            let [near, far] = TrackedAngles::new([0.3; 2]).to([0.301, angle]).sin_cos();
            let [exact] = TrackedAngles::new([angle]).sin_cos();
            assert_eq!(bits(far), bits(exact));
            let [small] = TrackedAngles::new([0.3]).to([0.301]).sin_cos();
            assert_eq!(bits(near), bits(small));
        }
    }
}
