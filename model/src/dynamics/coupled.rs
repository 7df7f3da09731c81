//! The planar vehicle with the spar on its axle: ch. 8 with corrected motor, damper and normalisation
//! (errata E32 to E36).
//!
//! Four degrees of freedom; lengths over the wheel radius r, masses over M + m, time over 1/w. With the
//! spar's coefficients (7.14) in these units, S the spar's mass and b the slope:
//!
//! ```text
//! T = 1/2 (1 + mu + S) th'^2 + 1/2 aL^2 phi'^2 + aL cos(phi-b) th' phi' + 1/2 nu (th' + phi')^2
//!   + [k1 cos(psi-b) psi' + k2 cos(psi+gamma-b)(psi' + gamma')] th'
//!   + 1/2 (m1 + m2 + 2 m3 cos gamma) psi'^2 + (m2 + m3 cos gamma) psi' gamma' + 1/2 m2 gamma'^2
//! V = (1 + S) th sin b - aL cos phi - k1 cos psi - k2 cos(psi + gamma)
//! ```

use crate::dynamics::camera::{CameraParameters, SparCoefficients};
use crate::dynamics::planar::PlanarParameters;
use crate::linear::solve_symmetric;
use crate::real::Real;

/// The body that carries the far side of the spar's damped bearing (erratum E33).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Bearing {
    /// Inertial space: damping of psi', as printed in (8.3). Not physical.
    #[default]
    Inertial,
    /// The arm: damping of psi' - phi'. This is the bearing to build.
    Arm,
    /// The turning axle: damping of psi' + theta'. This bearing drags the spar along with the wheels.
    Axle,
}

/// The nondimensional vehicle with its spar.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CoupledParameters<T> {
    /// The vehicle.
    pub planar: PlanarParameters<T>,
    /// `l_p / r`: axle to camera, > 0.
    pub lp: T,
    /// `l_m / r`: axle to ballast motor, >= 0.
    pub lm: T,
    /// `l_r / r`: ballast motor to ballast, > 0.
    pub lr: T,
    /// Camera, `m_c / (M + m)`, > 0. (8.5), corrected: over M + m, not M (erratum E35).
    pub kc: T,
    /// Ballast motor, `m_m / (M + m)`, >= 0.
    pub km: T,
    /// Ballast, `m_r / (M + m)`, > 0.
    pub kr: T,
    /// Bearing damping of the spar, `c / ((M+m) r^2 w)`, >= 0.
    pub zeta_c: T,
    /// Back-EMF of the ballast motor, `K_T K_B / (R_a (M+m) r^2 w)`, >= 0; it acts on the motor's own
    /// rate gamma', where (8.4) has theta' + phi' (erratum E34).
    pub xi_c: T,
    /// The body that carries the far side of the spar's bearing.
    pub bearing: Bearing,
}

/// State: theta (wheel), phi (arm from the vertical), psi (spar from the vertical), gamma
/// (ballast relative to the spar), then their rates, in rad and rad per time unit.
pub type CoupledState<T> = [T; 8];

/// Index of theta in a [`CoupledState`].
pub const THETA: usize = 0;
/// Index of phi in a [`CoupledState`].
pub const PHI: usize = 1;
/// Index of psi in a [`CoupledState`].
pub const PSI: usize = 2;
/// Index of gamma in a [`CoupledState`].
pub const GAMMA: usize = 3;
/// Index of theta' in a [`CoupledState`].
pub const THETA_RATE: usize = 4;
/// Index of phi' in a [`CoupledState`].
pub const PHI_RATE: usize = 5;
/// Index of psi' in a [`CoupledState`].
pub const PSI_RATE: usize = 6;
/// Index of gamma' in a [`CoupledState`].
pub const GAMMA_RATE: usize = 7;

impl<T: Real> CoupledParameters<T> {
    /// The vehicle `planar` with the spar `camera` of ch. 7. The spar is `lp` wheel radii long, and its
    /// camera has the mass `kc` (M + m).
    ///
    /// Lengths scale by lp, masses by kc, damping and back-EMF by kc lp^(3/2).
    pub fn with_camera(
        planar: PlanarParameters<T>,
        camera: &CameraParameters<T>,
        lp: T,
        kc: T,
        bearing: Bearing,
    ) -> Self {
        let damping = kc * lp * lp.sqrt();
        Self {
            planar,
            lp,
            lm: camera.lm * lp,
            lr: camera.lr * lp,
            kc,
            km: camera.mm * kc,
            kr: camera.mr * kc,
            zeta_c: camera.zeta * damping,
            xi_c: camera.xi * damping,
            bearing,
        }
    }

