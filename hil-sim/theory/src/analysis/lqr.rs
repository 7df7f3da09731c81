//! The optimal regulator of the camera spar: Eq. 7.20 and 7.21, corrected, for any parameters and weights.

use model::dynamics::camera::CameraParameters;
use serde::Serialize;
use thiserror::Error;

use crate::analysis::matrix::{
    Matrix, applied, eigenvalues, identity, inverse, largest, product, solved, sum, transposed,
};

/// The weights of the cost (7.20): `q` on the squares of theta, phi, theta', phi', and `r` on v^2.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Weights {
    /// Diagonal of Q, each >= 0 (Q need only be positive semidefinite).
    pub q: [f64; 4],
    /// Weight of the control effort, > 0.
    pub r: f64,
}

impl Weights {
    /// The thesis's (ch. 7.5): Q = diag(10000, 100, 0, 0), r = 1.
    pub const THESIS: Self = Self {
        q: [10_000.0, 100.0, 0.0, 0.0],
        r: 1.0,
    };
}

/// The optimal regulator.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Regulator {
    /// g of `v = -g . x`: `(1/r) b^T P`, without the minus of (7.21) (erratum E28).
    pub gains: [f64; 4],
    /// Poles of `A - b g^T` as [re, im].
    pub poles: [[f64; 2]; 4],
    /// Largest element of `P A + A^T P - P b b^T P / r + Q` over the largest element of its terms.
    pub riccati_residual: f64,
}

/// Why there is no optimal regulator.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Error)]
#[error(
    "no stabilising solution of the Riccati equation: the weights leave a motion that is not damped unseen, or the motor cannot reach it"
)]
pub struct NoRegulator;

/// The optimal regulator of the spar `camera` under `weights`.
///
/// # Errors
/// [`NoRegulator`] when the Riccati equation has no stabilising solution.
pub fn regulator(camera: &CameraParameters<f64>, weights: &Weights) -> Result<Regulator, NoRegulator> {
    let (a, b) = camera.linearisation();
    let p = riccati(&a, &b, weights).ok_or(NoRegulator)?;
    let gains = applied(&p, &b).map(|x| x / weights.r);
    let poles = closed_loop_poles(camera, &gains).ok_or(NoRegulator)?;
    if poles.iter().any(|p| p[0] >= 0.0) {
        return Err(NoRegulator);
    }
    Ok(Regulator {
        gains,
        poles,
        riccati_residual: residual(&a, &b, weights, &p),
    })
}

/// The poles of the spar under `v = -g . x`; `None` if a number is not finite.
pub fn closed_loop_poles(camera: &CameraParameters<f64>, gains: &[f64; 4]) -> Option<[[f64; 2]; 4]> {
    let (a, b) = camera.linearisation();
    eigenvalues(&closed_loop(&a, &b, gains))
}

/// `A - b g^T`.
fn closed_loop(a: &Matrix<4>, b: &[f64; 4], gains: &[f64; 4]) -> Matrix<4> {
    std::array::from_fn(|i| std::array::from_fn(|j| a[i][j] - b[i] * gains[j]))
}

/// The stabilising solution P of the algebraic Riccati equation: Newton's method (Kleinman's iteration),
/// which converges from any stabilising gains, until rounding is all that is left.
fn riccati(a: &Matrix<4>, b: &[f64; 4], weights: &Weights) -> Option<Matrix<4>> {
    let gains = stabilising_gains(a, b, weights)?;
    let cost: Matrix<4> = std::array::from_fn(|i| {
        std::array::from_fn(|j| {
            let q = if i == j { weights.q[i] } else { 0.0 };
            q + weights.r * gains[i] * gains[j]
        })
    });
    let mut p = lyapunov(&closed_loop(a, b, &gains), &cost)?;
    let mut left = residual(a, b, weights, &p);
    for _ in 0..200 {
        // The step as a correction: what rounding spoiled in one is in the next one's residual.
        let gains = applied(&p, b).map(|x| x / weights.r);
        let (defect, _) = defect(a, b, weights, &p);
        let next = sum(&p, 1.0, &lyapunov(&closed_loop(a, b, &gains), &defect)?);
        let after = residual(a, b, weights, &next);
        if !after.is_finite() || after >= left {
            break;
        }
        (p, left) = (next, after);
    }
    Some(p)
}

/// Gains that stabilise, nearly optimal under `weights`: from the Hamiltonian, or where its elements
/// are too far apart for that, from the Hamiltonian of a dearer control.
fn stabilising_gains(a: &Matrix<4>, b: &[f64; 4], weights: &Weights) -> Option<[f64; 4]> {
    (0..12).find_map(|k| {
        let dearer = Weights {
            r: weights.r * 100_f64.powi(k),
            ..*weights
        };
        let p = from_hamiltonian(a, b, &dearer)?;
        let gains = applied(&p, b).map(|x| x / dearer.r);
        let poles = eigenvalues(&closed_loop(a, b, &gains))?;
        poles.iter().all(|p| p[0] < 0.0).then_some(gains)
    })
}

