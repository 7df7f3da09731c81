//! Eigenvalues of a real matrix, in the form in which the commands print poles.

use nalgebra::{DMatrix, SMatrix, Schur};

/// Largest number of iterations of the Schur decomposition; matrices of this crate need fewer than 100.
const MOST_ITERATIONS: usize = 1000;

/// The eigenvalues as `[re, im]`, by real part, then by imaginary part, ascending; `None` if `a` is not
/// finite or the iteration does not converge.
pub fn eigenvalues<const N: usize>(a: &SMatrix<f64, N, N>) -> Option<[[f64; 2]; N]> {
    if !a.iter().all(|x| x.is_finite()) {
        return None;
    }
    let schur = Schur::try_new(DMatrix::from_fn(N, N, |i, j| a[(i, j)]), f64::EPSILON, MOST_ITERATIONS)?;
    let values = schur.complex_eigenvalues();
    // The library takes the imaginary part from a discriminant that rounding may make positive at a double
    // eigenvalue: the part is then NaN and means 0.
    let or_zero = |im: f64| if im.is_nan() { 0.0 } else { im };
    let mut found = std::array::from_fn(|i| [values[i].re, or_zero(values[i].im)]);
    found.sort_by(|p, q| p[0].total_cmp(&q[0]).then(p[1].total_cmp(&q[1])));
    Some(found)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A fixed sequence of numbers in (-1, 1).
    fn numbers(seed: u64) -> impl FnMut() -> f64 {
        let mut state = seed;
        move || {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
        }
    }

    /// The power sums of the eigenvalues are the traces of the powers of the matrix, and N of them fix the
    /// N eigenvalues (Newton's identities).
    fn check_power_sums<const N: usize>(rows: &[[f64; N]; N]) {
        let found = eigenvalues(&SMatrix::<f64, N, N>::from_fn(|i, j| rows[i][j])).unwrap();
        let mut power = *rows;
        let mut values = found;
        for k in 1..=N {
            let trace: f64 = (0..N).map(|i| power[i][i]).sum();
            let sum = values.iter().fold([0.0; 2], |s, z| [s[0] + z[0], s[1] + z[1]]);
            assert!((sum[0] - trace).hypot(sum[1]) < 2e-12, "power {k}: {sum:?} {trace}");
            power = std::array::from_fn(|i| std::array::from_fn(|j| (0..N).map(|n| power[i][n] * rows[n][j]).sum()));
            for (value, z) in values.iter_mut().zip(found) {
                *value = [value[0] * z[0] - value[1] * z[1], value[0] * z[1] + value[1] * z[0]];
            }
        }
    }

    #[test]
    fn eigenvalues_have_the_power_sums_of_the_matrix() {
        let mut next = numbers(7);
        for _ in 0..300 {
            // The spectral radius stays near 1, so that the powers neither grow nor vanish.
            check_power_sums::<4>(&std::array::from_fn(|_| std::array::from_fn(|_| 0.8 * next())));
            check_power_sums::<8>(&std::array::from_fn(|_| std::array::from_fn(|_| 0.5 * next())));
        }
    }

    #[test]
    fn known_eigenvalues() {
        let of = |rows: &[f64]| eigenvalues(&SMatrix::<f64, 3, 3>::from_row_slice(rows));
        // A cyclic permutation: the roots of unity, which an unshifted iteration never separates.
        let roots = of(&[0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0]).unwrap();
        let im = 0.75_f64.sqrt();
        for (r, w) in roots.iter().zip([[-0.5, -im], [-0.5, im], [1.0, 0.0]]) {
            assert!((r[0] - w[0]).hypot(r[1] - w[1]) < 1e-14, "{roots:?}");
        }
        assert_eq!(of(&[0.0; 9]), Some([[0.0; 2]; 3]));
        assert_eq!(of(&[f64::NAN; 9]), None);
        assert_eq!(
            eigenvalues(&SMatrix::<f64, 2, 2>::new(0.0, 1.0, -4.0, 0.0)),
            Some([[0.0, -2.0], [0.0, 2.0]])
        );
    }

    /// Rounding splits the double root of a companion matrix along or across the real axis, and every part
    /// of the roots stays finite.
    #[test]
    fn double_eigenvalues_have_numbers() {
        let mut next = numbers(3);
        for _ in 0..20_000 {
            let (double, a, b) = (0.01 + 5.0 * next().abs(), 40.0 * next().abs(), 3.0 * next().abs());
            let (p1, p0, q1, q0) = (2.0 * double, double * double, a + b, a * b);
            let mut companion = SMatrix::<f64, 4, 4>::zeros();
            companion.fixed_view_mut::<3, 3>(1, 0).fill_with_identity();
            for (k, c) in [p1 + q1, p0 + p1 * q1 + q0, p1 * q0 + p0 * q1, p0 * q0]
                .into_iter()
                .enumerate()
            {
                companion[(0, k)] = -c;
            }
            let found = eigenvalues(&companion).unwrap();
            assert!(found.iter().flatten().all(|x| x.is_finite()), "{companion} {found:?}");
        }
    }
}