    /// The same parameters in another number type (rounded to the nearest value).
    pub fn cast<V: Real>(&self) -> CoupledParameters<V> {
        let c = |x: T| V::from_f64(x.to_f64());
        CoupledParameters {
            planar: self.planar.cast(),
            lp: c(self.lp),
            lm: c(self.lm),
            lr: c(self.lr),
            kc: c(self.kc),
            km: c(self.km),
            kr: c(self.kr),
            zeta_c: c(self.zeta_c),
            xi_c: c(self.xi_c),
            bearing: self.bearing,
        }
    }

    /// S: the spar's whole mass over M + m, ballast included.
    pub fn spar_mass(&self) -> T {
        self.kc + self.km + self.kr
    }

    /// The voltage that holds the loaded vehicle on its slope: (8.8), corrected, `(1 + S) sin(beta)`.
    ///
    /// The vehicle can be held only up to `alpha l`: (8.9), corrected, `|beta| <= asin(L a / (1 + S))`.
    pub fn hold_voltage(&self) -> T {
        (T::ONE + self.spar_mass()) * self.planar.beta.sin()
    }

    /// (7.14) in vehicle units.
    pub fn coefficients(&self) -> SparCoefficients<T> {
        SparCoefficients::new([self.lp, self.lm, self.lr], [self.kc, self.km, self.kr])
    }

    /// The same spar controller in vehicle units: ch. 7's gains times kc lp [1, 1, sqrt(lp), sqrt(lp)].
    ///
    /// Ch. 8 uses "the same optimal gains" without conversion, which is right only for kc = lp = 1
    /// (erratum E36).
    pub fn gains_in_vehicle_units(&self, gains: [T; 4]) -> [T; 4] {
        let torque = self.kc * self.lp;
        let rate = torque * self.lp.sqrt();
        let [spar, ballast, spar_rate, ballast_rate] = gains;
        [torque * spar, torque * ballast, rate * spar_rate, rate * ballast_rate]
    }
}

/// The equations of motion with all constants of a run precomputed.
#[derive(Debug, Clone, Copy)]
pub struct Coupled<T> {
    parameters: CoupledParameters<T>,
    coefficients: SparCoefficients<T>,
    /// alpha L.
    al: T,
    sin_beta: T,
    cos_beta: T,
    /// (1 + S) sin(beta).
    slope_force: T,
    /// 1 + mu + S + nu.
    m11: T,
    /// alpha L^2 + nu.
    m22: T,
}

impl<T: Real> Coupled<T> {
    /// Prepares the equations.
    pub fn new(parameters: CoupledParameters<T>) -> Self {
        let p = parameters.planar;
        let al = p.alpha * p.l;
        let (sin_beta, cos_beta) = p.beta.sin_cos();
        Self {
            parameters,
            coefficients: parameters.coefficients(),
            al,
            sin_beta,
            cos_beta,
            slope_force: parameters.hold_voltage(),
            m11: T::ONE + p.mu + parameters.spar_mass() + p.nu,
            m22: al * p.l + p.nu,
        }
    }

    /// The parameters these equations were prepared from.
    pub fn parameters(&self) -> &CoupledParameters<T> {
        &self.parameters
    }

    /// The accelerations of theta, phi, psi and gamma under the drive voltage `u` and the ballast
    /// motor's voltage `v`, both as torques over `(M+m) g r`.
    #[inline]
    pub fn accelerations(&self, x: &CoupledState<T>, u: T, v: T) -> [T; 4] {
        let p = &self.parameters;
        let drive = u - p.planar.zeta * (x[THETA_RATE] + x[PHI_RATE]);
        let ballast = v - p.xi_c * x[GAMMA_RATE];
        self.accelerations_under_torques(x, drive, ballast)
    }

