//! The vehicle in space, on a plane inclined in two directions: the corrected equations of motion of ch.
//! 6.
//!
//! The thesis multiplies the rolling constraints (6.15) into a variational principle (6.16), which is
//! wrong for rolling (erratum E21) and leaves the system unsolved. D'Alembert's principle with the
//! quasi-velocities v = (theta_r' + theta_l')/2 and psi' = (theta_r' - theta_l')/2s gives three short
//! equations:
//!
//! ```text
//! (1+mu) v'       + aL cos(phi) phi'' = aL sin(phi)(phi'^2 + psi'^2) - g_f + tau_r + tau_l
//! aL cos(phi) v'  + aL^2 phi''        = aL^2 sin(phi) cos(phi) psi'^2 - aL(cos(phi) g_f + sin(phi) n_3)
//!                                       + tau_r + tau_l
//! [(1-a-b)s^2 + j0 + aL^2 sin^2(phi) + mu s^2] psi''
//!                 = -aL sin(phi)(v psi' + 2L cos(phi) phi' psi' + g_l) + s(tau_r - tau_l)
//! ```
//!
//! with `tau_i = u_i - zeta/2 (theta_i' + phi')`, g_f and g_l gravity along and across the heading.
//! Lengths are over the wheel radius R, masses over mt = 2M + m, time over 1/w.
//!
//! b is the share of a mass over the middle of the axle (0 in the thesis), which mt then includes: a camera spar that stays
//! upright on the plane. It moves with the axle and has no lever about the axis of yaw.

use crate::dynamics::planar::PlanarParameters;
use crate::real::Real;

/// The nondimensional vehicle on an inclined plane.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SpatialParameters<T> {
    /// `l / R`: distance of the arm's centre of mass from the axle, > 0.
    pub l: T,
    /// `m / (2M + m)`: share of the arm in the total mass, in (0, 1).
    pub alpha: T,
    /// Total damping of both wheels, back-EMF included: `2 (C + K_T K_B / R_a) / (mt R^2 w)`, >= 0.
    pub zeta: T,
    /// Rolling inertia of both wheels: `2 I / (mt R^2)`, >= 0.
    pub mu: T,
    /// Reflected rotor inertia of both drives: `N n^2 J / (mt R^2)`, >= 0 (0 in the thesis).
    pub nu: T,
    /// Half track `d / R`, > 0.
    pub s: T,
    /// Yaw inertia beyond the wheels' masses at the ends of the axle, over `mt R^2`, >= 0: the wheels'
    /// own (diametral) inertia and the arm's, which (6.3) leaves out (erratum E24).
    pub j0: T,
    /// Share of the total mass that stays over the middle of the axle, between its wheels, in [0, 1 - alpha) (0 in the thesis).
    pub middle: T,
    /// Slope along the plane's first axis in rad, positive uphill: beta_x of (6.5).
    pub slope_x: T,
    /// Slope about the plane's first axis in rad, positive downhill along the second: beta_y of (6.5).
    pub slope_y: T,
}

/// State: x, y (axle centre in the plane, over R), psi (heading), theta_r, theta_l (wheel angles), phi
/// (arm, **from the plane's normal** as in (6.1), not from the vertical), then theta_r',
/// theta_l' and phi', in rad and rad per time unit.
pub type SpatialState<T> = [T; 9];

/// Index of x in a [`SpatialState`].
pub const X: usize = 0;
/// Index of y in a [`SpatialState`].
pub const Y: usize = 1;
/// Index of the heading psi in a [`SpatialState`].
pub const PSI: usize = 2;
/// Index of theta_r in a [`SpatialState`].
pub const THETA_R: usize = 3;
/// Index of theta_l in a [`SpatialState`].
pub const THETA_L: usize = 4;
/// Index of phi in a [`SpatialState`].
pub const PHI: usize = 5;
/// Index of theta_r' in a [`SpatialState`].
pub const RATE_R: usize = 6;
/// Index of theta_l' in a [`SpatialState`].
pub const RATE_L: usize = 7;
/// Index of phi' in a [`SpatialState`].
pub const PHI_RATE: usize = 8;

impl<T: Real> SpatialParameters<T> {
    /// The spatial vehicle that equals the planar vehicle `planar` while it drives straight up the fall
    /// line.
    ///
    /// The planar model's M, I, C and motor represent both wheels together. Its parameters therefore
    /// carry over unchanged, and a planar voltage U becomes `u_r = u_l = U / 2`. The spatial phi is the
    /// planar phi less the slope (erratum E20).
    pub fn from_planar(planar: &PlanarParameters<T>, s: T, j0: T) -> Self {
        let PlanarParameters {
            l,
            alpha,
            zeta,
            mu,
            nu,
            beta,
        } = *planar;
        Self {
            l,
            alpha,
            zeta,
            mu,
            nu,
            s,
            j0,
            middle: T::ZERO,
            slope_x: beta,
            slope_y: T::ZERO,
        }
    }

