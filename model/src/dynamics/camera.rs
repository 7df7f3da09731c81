//! The levelled spar alone, on an axle with a given motion: Eq. 7.12 and 7.13.
//!
//! Lengths are over the spar l_c, masses over the camera m_c, time over 1/w_c, w_c = sqrt(g / l_c).

use crate::linear::solve_symmetric;
use crate::real::Real;

/// The nondimensional spar: the camera above the axle, the ballast motor below the axle, the ballast
/// below the motor.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CameraParameters<T> {
    /// `l_m / l_c`: axle to motor, >= 0.
    pub lm: T,
    /// `l_r / l_c`: motor to ballast, > 0.
    pub lr: T,
    /// `m_m / m_c`: motor, >= 0.
    pub mm: T,
    /// `m_r / m_c`: ballast, > 0.
    pub mr: T,
    /// Bearing damping `c / (l_c^2 m_c w_c)`, >= 0.
    pub zeta: T,
    /// Back-EMF of the motor, `K_T K_B / (R_a l_c^2 m_c w_c)` (first power of w_c, erratum E27), >= 0.
    /// The thesis's list of values calls it K_m.
    pub xi: T,
}

/// State: theta (spar from the vertical), phi (ballast relative to the spar), and their rates; all
/// anticlockwise, in rad and rad per time unit.
pub type CameraState<T> = [T; 4];

/// Index of the spar's angle theta in a [`CameraState`].
pub const THETA: usize = 0;
/// Index of the ballast's angle phi in a [`CameraState`].
pub const PHI: usize = 1;
/// Index of theta' in a [`CameraState`].
pub const THETA_RATE: usize = 2;
/// Index of phi' in a [`CameraState`].
pub const PHI_RATE: usize = 3;

/// The spar's five inertial coefficients (7.14), in the units of the given lengths and masses.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SparCoefficients<T> {
    /// Inertia of the spar with motor and ballast lumped at the motor.
    pub m1: T,
    /// Inertia of the ballast about the motor.
    pub m2: T,
    /// Coupling of the two: l_m l_r m_r.
    pub m3: T,
    /// First moment of the spar: positive for a hanging spar, negative for a standing spar.
    pub k1: T,
    /// First moment of the ballast: l_r m_r.
    pub k2: T,
}

impl<T: Real> SparCoefficients<T> {
    /// The coefficients of (7.14) for `[camera, motor, ballast]` lengths and masses (1 and 1 for the
    /// camera in ch. 7).
    pub fn new(lengths: [T; 3], masses: [T; 3]) -> Self {
        let [lc, lm, lr] = lengths;
        let [mc, mm, mr] = masses;
        let below = mm + mr;
        Self {
            m1: lc * lc * mc + lm * lm * below,
            m2: lr * lr * mr,
            m3: lm * lr * mr,
            k1: lm * below - lc * mc,
            k2: lr * mr,
        }
    }
}

impl<T: Real> CameraParameters<T> {
    /// The thesis's spar (ch. 7.5): L_m = L_r = 1/6, M_m = 3, M_r = 4, zeta = 0.2, xi = 2.
    pub fn thesis() -> Self {
        let c = T::from_f64;
        let sixth = T::ONE / c(6.0);
        Self {
            lm: sixth,
            lr: sixth,
            mm: c(3.0),
            mr: c(4.0),
            zeta: c(0.2),
            xi: c(2.0),
        }
    }

    /// The same parameters in another number type (rounded to the nearest value).
    pub fn cast<V: Real>(&self) -> CameraParameters<V> {
        let c = |x: T| V::from_f64(x.to_f64());
        CameraParameters {
            lm: c(self.lm),
            lr: c(self.lr),
            mm: c(self.mm),
            mr: c(self.mr),
            zeta: c(self.zeta),
            xi: c(self.xi),
        }
    }

    /// (7.14).
    pub fn coefficients(&self) -> SparCoefficients<T> {
        SparCoefficients::new([T::ONE, self.lm, self.lr], [T::ONE, self.mm, self.mr])
    }

    /// A and b of `x' = A x + b v` about the levelled spar: (7.15) to (7.18).
    pub fn linearisation(&self) -> ([[T; 4]; 4], [T; 4]) {
        let SparCoefficients { m1, m2, m3, k1, k2 } = self.coefficients();
        let mass = [[m1 + m2 + m3 + m3, m2 + m3], [m2 + m3, m2]];
        // The columns of -M^-1 [K C] and of M^-1 u.
        let column = |top: T, bottom: T| solve_symmetric(mass, [top, bottom]);
        let columns = [
            column(-k1 - k2, -k2),
            column(-k2, -k2),
            column(-self.zeta, T::ZERO),
            column(T::ZERO, -self.xi),
        ];
        let [b3, b4] = column(T::ZERO, T::ONE);
        let (o, i) = (T::ZERO, T::ONE);
        let row = |k: usize| columns.map(|c| c[k]);
        ([[o, o, i, o], [o, o, o, i], row(0), row(1)], [o, o, b3, b4])
    }
}

