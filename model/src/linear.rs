//! Small dense linear algebra on fixed arrays: bounded time, no allocation.

use crate::real::Real;

/// The solution of `a x = b` for a symmetric positive definite `a` (only its lower triangle is read).
///
/// `L D L^T` without pivoting, which needs no square roots and is insensitive to the scaling of the
/// unknowns: a spar of a thousandth of the vehicle's mass costs no digits.
///
/// ```
/// use model::linear::solve_symmetric;
/// let x = solve_symmetric([[4.0_f64, 0.0], [2.0, 3.0]], [8.0, 7.0]);
/// assert!((x[0] - 1.25).abs() < 1e-15 && (x[1] - 1.5).abs() < 1e-15);
/// ```
// All indices lie within the fixed arrays, and indices read better here than zipped slices.
#[allow(clippy::needless_range_loop)]
#[inline]
pub fn solve_symmetric<T: Real, const N: usize>(mut a: [[T; N]; N], mut b: [T; N]) -> [T; N] {
    for j in 0..N {
        // Row j: a[j][k] becomes l_jk d_k, then l_jk; a[j][j] becomes d_j.
        for k in 0..j {
            for i in 0..k {
                a[j][k] -= a[j][i] * a[k][i];
            }
        }
        for k in 0..j {
            let scaled = a[j][k];
            let l = scaled / a[k][k];
            a[j][j] -= scaled * l;
            a[j][k] = l;
            b[j] -= l * b[k];
        }
    }
    for j in (0..N).rev() {
        b[j] = b[j] / a[j][j];
        for k in j + 1..N {
            b[j] -= a[k][j] * b[k];
        }
    }
    b
}