    /// The vehicle with so much over the middle of its axle that it has `mass` times its own mass: the same equations, divided
    /// by the whole mass. Torques and voltages are then in units that are `mass` times as large.
    #[must_use]
    pub fn carrying(&self, mass: T) -> Self {
        Self {
            alpha: self.alpha / mass,
            zeta: self.zeta / mass,
            mu: self.mu / mass,
            nu: self.nu / mass,
            j0: self.j0 / mass,
            middle: (self.middle + mass - T::ONE) / mass,
            ..*self
        }
    }

    /// The same parameters in another number type (rounded to the nearest value).
    pub fn cast<V: Real>(&self) -> SpatialParameters<V> {
        let c = |x: T| V::from_f64(x.to_f64());
        SpatialParameters {
            l: c(self.l),
            alpha: c(self.alpha),
            zeta: c(self.zeta),
            mu: c(self.mu),
            nu: c(self.nu),
            s: c(self.s),
            j0: c(self.j0),
            middle: c(self.middle),
            slope_x: c(self.slope_x),
            slope_y: c(self.slope_y),
        }
    }

    /// The unit vector that points up, in the plane's axes: minus the direction of (6.6).
    pub fn up(&self) -> [T; 3] {
        let (sin_x, cos_x) = self.slope_x.sin_cos();
        let (sin_y, cos_y) = self.slope_y.sin_cos();
        [sin_x, -sin_y * cos_x, cos_y * cos_x]
    }

    /// The yaw rate above which spinning on the spot on level ground with a hanging arm is unstable;
    /// `None` if the spin is stable at every rate.
    ///
    /// With m11 = 1 + mu + nu, m12 = aL + nu, D = m11 (aL^2 + nu) - m12^2 and h = 1 + mu + aL^2 - 2aL the
    /// coupled motion of v and phi has a Hopf bifurcation, whatever the (non-zero) damping, at
    ///
    /// ```text
    /// psi'^2 = (m11 - m12)^2 / [h (L m11 - m12) + D (1 - L)]
    /// ```
    ///
    /// (erratum E26; without rotors the denominator is L k h + a L^2 k (1 - L) with k = 1 + mu - a). An
    /// arm longer than the wheel's radius may swing out before that, at psi'^2 = 1 / (L - 1).
    pub fn spin_stability_limit(&self) -> Option<T> {
        let (l, one) = (self.l, T::ONE);
        let al = self.alpha * l;
        let (m11, m12, m22) = (one + self.mu + self.nu, al + self.nu, al * l + self.nu);
        let h = m11 + m22 - (m12 + m12);
        let denominator = h * (l * m11 - m12) + (m11 * m22 - m12 * m12) * (one - l);
        let difference = m11 - m12;
        let hopf = (denominator > T::ZERO).then(|| difference * difference / denominator);
        let tips = (l > one).then(|| one / (l - one));
        let square = match (hopf, tips) {
            (Some(a), Some(b)) => Some(if a < b { a } else { b }),
            (a, b) => a.or(b),
        };
        square.map(T::sqrt)
    }
}

/// The equations of motion with all constants of a run precomputed.
#[derive(Debug, Clone, Copy)]
pub struct Spatial<T> {
    parameters: SpatialParameters<T>,
    /// alpha L.
    al: T,
    up: [T; 3],
    /// 1 + mu + nu.
    m11: T,
    /// alpha L^2 + nu.
    m22: T,
    /// Yaw inertia with the arm hanging.
    yaw: T,
    half_zeta: T,
    half: T,
    /// 1 / 2s.
    inverse_track: T,
}

impl<T: Real> Spatial<T> {
    /// Prepares the equations.
    pub fn new(parameters: SpatialParameters<T>) -> Self {
        let p = parameters;
        let al = p.alpha * p.l;
        let half = T::from_f64(0.5);
        Self {
            parameters,
            al,
            up: p.up(),
            m11: T::ONE + p.mu + p.nu,
            m22: al * p.l + p.nu,
            yaw: (T::ONE - p.alpha - p.middle + p.mu + p.nu) * p.s * p.s + p.j0,
            half_zeta: half * p.zeta,
            half,
            inverse_track: half / p.s,
        }
    }

    /// The parameters these equations were prepared from.
    pub fn parameters(&self) -> &SpatialParameters<T> {
        &self.parameters
    }

