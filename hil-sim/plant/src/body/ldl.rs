//! L D L^T factorisation of the vehicle's small symmetric matrix, factored once and solved for several
//! right-hand sides.
//!
//! The speeds with few couplings are eliminated first. The elements that stay zero are known in advance, which
//! saves nearly half of the dense work.

// The rows are constants. After inlining, every index and every loop is known, so the code has no bounds checks
// and no loop counters.
#![allow(clippy::inline_always)]

use super::{BALLAST, FORWARD, LEFT, LIFT, PHI, RIGHT, SIDE, SPAR, YAW};

/// Number of generalised speeds of the vehicle.
pub const SPEEDS: usize = 9;

/// A vector of generalised speeds, impulses or forces.
pub type Speeds = [f64; SPEEDS];

/// A symmetric matrix over the speeds; only its lower triangle is used.
pub type Symmetric = [[f64; SPEEDS]; SPEEDS];

// Rows below the diagonal of each column that are not zero, before or after elimination. A wheel couples to the
// axle's speeds and the arm, the ballast to spar and axle, the spar to axle and arm, and the remaining speeds
// to each other.
const WHEEL: [usize; 5] = [SIDE, FORWARD, LIFT, YAW, PHI];
const BELOW_BALLAST: [usize; 3] = [SPAR, FORWARD, LIFT];
const BELOW_SPAR: [usize; 3] = [FORWARD, LIFT, PHI];
const BELOW_SIDE: [usize; 4] = [FORWARD, LIFT, YAW, PHI];
const BELOW_FORWARD: [usize; 3] = [LIFT, YAW, PHI];
const BELOW_LIFT: [usize; 2] = [YAW, PHI];
const BELOW_YAW: [usize; 1] = [PHI];

/// A factored symmetric positive definite matrix with the vehicle's pattern of zeros.
#[derive(Debug)]
pub struct Factored<'a> {
    /// Unit lower triangle below the diagonal, reciprocal of D on it.
    lower: &'a Symmetric,
}

impl<'a> Factored<'a> {
    /// Factors `a` in place (its lower triangle, with the pattern above) without pivoting: `a` is positive
    /// definite, and L D L^T is insensitive to the scale of the unknowns.
    #[inline]
    pub fn new(a: &'a mut Symmetric) -> Self {
        eliminate(a, RIGHT, WHEEL);
        eliminate(a, LEFT, WHEEL);
        eliminate(a, BALLAST, BELOW_BALLAST);
        eliminate(a, SPAR, BELOW_SPAR);
        eliminate(a, SIDE, BELOW_SIDE);
        eliminate(a, FORWARD, BELOW_FORWARD);
        eliminate(a, LIFT, BELOW_LIFT);
        eliminate(a, YAW, BELOW_YAW);
        eliminate(a, PHI, []);
        Self { lower: a }
    }

    /// The solution x of `a x = b`.
    #[inline]
    pub fn solve(&self, mut b: Speeds) -> Speeds {
        let l = self.lower;
        forward(l, &mut b, RIGHT, WHEEL);
        forward(l, &mut b, LEFT, WHEEL);
        forward(l, &mut b, BALLAST, BELOW_BALLAST);
        forward(l, &mut b, SPAR, BELOW_SPAR);
        forward(l, &mut b, SIDE, BELOW_SIDE);
        forward(l, &mut b, FORWARD, BELOW_FORWARD);
        forward(l, &mut b, LIFT, BELOW_LIFT);
        forward(l, &mut b, YAW, BELOW_YAW);
        backward(l, &mut b, PHI, []);
        backward(l, &mut b, YAW, BELOW_YAW);
        backward(l, &mut b, LIFT, BELOW_LIFT);
        backward(l, &mut b, FORWARD, BELOW_FORWARD);
        backward(l, &mut b, SIDE, BELOW_SIDE);
        backward(l, &mut b, SPAR, BELOW_SPAR);
        backward(l, &mut b, BALLAST, BELOW_BALLAST);
        backward(l, &mut b, LEFT, WHEEL);
        backward(l, &mut b, RIGHT, WHEEL);
        b
    }
}

/// Eliminates column `j` with the non-zero rows `rows` below the diagonal, in ascending order.
#[inline(always)]
fn eliminate<const N: usize>(a: &mut Symmetric, j: usize, rows: [usize; N]) {
    let inverse = 1.0 / a[j][j];
    a[j][j] = inverse;
    let mut column = [0.0; N];
    for (value, i) in column.iter_mut().zip(rows) {
        *value = a[i][j];
    }
    for p in 0..N {
        let l = column[p] * inverse;
        for q in 0..=p {
            a[rows[p]][rows[q]] -= l * column[q];
        }
        a[rows[p]][j] = l;
    }
}

/// Column `j` of the solution with L.
#[inline(always)]
fn forward<const N: usize>(l: &Symmetric, b: &mut Speeds, j: usize, rows: [usize; N]) {
    for i in rows {
        b[i] -= l[i][j] * b[j];
    }
}

/// Row `j` of the solution with D L^T.
#[inline(always)]
fn backward<const N: usize>(l: &Symmetric, b: &mut Speeds, j: usize, rows: [usize; N]) {
    let mut value = b[j] * l[j][j];
    for i in rows {
        value -= l[i][j] * b[i];
    }
    b[j] = value;
}

/// Adds `weight * row row^T` for a sparse `row` of (index, value).
#[inline(always)]
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
#[inline(always)]
pub fn dot<const N: usize>(row: &[(usize, f64); N], v: &Speeds) -> f64 {
    let products = row.iter().map(|&(i, value)| value * v[i]);
    products.reduce(|sum, product| sum + product).unwrap_or(0.0)
}

/// Adds `weight * row` to `v`.
#[inline(always)]
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
        // A mass-like diagonal, every coupling of the vehicle, and one stiff constraint row (1e6 times the
        // rest) as of a sticking wheel.
        let mut a = [[0.0; SPEEDS]; SPEEDS];
        for (i, row) in a.iter_mut().enumerate() {
            row[i] = 0.5 + i as f64;
        }
        let couplings: [(usize, &[usize]); 5] = [
            (RIGHT, &WHEEL),
            (LEFT, &WHEEL),
            (BALLAST, &BELOW_BALLAST),
            (SPAR, &BELOW_SPAR),
            (SIDE, &BELOW_SIDE),
        ];
        for (j, rows) in couplings {
            for &i in rows {
                a[i][j] = 0.01 * (i * 3 + j) as f64;
            }
        }
        let row = [(FORWARD, 1.0), (YAW, 0.25), (RIGHT, -0.25)];
        add_outer(&mut a, &row, 1e6);
        let b: Speeds = core::array::from_fn(|i| (i as f64 * 1.7).sin());
        let mut factored = a;
        let x = Factored::new(&mut factored).solve(b);
        for i in 0..SPEEDS {
            let product: f64 = (0..SPEEDS).map(|j| if j <= i { a[i][j] } else { a[j][i] } * x[j]).sum();
            assert!((product - b[i]).abs() < 1e-9, "row {i}: {product} against {}", b[i]);
        }
        // The solution satisfies the stiff row: its rate is the load over 1e6, not the load over the mass.
        assert!(dot(&row, &x).abs() < 1e-4 && x[0].abs() > 1e-3);
    }
}
