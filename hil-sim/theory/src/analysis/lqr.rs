//! The optimal regulator of the spar: Eq. 7.20 and 7.21, corrected, for any parameters and weights.

use model::dynamics::camera::CameraParameters;
use nalgebra::{Matrix4, SMatrix, SVector, Vector4};
use serde::Serialize;
use thiserror::Error;

use super::poles::eigenvalues;

/// Steps of Newton's method without a smaller residual, after which only rounding errors remain.
const STEPS_WITHOUT_GAIN: u32 = 6;

/// The weights of the cost (7.20): `q` on the squares of theta, phi, theta', phi', and `r` on v^2.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Weights {
    /// Diagonal of Q, each >= 0 (Q need only be positive semidefinite).
    pub q: [f64; 4],
    /// Weight of the control effort, > 0.
    pub r: f64,
}

impl Weights {
    /// The thesis's weights (ch. 7.5): Q = diag(10000, 100, 0, 0), r = 1.
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
    "the Riccati equation has no stabilising solution: some motion is neither damped nor weighted by Q, or the motor cannot move it"
)]
pub struct NoRegulator;

/// The optimal regulator of the spar `camera` under `weights`.
///
/// # Errors
/// [`NoRegulator`] if the Riccati equation has no stabilising solution.
pub fn regulator(camera: &CameraParameters<f64>, weights: &Weights) -> Result<Regulator, NoRegulator> {
    let problem = Problem::new(camera, weights);
    let p = problem.riccati().ok_or(NoRegulator)?;
    let gains = problem.gains(&p);
    let poles = eigenvalues(&problem.closed_loop(&gains)).ok_or(NoRegulator)?;
    if poles.iter().any(|p| p[0] >= 0.0) {
        return Err(NoRegulator);
    }
    Ok(Regulator {
        gains: gains.into(),
        poles,
        riccati_residual: problem.residual(&p),
    })
}

/// The spar near its level, `x' = A x + b v`, and the cost of its motion, `x^T Q x + r v^2`.
#[derive(Debug, Clone, Copy)]
struct Problem {
    a: Matrix4<f64>,
    b: Vector4<f64>,
    q: Matrix4<f64>,
    r: f64,
}

impl Problem {
    fn new(camera: &CameraParameters<f64>, weights: &Weights) -> Self {
        let (a, b) = camera.linearisation();
        Self {
            a: Matrix4::from_fn(|i, j| a[i][j]),
            b: Vector4::from(b),
            q: Matrix4::from_diagonal(&Vector4::from(weights.q)),
            r: weights.r,
        }
    }

    /// The gains of the solution `p` of the Riccati equation: `P b / r`.
    fn gains(&self, p: &Matrix4<f64>) -> Vector4<f64> {
        p * self.b / self.r
    }

    /// `A - b g^T`.
    fn closed_loop(&self, gains: &Vector4<f64>) -> Matrix4<f64> {
        self.a - self.b * gains.transpose()
    }

    /// The stabilising solution P of the algebraic Riccati equation: Newton's method (Kleinman's
    /// iteration), which converges from any stabilising gains, iterated until only rounding errors
    /// remain.
    fn riccati(&self) -> Option<Matrix4<f64>> {
        let gains = self.stabilising_gains()?;
        let cost = self.q + self.r * gains * gains.transpose();
        let mut p = lyapunov(&self.closed_loop(&gains), &cost)?;
        let (mut best, mut left) = (p, self.residual(&p));
        let mut worse = 0;
        for _ in 0..200 {
            // Each step is a correction: the next defect contains the rounding errors of this step.
            let (defect, _) = self.defect(&p);
            p += lyapunov(&self.closed_loop(&self.gains(&p)), &defect)?;
            let after = self.residual(&p);
            if after < left {
                (best, left, worse) = (p, after, 0);
            } else {
                worse += 1;
            }
            if worse == STEPS_WITHOUT_GAIN || !after.is_finite() {
                break;
            }
        }
        Some(best)
    }

