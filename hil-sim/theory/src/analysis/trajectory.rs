//! Runs of a model, sampled on a grid, with the extremes between the samples.

use std::ops::ControlFlow;

use super::dop853::{Dense, Dop853, MOST_STEPS, StepTooSmall};
use super::roots::root_between;

/// The local error allowed in every run of this crate's spatial, camera and coupled analyses.
pub const TOLERANCE: f64 = 1e-12;

/// A run on a grid of times `0, dt, 2 dt, ...`.
#[derive(Debug, Clone, Default)]
pub struct Trajectory<const N: usize> {
    /// The times.
    pub t: Vec<f64>,
    /// The states at these times.
    pub x: Vec<[f64; N]>,
}

impl<const N: usize> Trajectory<N> {
    /// One component over the samples.
    pub fn component(&self, index: usize) -> Vec<f64> {
        self.x.iter().map(|x| x[index]).collect()
    }

    /// Appends the samples `k dt` (up to `t_end`) that lie in the step `dense`.
    pub fn sample(&mut self, dense: &Dense<N>, dt: f64, t_end: f64) {
        loop {
            let t = self.t.len() as f64 * dt;
            // Rounding must not drop the sample at `t_end`.
            if t > t_end * (1.0 + 1e-12) || t.min(t_end) > dense.end() {
                return;
            }
            self.t.push(t);
            self.x.push(dense.at(t.min(t_end)));
        }
    }
}

/// Follows `rate` from `x` at t = 0 to `t_end`, passes every step to `visit`, and stops early when
/// `visit` breaks. No step spans one of the `kinks`, the times at which the input is not smooth.
///
/// # Errors
/// [`StepTooSmall`] where the solution cannot be followed.
pub fn follow<const N: usize>(
    rate: impl Fn(f64, &[f64; N]) -> [f64; N],
    x: [f64; N],
    t_end: f64,
    kinks: &[f64],
    mut visit: impl FnMut(&Dense<N>) -> ControlFlow<()>,
) -> Result<(), StepTooSmall> {
    let mut run = Dop853::new(rate, 0.0, x, TOLERANCE).limited(MOST_STEPS);
    while run.time() < t_end {
        let limit = kinks.iter().copied().filter(|k| *k > run.time()).fold(t_end, f64::min);
        run.advance(limit)?;
        if visit(&run.dense()).is_break() {
            break;
        }
    }
    Ok(())
}

/// The smallest and the largest value of an angle over a run, between the samples too.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Extent {
    /// The smallest value.
    pub low: f64,
    /// The largest value.
    pub high: f64,
}

impl Extent {
    /// The extent of no values.
    pub const EMPTY: Self = Self {
        low: f64::INFINITY,
        high: f64::NEG_INFINITY,
    };

    /// Widens the extent by the component `index` of the step `dense` from the time `from` on; component
    /// `index + N / 2` is its rate.
    pub fn see<const N: usize>(&mut self, dense: &Dense<N>, from: f64, index: usize) {
        const PIECES: u8 = 6;
        let start = from.max(dense.start());
        if start > dense.end() {
            return;
        }
        let width = (dense.end() - start) / f64::from(PIECES);
        let slope = |t: f64| dense.at(t)[index + N / 2];
        let mut take = |t: f64| {
            let value = dense.at(t)[index];
            self.low = self.low.min(value);
            self.high = self.high.max(value);
        };
        take(start);
        for k in 0..PIECES {
            let (a, b) = (start + width * f64::from(k), start + width * f64::from(k + 1));
            take(b);
            if slope(a) * slope(b) < 0.0 {
                take(root_between(slope, a, b, 1e-13 * (1.0 + b)));
            }
        }
    }

    /// Half the distance between the two.
    pub fn half_width(&self) -> f64 {
        0.5 * (self.high - self.low)
    }

    /// The larger absolute value.
    pub fn largest(&self) -> f64 {
        self.high.abs().max(self.low.abs())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn samples_and_extremes_of_a_swing() {
        let (mut run, mut extent) = (Trajectory::default(), Extent::EMPTY);
        let result = follow(
            |_, x: &[f64; 2]| [x[1], -x[0]],
            [0.3, 0.4],
            10.0,
            &[3.0],
            |step| {
                run.sample(step, 0.1, 10.0);
                extent.see(step, 0.0, 0);
                ControlFlow::Continue(())
            },
        );
        assert_eq!(result, Ok(()));
        assert_eq!(run.t.len(), 101);
        for (t, x) in run.t.iter().zip(&run.x) {
            assert!((x[0] - 0.3 * t.cos() - 0.4 * t.sin()).abs() < 1e-10);
        }
        assert!((extent.half_width() - 0.5).abs() < 1e-10 && (extent.largest() - 0.5).abs() < 1e-10);
    }
}
