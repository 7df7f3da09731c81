//! Adaptive integration in f64: the explicit Runge-Kutta method of Dormand and Prince of order 8(5, 3)
//! with dense output of order 7, for states of any fixed size.

use super::dop853_coefficients as c;

/// Why an integration cannot continue: the next step is too small, or the limit on the number of steps is
/// reached.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[error("the motion cannot be followed beyond t = {t:e}: it needs steps of {step:e}")]
pub struct StepTooSmall {
    /// The reached time.
    pub t: f64,
    /// The required step.
    pub step: f64,
}

/// Largest number of steps of a sampled run: ten times the need of the longest span, and seconds of work.
pub const MOST_STEPS: u64 = 2_000_000;

/// An integration in progress: the state `x` at the time `t`.
#[derive(Debug, Clone)]
pub struct Dop853<const N: usize, F> {
    rate: F,
    tolerance: f64,
    t: f64,
    x: [f64; N],
    /// Length of the next step to try.
    h: f64,
    /// Number of remaining steps.
    steps_left: u64,
    /// The last step: start, length, state and the stages' rates (the thirteenth is the rate at its end).
    t_old: f64,
    h_old: f64,
    x_old: [f64; N],
    k: [[f64; N]; 16],
    rate_now: [f64; N],
}

/// The last step as a polynomial.
#[derive(Debug, Clone, Copy)]
pub struct Dense<const N: usize> {
    t: f64,
    h: f64,
    x: [f64; N],
    f: [[f64; N]; 7],
}

/// The first step tried, in time units.
const FIRST_STEP: f64 = 0.02;

impl<const N: usize, F: Fn(f64, &[f64; N]) -> [f64; N]> Dop853<N, F> {
    /// Starts at `x` at the time `t`; the local error of each component is kept below about
    /// `tolerance (1 + |x_i|)`.
    pub fn new(rate: F, t: f64, x: [f64; N], tolerance: f64) -> Self {
        let rate_now = rate(t, &x);
        let k = [[0.0; N]; 16];
        Self {
            rate,
            tolerance,
            t,
            x,
            h: FIRST_STEP,
            steps_left: u64::MAX,
            t_old: t,
            h_old: 0.0,
            x_old: x,
            k,
            rate_now,
        }
    }

    /// The same integration with at most `steps` steps.
    #[must_use]
    pub fn limited(self, steps: u64) -> Self {
        Self {
            steps_left: steps,
            ..self
        }
    }

    /// Number of remaining steps.
    pub fn steps_left(&self) -> u64 {
        self.steps_left
    }

    /// The reached time.
    pub fn time(&self) -> f64 {
        self.t
    }

    /// The state reached.
    pub fn state(&self) -> &[f64; N] {
        &self.x
    }

    /// The state's rate at the time reached.
    pub fn state_rate(&self) -> &[f64; N] {
        &self.rate_now
    }

    /// The state at which the last step started.
    pub fn before(&self) -> &[f64; N] {
        &self.x_old
    }

    /// Changes the tolerance of the steps to come.
    pub fn set_tolerance(&mut self, tolerance: f64) {
        self.tolerance = tolerance;
    }

    /// One accepted step, not beyond `limit`.
    ///
    /// # Errors
    /// [`StepTooSmall`] if the solution is not smooth or not finite.
    pub fn advance(&mut self, limit: f64) -> Result<(), StepTooSmall> {
        let remaining = limit - self.t;
        if remaining <= 0.0 {
            return Ok(());
        }
        if self.steps_left == 0 {
            return Err(StepTooSmall {
                t: self.t,
                step: self.h,
            });
        }
        self.steps_left -= 1;
        let mut grow = 6.0;
        loop {
            let last = self.h >= remaining;
            let h = if last { remaining } else { self.h };
            if h < 1e-13 * (1.0 + self.t.abs()) && !last {
                return Err(StepTooSmall { t: self.t, step: h });
            }
            let (next, error) = self.attempt(h);
            if error <= 1.0 {
                let factor = (0.9 * libm::pow(error.max(1e-12), -0.125)).clamp(0.2, grow);
                (self.t_old, self.h_old, self.x_old) = (self.t, h, self.x);
                self.t = if last { limit } else { self.t + h };
                self.x = next;
                self.rate_now = (self.rate)(self.t, &next);
                self.k[12] = self.rate_now;
                // A step that the limit shortened does not predict the length of the next step.
                self.h = if last { self.h.max(h * factor) } else { h * factor };
                return Ok(());
            }
            grow = 1.0;
            let factor = if error.is_finite() {
                (0.9 * libm::pow(error, -0.125)).clamp(0.1, 0.9)
            } else {
                0.1
            };
            self.h = h * factor;
            if self.h < 1e-13 * (1.0 + self.t.abs()) {
                return Err(StepTooSmall {
                    t: self.t,
                    step: self.h,
                });
            }
        }
    }

    /// The twelve stages of a step of length `h`: the state after it and its error over the tolerance.
    #[inline]
    fn attempt(&mut self, h: f64) -> ([f64; N], f64) {
        let (t, x) = (self.t, self.x);
        self.k[0] = self.rate_now;
        macro_rules! stage {
            ($i:literal, $row:ident) => {
                self.k[$i] = (self.rate)(t + c::C[$i] * h, &self.combined(&x, h, &c::$row));
            };
        }
        stage!(1, A1);
        stage!(2, A2);
        stage!(3, A3);
        stage!(4, A4);
        stage!(5, A5);
        stage!(6, A6);
        stage!(7, A7);
        stage!(8, A8);
        stage!(9, A9);
        stage!(10, A10);
        stage!(11, A11);
        let next = self.combined(&x, h, &c::B);
        let (e5, e3) = (self.weighted(&c::E5), self.weighted(&c::E3));
        let (mut s5, mut s3) = (0.0, 0.0);
        for i in 0..N {
            let scale = self.tolerance * (1.0 + x[i].abs().max(next[i].abs()));
            s5 += (e5[i] / scale).powi(2);
            s3 += (e3[i] / scale).powi(2);
        }
        let denominator = s5 + 0.01 * s3;
        let error = if denominator == 0.0 {
            0.0
        } else {
            h * s5 / (denominator * N as f64).sqrt()
        };
        (next, error)
    }