    /// Forward speed v (over R w) and yaw rate psi': (6.12) and (6.15).
    #[inline]
    pub fn forward_and_yaw_rate(&self, x: &SpatialState<T>) -> [T; 2] {
        [
            self.half * (x[RATE_R] + x[RATE_L]),
            self.inverse_track * (x[RATE_R] - x[RATE_L]),
        ]
    }

    /// The torques of the right and left wheel under the nondimensional voltages `u` (right, left),
    /// over `mt g R`: (6.9).
    #[inline]
    pub fn torques(&self, x: &SpatialState<T>, u: [T; 2]) -> [T; 2] {
        let [right, left] = u;
        [
            right - self.half_zeta * (x[RATE_R] + x[PHI_RATE]),
            left - self.half_zeta * (x[RATE_L] + x[PHI_RATE]),
        ]
    }

    /// v', psi'' and phi'' under wheel torques `tau` (right, left): the core of the model, for a caller
    /// with its own motor models. The result includes the reflected rotor inertia.
    #[inline]
    pub fn quasi_accelerations(&self, x: &SpatialState<T>, tau: [T; 2]) -> [T; 3] {
        let p = &self.parameters;
        let [v, psi_rate] = self.forward_and_yaw_rate(x);
        let phi_rate = x[PHI_RATE];
        let (sin_phi, cos_phi) = x[PHI].sin_cos();
        let (sin_psi, cos_psi) = x[PSI].sin_cos();
        let [n1, n2, n3] = self.up;
        let along = n1 * cos_psi + n2 * sin_psi;
        let across = n2 * cos_psi - n1 * sin_psi;
        let drive = tau[0] + tau[1];
        let centrifugal = psi_rate * psi_rate;
        let m12 = self.al * cos_phi + p.nu;
        let f1 = self.al * sin_phi * (phi_rate * phi_rate + centrifugal) - along + drive;
        let f2 = self.al * (p.l * sin_phi * cos_phi * centrifugal - cos_phi * along - sin_phi * n3) + drive;
        let inverse = T::ONE / (self.m11 * self.m22 - m12 * m12);
        let coriolis = p.l * cos_phi * phi_rate * psi_rate;
        let moment = p.s * (tau[0] - tau[1]) - self.al * sin_phi * (v * psi_rate + coriolis + coriolis + across);
        let yaw_inertia = self.yaw + self.al * p.l * sin_phi * sin_phi;
        [
            (self.m22 * f1 - m12 * f2) * inverse,
            moment / yaw_inertia,
            (self.m11 * f2 - m12 * f1) * inverse,
        ]
    }

    /// theta_r'', theta_l'' and phi'' under the nondimensional voltages `u` (right, left), each
    /// `K_T V / (R_a mt g R)`.
    #[inline]
    pub fn accelerations(&self, x: &SpatialState<T>, u: [T; 2]) -> [T; 3] {
        let [forward, yaw, phi] = self.quasi_accelerations(x, self.torques(x, u));
        let turn = self.parameters.s * yaw;
        [forward + turn, forward - turn, phi]
    }

    /// The derivative of the state under the nondimensional voltages `u` (right, left).
    #[inline]
    pub fn rate(&self, x: &SpatialState<T>, u: [T; 2]) -> SpatialState<T> {
        let [v, psi_rate] = self.forward_and_yaw_rate(x);
        let (sin_psi, cos_psi) = x[PSI].sin_cos();
        let [right, left, phi] = self.accelerations(x, u);
        [
            v * cos_psi,
            v * sin_psi,
            psi_rate,
            x[RATE_R],
            x[RATE_L],
            x[PHI_RATE],
            right,
            left,
            phi,
        ]
    }

    /// Kinetic and potential energy over `mt g R`: (6.3), corrected for `j0`, and (6.4) with (6.6).
    ///
    /// The potential is zero with the arm's mass at the axle above the plane's origin.
    pub fn energy(&self, x: &SpatialState<T>) -> T {
        let p = &self.parameters;
        let [v, psi_rate] = self.forward_and_yaw_rate(x);
        let phi_rate = x[PHI_RATE];
        let (sin_phi, cos_phi) = x[PHI].sin_cos();
        let (sin_psi, cos_psi) = x[PSI].sin_cos();
        let [n1, n2, n3] = self.up;
        let yaw_inertia = self.yaw + self.al * p.l * sin_phi * sin_phi;
        let m12 = self.al * cos_phi + p.nu;
        let kinetic = self.half
            * (self.m11 * v * v
                + self.m22 * phi_rate * phi_rate
                + (m12 + m12) * v * phi_rate
                + yaw_inertia * psi_rate * psi_rate);
        let arm = n1 * cos_psi + n2 * sin_psi;
        kinetic + n1 * x[X] + n2 * x[Y] + self.al * (sin_phi * arm - cos_phi * n3)
    }
}
