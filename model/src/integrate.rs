//! The fixed-step integrator: bounded time, no allocation, no recursion.

use crate::real::Real;

/// One step of the classical fourth-order Runge-Kutta method: the state after `h`.
///
/// `rate` returns the derivative of the state; the input is constant over the step.
///
/// ```
/// use model::integrate::rk4_step;
/// // x' = -x from 1: e^-1 after ten steps of 0.1.
/// let x = (0..10).fold([1.0_f64], |x, _| rk4_step(&x, 0.1, |x| [-x[0]]));
/// assert!((x[0] - (-1.0_f64).exp()).abs() < 4e-7);
/// ```
#[inline]
pub fn rk4_step<T: Real, const N: usize>(x: &[T; N], h: T, rate: impl Fn(&[T; N]) -> [T; N]) -> [T; N] {
    let half = T::from_f64(0.5) * h;
    let k1 = rate(x);
    let k2 = rate(&advance(x, half, &k1));
    let k3 = rate(&advance(x, half, &k2));
    let k4 = rate(&advance(x, h, &k3));
    let (sixth, two) = (h / T::from_f64(6.0), T::from_f64(2.0));
    core::array::from_fn(|i| x[i] + sixth * (k1[i] + two * (k2[i] + k3[i]) + k4[i]))
}

/// `x + h k`, element by element.
#[inline]
fn advance<T: Real, const N: usize>(x: &[T; N], h: T, k: &[T; N]) -> [T; N] {
    core::array::from_fn(|i| x[i] + h * k[i])
}