    /// Stabilising gains that are nearly optimal: from the Hamiltonian or, if its elements differ too
    /// much in size, from the Hamiltonian of a costlier control.
    fn stabilising_gains(&self) -> Option<Vector4<f64>> {
        (0..12).find_map(|k| {
            let dearer = Self {
                r: self.r * 100_f64.powi(k),
                ..*self
            };
            let gains = dearer.gains(&dearer.hamiltonian_solution()?);
            let poles = eigenvalues(&self.closed_loop(&gains))?;
            poles.iter().all(|p| p[0] < 0.0).then_some(gains)
        })
    }

    /// P from the invariant subspace of the Hamiltonian's stable poles, which the matrix sign function
    /// separates: `(sign(H) + 1) [1; P] = 0`.
    fn hamiltonian_solution(&self) -> Option<Matrix4<f64>> {
        // The unit of the costates makes both off-diagonal blocks equally large, which loses fewer
        // digits.
        let (weighted, reached) = (self.q.amax(), self.b.amax().powi(2) / self.r);
        let unit = if weighted > 0.0 {
            (weighted / reached).sqrt()
        } else {
            1.0
        };
        let mut z = SMatrix::<f64, 8, 8>::zeros();
        z.fixed_view_mut::<4, 4>(0, 0).copy_from(&self.a);
        z.fixed_view_mut::<4, 4>(0, 4)
            .copy_from(&(-unit / self.r * self.b * self.b.transpose()));
        z.fixed_view_mut::<4, 4>(4, 0).copy_from(&(-self.q / unit));
        z.fixed_view_mut::<4, 4>(4, 4).copy_from(&-self.a.transpose());
        let mut converged = false;
        for _ in 0..80 {
            let lu = z.lu();
            let inverse = lu.try_inverse()?;
            // Scaling by the determinant brings the poles near 1 before the quadratic convergence.
            let c = lu.determinant().abs().powf(-0.125);
            let c = if c.is_finite() && c > 0.0 { c } else { 1.0 };
            let next = 0.5 * (c * z + inverse / c);
            let change = (next - z).amax();
            z = next;
            if converged {
                break;
            }
            // One more step after this one removes the rest of the error.
            converged = change < 1e-8 * z.amax();
        }
        if !converged {
            return None;
        }
        // Eight equations for each column of P: least squares. Newton's method polishes the result.
        let sign = z + SMatrix::identity();
        let (of_state, of_costate) = (sign.fixed_columns::<4>(0), sign.fixed_columns::<4>(4));
        let normal = of_costate.transpose() * of_costate;
        let p = normal.lu().solve(&-(of_costate.transpose() * of_state))?;
        Some(0.5 * unit * (p + p.transpose()))
    }

    /// See [`Regulator::riccati_residual`].
    fn residual(&self, p: &Matrix4<f64>) -> f64 {
        let (defect, scale) = self.defect(p);
        defect.amax() / scale
    }

    /// `P A + A^T P - P b b^T P / r + Q`, and the largest element of its terms.
    fn defect(&self, p: &Matrix4<f64>) -> (Matrix4<f64>, f64) {
        let pa = p * self.a;
        let pb = p * self.b;
        let effort = pb * pb.transpose() / self.r;
        let terms = [pa, effort, self.q];
        let scale = terms.iter().map(Matrix4::amax).fold(f64::MIN_POSITIVE, f64::max);
        (pa + pa.transpose() - effort + self.q, scale)
    }
}

/// The symmetric X of `a^T X + X a + cost = 0`, for a symmetric `cost`.
fn lyapunov(a: &Matrix4<f64>, cost: &Matrix4<f64>) -> Option<Matrix4<f64>> {
    let unit = Matrix4::identity();
    let system = unit.kronecker(&a.transpose()) + a.transpose().kronecker(&unit);
    let right = SVector::<f64, 16>::from_column_slice((-cost).as_slice());
    let x = Matrix4::from_column_slice(system.lu().solve(&right)?.as_slice());
    Some(0.5 * (x + x.transpose()))
}

#[cfg(test)]
#[path = "lqr_tests.rs"]
mod tests;