impl<T: Real> CameraParameters<T> {
    /// Whether the levelled spar is asymptotically stable under `v = -gains . x` (x as in
    /// [`CameraParameters::linearisation`]): the Hurwitz conditions on the characteristic polynomial
    /// `det(M s^2 + C s + K)` of (7.15) to (7.17) with the feedback in it.
    ///
    /// ```
    /// use model::dynamics::camera::CameraParameters;
    /// let spar = CameraParameters::<f64>::thesis();
    /// assert!(spar.is_stable_under(&[-92.06057, 6.84090, -49.14485, -6.49598]));
    /// // As (7.21) prints them (erratum E28).
    /// assert!(!spar.is_stable_under(&[92.06, 6.84, -49.14, -6.96]));
    /// ```
    pub fn is_stable_under(&self, gains: &[T; 4]) -> bool {
        let SparCoefficients { m1, m2, m3, k1, k2 } = self.coefficients();
        let [g1, g2, g3, g4] = *gains;
        // Quadratics in s, highest power first: spar, coupling, feedback to the ballast, ballast.
        let spar = [m1 + m2 + m3 + m3, self.zeta, k1 + k2];
        let coupling = [m2 + m3, T::ZERO, k2];
        let feedback = [m2 + m3, g3, k2 + g1];
        let ballast = [m2, self.xi + g4, k2 + g2];
        let product = |[a2, a1, a0]: [T; 3], [b2, b1, b0]: [T; 3]| {
            [
                a2 * b2,
                a2 * b1 + a1 * b2,
                a2 * b0 + a1 * b1 + a0 * b2,
                a1 * b0 + a0 * b1,
                a0 * b0,
            ]
        };
        let ([p4, p3, p2, p1, p0], [q4, q3, q2, q1, q0]) = (product(spar, ballast), product(coupling, feedback));
        let (a4, a3, a2, a1, a0) = (p4 - q4, p3 - q3, p2 - q2, p1 - q1, p0 - q0);
        // The mass matrix is positive definite, so a4 is positive.
        let positive = [a4, a3, a2, a1, a0].iter().all(|a| *a > T::ZERO);
        positive && a1 * (a2 * a3 - a1 * a4) > a0 * a3 * a3
    }
}

/// The equations of motion with all constants of a run precomputed.
#[derive(Debug, Clone, Copy)]
pub struct Camera<T> {
    parameters: CameraParameters<T>,
    coefficients: SparCoefficients<T>,
}

impl<T: Real> Camera<T> {
    /// Prepares the equations.
    pub fn new(parameters: CameraParameters<T>) -> Self {
        Self {
            parameters,
            coefficients: parameters.coefficients(),
        }
    }

    /// The parameters these equations were prepared from.
    pub fn parameters(&self) -> &CameraParameters<T> {
        &self.parameters
    }

    /// theta'' and phi'' under the motor voltage `v` and the axle's acceleration `base` (horizontal,
    /// vertical; in g).
    ///
    /// (7.12) and (7.13), corrected: the base term of (7.13) is k2 cos(theta + phi) x'' (erratum E27).
    #[inline]
    pub fn accelerations(&self, x: &CameraState<T>, v: T, base: [T; 2]) -> [T; 2] {
        let SparCoefficients { m1, m2, m3, k1, k2 } = self.coefficients;
        let p = &self.parameters;
        let (theta_rate, phi_rate) = (x[THETA_RATE], x[PHI_RATE]);
        let (sin_phi, cos_phi) = x[PHI].sin_cos();
        let (sin_theta, cos_theta) = x[THETA].sin_cos();
        let (sin_sum, cos_sum) = (x[THETA] + x[PHI]).sin_cos();
        let weight = T::ONE + base[1];
        let spar = k1 * (sin_theta * weight + cos_theta * base[0]);
        let ballast = k2 * (sin_sum * weight + cos_sum * base[0]);
        let swing = m3 * sin_phi;
        let m12 = m2 + m3 * cos_phi;
        let m11 = m1 + m12 + m3 * cos_phi;
        let f1 = swing * phi_rate * (theta_rate + theta_rate + phi_rate) - p.zeta * theta_rate - spar - ballast;
        let f2 = v - p.xi * phi_rate - swing * theta_rate * theta_rate - ballast;
        let inverse = T::ONE / (m11 * m2 - m12 * m12);
        [(m2 * f1 - m12 * f2) * inverse, (m11 * f2 - m12 * f1) * inverse]
    }

    /// The derivative of the state under the motor voltage `v` and the axle's acceleration `base`.
    #[inline]
    pub fn rate(&self, x: &CameraState<T>, v: T, base: [T; 2]) -> CameraState<T> {
        let [theta, phi] = self.accelerations(x, v, base);
        [x[THETA_RATE], x[PHI_RATE], theta, phi]
    }
}
