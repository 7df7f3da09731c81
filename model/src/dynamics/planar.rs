//! The planar vehicle: Eq. 3.12 and 3.13, with the reflected rotor inertia `nu` that the thesis omits.

use crate::integrate::rk4_step;
use crate::real::Real;

/// The nondimensional planar vehicle on a slope.
///
/// This type does not check the values: [`Vehicle::planar`](crate::vehicle::Vehicle::planar) returns checked
/// values, and the reader of a `[planar]` file checks them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PlanarParameters<T> {
    /// `l / r`: distance of the arm's centre of mass from the axle over the wheel radius, > 0.
    pub l: T,
    /// `m / (M + m)`: share of the arm in the total mass, in (0, 1).
    pub alpha: T,
    /// Total damping, back-EMF included: `(C + K_T K_B / R_a) / (r^2 (M+m) w)` (3.10, corrected), >= 0.
    pub zeta: T,
    /// `I / ((M+m) r^2)`: wheel inertia, >= 0.
    pub mu: T,
    /// `N n^2 J / ((M+m) r^2)`: reflected rotor inertia, >= 0 (0 in the thesis).
    pub nu: T,
    /// Slope in rad, positive uphill.
    pub beta: T,
}

/// State: wheel angle theta (forward positive), arm angle phi (from the vertical, positive
/// forward), and their rates, in rad and rad per time unit.
pub type PlanarState<T> = [T; 4];

/// Index of theta in a [`PlanarState`].
pub const THETA: usize = 0;
/// Index of phi in a [`PlanarState`].
pub const PHI: usize = 1;
/// Index of theta' in a [`PlanarState`].
pub const THETA_RATE: usize = 2;
/// Index of phi' in a [`PlanarState`].
pub const PHI_RATE: usize = 3;

impl<T: Real> PlanarParameters<T> {
    /// The thesis's geometry (3.26) with the total damping 2.2 (its zeta 0.2 plus its K 2).
    pub fn thesis() -> Self {
        let c = T::from_f64;
        Self {
            l: c(0.8),
            alpha: c(0.9),
            zeta: c(2.2),
            mu: c(0.066),
            nu: T::ZERO,
            beta: c(0.0873),
        }
    }

    /// The same parameters in another number type (rounded to the nearest value).
    pub fn cast<V: Real>(&self) -> PlanarParameters<V> {
        let c = |x: T| V::from_f64(x.to_f64());
        PlanarParameters {
            l: c(self.l),
            alpha: c(self.alpha),
            zeta: c(self.zeta),
            mu: c(self.mu),
            nu: c(self.nu),
            beta: c(self.beta),
        }
    }
}

/// The equations of motion with all constants of a run precomputed.
#[derive(Debug, Clone, Copy)]
pub struct Planar<T> {
    parameters: PlanarParameters<T>,
    /// alpha L.
    pub(super) al: T,
    pub(super) sin_beta: T,
    pub(super) cos_beta: T,
    /// 1 + mu + nu.
    m11: T,
    /// alpha L^2 + nu.
    m22: T,
}

impl<T: Real> Planar<T> {
    /// Prepares the equations.
    pub fn new(parameters: PlanarParameters<T>) -> Self {
        let p = parameters;
        let al = p.alpha * p.l;
        let (sin_beta, cos_beta) = p.beta.sin_cos();
        Self {
            parameters,
            al,
            sin_beta,
            cos_beta,
            m11: T::ONE + p.mu + p.nu,
            m22: al * p.l + p.nu,
        }
    }

    /// The parameters these equations were prepared from.
    pub fn parameters(&self) -> &PlanarParameters<T> {
        &self.parameters
    }

    /// theta'' and phi'' under the nondimensional voltage `u`.
    ///
    /// (3.12) and (3.13) solved for the accelerations; `nu [[1, 1], [1, 1]]` is added to the mass
    /// matrix for the rotors, which turn with theta' + phi'.
    #[inline]
    pub fn accelerations(&self, x: &PlanarState<T>, u: T) -> [T; 2] {
        let (sin_phi, cos_phi) = x[PHI].sin_cos();
        // sin and cos of beta - phi by the addition theorem: one pair of calls instead of three.
        let sin_bp = self.sin_beta * cos_phi - self.cos_beta * sin_phi;
        let cos_bp = self.cos_beta * cos_phi + self.sin_beta * sin_phi;
        let torque = u - self.parameters.zeta * (x[THETA_RATE] + x[PHI_RATE]);
        let m12 = self.al * cos_bp + self.parameters.nu;
        let f1 = torque - self.sin_beta - self.al * sin_bp * x[PHI_RATE] * x[PHI_RATE];
        let f2 = torque - self.al * sin_phi;
        let inverse = T::ONE / (self.m11 * self.m22 - m12 * m12);
        [
            (self.m22 * f1 - m12 * f2) * inverse,
            (self.m11 * f2 - m12 * f1) * inverse,
        ]
    }

    /// The derivative of the state under the nondimensional voltage `u`.
    #[inline]
    pub fn rate(&self, x: &PlanarState<T>, u: T) -> PlanarState<T> {
        let [a, b] = self.accelerations(x, u);
        [x[THETA_RATE], x[PHI_RATE], a, b]
    }

    /// One fixed RK4 step of length `h` (in time units) with constant `u`.
    #[inline]
    pub fn rk4(&self, x: &PlanarState<T>, u: T, h: T) -> PlanarState<T> {
        rk4_step(x, h, |x| self.rate(x, u))
    }
}