    /// `x + h sum of weighted stages`.
    #[inline]
    fn combined<const K: usize>(&self, x: &[f64; N], h: f64, row: &c::TableauRow<K>) -> [f64; N] {
        let sum = self.weighted(row);
        std::array::from_fn(|i| x[i] + h * sum[i])
    }

    #[inline]
    fn weighted<const K: usize>(&self, row: &c::TableauRow<K>) -> [f64; N] {
        let mut sum = [0.0; N];
        for &(stage, weight) in row {
            for (s, k) in sum.iter_mut().zip(&self.k[stage]) {
                *s += weight * k;
            }
        }
        sum
    }

    /// The last step as a polynomial (three more evaluations).
    pub fn dense(&mut self) -> Dense<N> {
        let (t, h, x) = (self.t_old, self.h_old, self.x_old);
        self.k[13] = (self.rate)(t + c::C[13] * h, &self.combined(&x, h, &c::A13));
        self.k[14] = (self.rate)(t + c::C[14] * h, &self.combined(&x, h, &c::A14));
        self.k[15] = (self.rate)(t + c::C[15] * h, &self.combined(&x, h, &c::A15));
        let d = [
            self.weighted(&c::D0),
            self.weighted(&c::D1),
            self.weighted(&c::D2),
            self.weighted(&c::D3),
        ];
        let mut f = [[0.0; N]; 7];
        for i in 0..N {
            let difference = self.x[i] - x[i];
            f[0][i] = difference;
            f[1][i] = h * self.k[0][i] - difference;
            f[2][i] = 2.0 * difference - h * (self.k[12][i] + self.k[0][i]);
            for j in 0..4 {
                f[3 + j][i] = h * d[j][i];
            }
        }
        Dense { t, h, x, f }
    }
}

impl<const N: usize> Dense<N> {
    /// Start time of the polynomial.
    pub fn start(&self) -> f64 {
        self.t
    }

    /// End time of the polynomial.
    pub fn end(&self) -> f64 {
        self.t + self.h
    }

    /// The state at a time of the step.
    #[inline]
    pub fn at(&self, t: f64) -> [f64; N] {
        if self.h == 0.0 {
            return self.x;
        }
        let s = (t - self.t) / self.h;
        let r = 1.0 - s;
        let f = &self.f;
        std::array::from_fn(|i| {
            let inner = f[3][i] + s * (f[4][i] + r * (f[5][i] + s * f[6][i]));
            self.x[i] + s * (f[0][i] + r * (f[1][i] + s * (f[2][i] + r * inner)))
        })
    }
}

/// The state at `t_end`.
///
/// # Errors
/// [`StepTooSmall`].
pub fn integrate<const N: usize>(
    rate: impl Fn(f64, &[f64; N]) -> [f64; N],
    t: f64,
    x: [f64; N],
    t_end: f64,
    tolerance: f64,
) -> Result<[f64; N], StepTooSmall> {
    let mut run = Dop853::new(rate, t, x, tolerance);
    while run.time() < t_end {
        run.advance(t_end)?;
    }
    Ok(*run.state())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A Kepler orbit of eccentricity 0.5: the exact solution by Kepler's equation.
    fn orbit(t: f64) -> [f64; 4] {
        let e = 0.5_f64;
        let anomaly = (0..60).fold(t, |a, _| a - (a - e * a.sin() - t) / (1.0 - e * a.cos()));
        let (s, c) = anomaly.sin_cos();
        let (b, r) = ((1.0 - e * e).sqrt(), 1.0 - e * c);
        [c - e, b * s, -s / r, b * c / r]
    }

    fn gravity(_: f64, x: &[f64; 4]) -> [f64; 4] {
        let r3 = (x[0] * x[0] + x[1] * x[1]).powf(1.5);
        [x[2], x[3], -x[0] / r3, -x[1] / r3]
    }

    #[test]
    fn follows_an_orbit_and_its_interpolant_does_too() {
        let mut run = Dop853::new(gravity, 0.0, orbit(0.0), 1e-12);
        let mut worst: f64 = 0.0;
        while run.time() < 6.0 {
            run.advance(6.0).unwrap();
            let dense = run.dense();
            for k in 0..=10 {
                let t = dense.start() + (dense.end() - dense.start()) * f64::from(k) / 10.0;
                let (a, b) = (dense.at(t), orbit(t));
                worst = (0..4).map(|i| (a[i] - b[i]).abs()).fold(worst, f64::max);
            }
        }
        assert!(worst < 1e-9 && run.time() == 6.0, "{worst}");
    }

    #[test]
    fn is_of_order_eight() {
        // One fixed step of the exponential: the error falls by 2^9 when the step is halved.
        let error = |h: f64| {
            let mut run = Dop853::new(|_, x: &[f64; 1]| [x[0]], 0.0, [1.0], 1e30);
            run.h = h;
            run.advance(h).unwrap();
            (run.state()[0] - h.exp()).abs()
        };
        let order = (error(1.0) / error(0.5)).log2();
        assert!((8.7..9.6).contains(&order), "{order}");
    }

    #[test]
    fn a_singularity_is_an_error() {
        assert!(integrate(|_, x: &[f64; 1]| [x[0] * x[0]], 0.0, [1.0], 2.0, 1e-10).is_err());
    }
}
