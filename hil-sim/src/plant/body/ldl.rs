//! L D L^T of the vehicle's small symmetric matrix, factored once and solved for several right sides.

/// Number of generalised speeds of the vehicle.
pub const SPEEDS: usize = 9;

/// A vector of generalised speeds, impulses or forces.
pub type Speeds = [f64; SPEEDS];

/// A symmetric matrix over the speeds; only its lower triangle is used.
pub type Symmetric = [[f64; SPEEDS]; SPEEDS];

/// A factored symmetric positive definite matrix.
#[derive(Debug, Clone)]
pub struct Factored {
    /// Unit lower triangle below the diagonal.
    lower: Symmetric,
    /// Reciprocal of D.
    inverse_diagonal: Speeds,
}

impl Factored {
    /// Factors `a` (its lower triangle) without pivoting: it is positive definite, and L D L^T does not
    /// care how its unknowns are scaled.
    // Rows and columns of fixed arrays within their own length: indices read better than zipped slices.
    #[allow(clippy::needless_range_loop)]
    #[inline]
    pub fn new(mut a: Symmetric) -> Self {
        let mut inverse_diagonal = [0.0; SPEEDS];
        for j in 0..SPEEDS {
            let inverse = 1.0 / a[j][j];
            inverse_diagonal[j] = inverse;
            for i in j + 1..SPEEDS {
                let l = a[i][j] * inverse;
                // Row i still holds l_ik d_k for k >= j in the columns not yet reached.
                for k in j + 1..=i {
                    a[i][k] -= l * a[k][j];
                }
                // Rows below still need l_ij d_j, so the scaled value is written when row i is done with.
            }
            for i in j + 1..SPEEDS {
                a[i][j] *= inverse;
            }
        }
        Self {
            lower: a,
            inverse_diagonal,
        }
    }

    /// The solution x of `a x = b`.
    #[allow(clippy::needless_range_loop)]
    #[inline]
    pub fn solve(&self, mut b: Speeds) -> Speeds {
        for j in 0..SPEEDS {
            for i in j + 1..SPEEDS {
                b[i] -= self.lower[i][j] * b[j];
            }
        }
        for j in 0..SPEEDS {
            b[j] *= self.inverse_diagonal[j];
        }
        for j in (0..SPEEDS).rev() {
            for i in 0..j {
                b[i] -= self.lower[j][i] * b[j];
            }
        }
        b
    }
}

/// Adds `weight * row row^T` for a sparse `row` of (index, value).
#[inline]
pub fn add_outer<const N: usize>(a: &mut Symmetric, row: &[(usize, f64); N], weight: f64) {
    for &(i, vi) in row {
        let scaled = weight * vi;
        for &(j, vj) in row {
            if j <= i {
                a[i][j] += scaled * vj;
            }
        }
    }
}

/// `row . v` for a sparse `row`.
#[inline]
pub fn dot<const N: usize>(row: &[(usize, f64); N], v: &Speeds) -> f64 {
    let mut sum = 0.0;
    for &(i, value) in row {
        sum += value * v[i];
    }
    sum
}

/// Adds `weight * row` to `v`.
#[inline]
pub fn add_scaled<const N: usize>(v: &mut Speeds, row: &[(usize, f64); N], weight: f64) {
    for &(i, value) in row {
        v[i] += weight * value;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn solves_a_stiff_system_to_the_residual_of_double_precision() {
        // Mass-like diagonal, one stiff constraint row (1e6 times the rest), as a stuck wheel makes.
        let mut a = [[0.0; SPEEDS]; SPEEDS];
        for (i, row) in a.iter_mut().enumerate() {
            row[i] = 0.01 + i as f64;
            for (j, value) in row.iter_mut().enumerate().take(i) {
                *value = 0.001 * (i * 3 + j) as f64;
            }
        }
        let row = [(0, 1.0), (3, 0.25), (4, -0.25)];
        add_outer(&mut a, &row, 1e6);
        let b: Speeds = core::array::from_fn(|i| (i as f64 * 1.7).sin());
        let x = Factored::new(a).solve(b);
        for i in 0..SPEEDS {
            let product: f64 = (0..SPEEDS).map(|j| if j <= i { a[i][j] } else { a[j][i] } * x[j]).sum();
            assert!((product - b[i]).abs() < 1e-9, "row {i}: {product} against {}", b[i]);
        }
        // The stiff row is obeyed: its rate is the load over 1e6, not the load over the mass.
        assert!(dot(&row, &x).abs() < 1e-4 && x[0].abs() > 1e-3);
    }
}