    /// The accelerations under shaft torques over `(M+m) g r`, for a caller with its own motor models.
    /// The torques include back-EMF and drive friction; this function adds the friction of the spar's
    /// bearing.
    #[inline]
    pub fn accelerations_under_torques(&self, x: &CoupledState<T>, drive: T, ballast: T) -> [T; 4] {
        let SparCoefficients { m1, m2, m3, k1, k2 } = self.coefficients;
        let nu = self.parameters.planar.nu;
        let (sin_phi, cos_phi) = x[PHI].sin_cos();
        let (sin_psi, cos_psi) = x[PSI].sin_cos();
        let (sin_gamma, cos_gamma) = x[GAMMA].sin_cos();
        let (sin_sum, cos_sum) = (x[PSI] + x[GAMMA]).sin_cos();
        let (psi_rate, gamma_rate) = (x[PSI_RATE], x[GAMMA_RATE]);
        let sum_rate = psi_rate + gamma_rate;
        // sin and cos of an angle less beta, by the addition theorem.
        let less = |sin: T, cos: T| {
            (
                sin * self.cos_beta - cos * self.sin_beta,
                cos * self.cos_beta + sin * self.sin_beta,
            )
        };
        let (sin_phi_b, cos_phi_b) = less(sin_phi, cos_phi);
        let (sin_psi_b, cos_psi_b) = less(sin_psi, cos_psi);
        let (sin_sum_b, cos_sum_b) = less(sin_sum, cos_sum);

        let m21 = self.al * cos_phi_b + nu;
        let m41 = k2 * cos_sum_b;
        let m31 = k1 * cos_psi_b + m41;
        let m43 = m2 + m3 * cos_gamma;
        let m33 = m1 + m43 + m3 * cos_gamma;
        let swing = m3 * sin_gamma;

        let damper = self.parameters.zeta_c * self.bearing_rate(x);
        let [damp_theta, damp_phi] = match self.parameters.bearing {
            Bearing::Inertial => [T::ZERO, T::ZERO],
            Bearing::Arm => [T::ZERO, damper],
            Bearing::Axle => [-damper, T::ZERO],
        };
        let f1 = drive - self.slope_force
            + self.al * sin_phi_b * x[PHI_RATE] * x[PHI_RATE]
            + k1 * sin_psi_b * psi_rate * psi_rate
            + k2 * sin_sum_b * sum_rate * sum_rate
            + damp_theta;
        let f2 = drive - self.al * sin_phi + damp_phi;
        let f3 = swing * gamma_rate * (psi_rate + sum_rate) - k1 * sin_psi - k2 * sin_sum - damper;
        let f4 = ballast - swing * psi_rate * psi_rate - k2 * sin_sum;
        let o = T::ZERO;
        // Lower triangle of the symmetric mass matrix.
        let mass = [
            [self.m11, o, o, o],
            [m21, self.m22, o, o],
            [m31, o, m33, o],
            [m41, o, m43, m2],
        ];
        solve_symmetric(mass, [f1, f2, f3, f4])
    }

    /// The rate at which the spar's bearing turns.
    #[inline]
    pub fn bearing_rate(&self, x: &CoupledState<T>) -> T {
        match self.parameters.bearing {
            Bearing::Inertial => x[PSI_RATE],
            Bearing::Arm => x[PSI_RATE] - x[PHI_RATE],
            Bearing::Axle => x[PSI_RATE] + x[THETA_RATE],
        }
    }

    /// The derivative of the state under the drive voltage `u` and the ballast motor's voltage `v`.
    #[inline]
    pub fn rate(&self, x: &CoupledState<T>, u: T, v: T) -> CoupledState<T> {
        let [a, b, c, d] = self.accelerations(x, u, v);
        [x[THETA_RATE], x[PHI_RATE], x[PSI_RATE], x[GAMMA_RATE], a, b, c, d]
    }

    /// Kinetic and potential energy over `(M+m) g r`: (8.1), corrected (M, not M/2, erratum E32), and
    /// (8.2). The potential is zero with every mass at the axle at theta = 0.
    pub fn energy(&self, x: &CoupledState<T>) -> T {
        let SparCoefficients { m1, m2, m3, k1, k2 } = self.coefficients;
        let p = &self.parameters;
        let beta = p.planar.beta;
        let (theta_rate, phi_rate) = (x[THETA_RATE], x[PHI_RATE]);
        let (psi_rate, gamma_rate) = (x[PSI_RATE], x[GAMMA_RATE]);
        let sum = x[PSI] + x[GAMMA];
        let cos_gamma = x[GAMMA].cos();
        let first_moments = self.al * (x[PHI] - beta).cos() * phi_rate
            + k1 * (x[PSI] - beta).cos() * psi_rate
            + k2 * (sum - beta).cos() * (psi_rate + gamma_rate);
        let twice_kinetic = (self.m11 - p.planar.nu) * theta_rate * theta_rate
            + self.al * p.planar.l * phi_rate * phi_rate
            + p.planar.nu * (theta_rate + phi_rate) * (theta_rate + phi_rate)
            + (first_moments + first_moments) * theta_rate
            + (m1 + m2 + (m3 + m3) * cos_gamma) * psi_rate * psi_rate
            + (m2 + m2 + (m3 + m3) * cos_gamma) * psi_rate * gamma_rate
            + m2 * gamma_rate * gamma_rate;
        let potential = self.slope_force * x[THETA] - self.al * x[PHI].cos() - k1 * x[PSI].cos() - k2 * sum.cos();
        T::from_f64(0.5) * twice_kinetic + potential
    }
}