/// P from the invariant subspace of the stable poles of the Hamiltonian, which the matrix sign singles
/// out: `(sign(H) + 1) [1; P] = 0`.
fn from_hamiltonian(a: &Matrix<4>, b: &[f64; 4], weights: &Weights) -> Option<Matrix<4>> {
    // Costates in the unit that makes both off-diagonal blocks equally large: fewer digits lost.
    let (seen, reached) = (largest_of(&weights.q), largest_of(b).powi(2) / weights.r);
    let unit = if seen > 0.0 { (seen / reached).sqrt() } else { 1.0 };
    let mut z: Matrix<8> = std::array::from_fn(|i| {
        std::array::from_fn(|j| match (i < 4, j < 4) {
            (true, true) => a[i][j],
            (true, false) => -unit * b[i] * b[j - 4] / weights.r,
            (false, true) => {
                if i - 4 == j {
                    -weights.q[j] / unit
                } else {
                    0.0
                }
            }
            (false, false) => -a[j - 4][i - 4],
        })
    });
    let mut converged = false;
    for _ in 0..80 {
        let (inverted, determinant) = inverse(&z)?;
        // Scaling by the determinant brings the poles near 1 before the quadratic convergence.
        let c = determinant.abs().powf(-0.125);
        let c = if c.is_finite() && c > 0.0 { c } else { 1.0 };
        let next: Matrix<8> =
            std::array::from_fn(|i| std::array::from_fn(|j| 0.5 * (c * z[i][j] + inverted[i][j] / c)));
        let change = largest(&sum(&next, -1.0, &z));
        z = next;
        if converged {
            break;
        }
        // One more step after this one takes the rest of the error away.
        converged = change < 1e-8 * largest(&z);
    }
    if !converged {
        return None;
    }
    // Eight equations for each column of P: least squares by the normal equations, which Newton's method
    // polishes afterwards.
    let sign = sum(&z, 1.0, &identity());
    let (mut normal, mut right): (Matrix<4>, Matrix<4>) = ([[0.0; 4]; 4], [[0.0; 4]; 4]);
    for row in &sign {
        for i in 0..4 {
            for j in 0..4 {
                normal[i][j] += row[4 + i] * row[4 + j];
                right[i][j] -= row[4 + i] * row[j];
            }
        }
    }
    let (p, _) = solved(normal, right)?;
    Some(sum(&p, 1.0, &transposed(&p)).map(|row| row.map(|x| 0.5 * unit * x)))
}

fn largest_of(x: &[f64; 4]) -> f64 {
    x.iter().fold(0.0, |m, x| m.max(x.abs()))
}

/// The symmetric X of `a^T X + X a + cost = 0`.
fn lyapunov(a: &Matrix<4>, cost: &Matrix<4>) -> Option<Matrix<4>> {
    let mut system: Matrix<16> = [[0.0; 16]; 16];
    let mut right = [[0.0; 1]; 16];
    for i in 0..4 {
        for j in 0..4 {
            let equation = 4 * i + j;
            right[equation] = [-cost[i][j]];
            for k in 0..4 {
                system[equation][4 * k + j] += a[k][i];
                system[equation][4 * i + k] += a[k][j];
            }
        }
    }
    let (x, _) = solved(system, right)?;
    Some(std::array::from_fn(|i| {
        std::array::from_fn(|j| 0.5 * (x[4 * i + j][0] + x[4 * j + i][0]))
    }))
}

/// See [`Regulator::riccati_residual`].
fn residual(a: &Matrix<4>, b: &[f64; 4], weights: &Weights, p: &Matrix<4>) -> f64 {
    let (defect, scale) = defect(a, b, weights, p);
    largest(&defect) / scale
}

/// `P A + A^T P - P b b^T P / r + Q`, and the largest element of its terms.
fn defect(a: &Matrix<4>, b: &[f64; 4], weights: &Weights, p: &Matrix<4>) -> (Matrix<4>, f64) {
    let pa = product(p, a);
    let pb = applied(p, b);
    let effort: Matrix<4> = std::array::from_fn(|i| std::array::from_fn(|j| pb[i] * pb[j] / weights.r));
    let cost: Matrix<4> = std::array::from_fn(|i| std::array::from_fn(|j| if i == j { weights.q[i] } else { 0.0 }));
    let transposed = transposed(&pa);
    let scale = [pa, transposed, effort, cost]
        .iter()
        .map(largest)
        .fold(f64::MIN_POSITIVE, f64::max);
    (sum(&sum(&sum(&pa, 1.0, &transposed), -1.0, &effort), 1.0, &cost), scale)
}

#[cfg(test)]
#[path = "lqr_tests.rs"]
mod tests;
