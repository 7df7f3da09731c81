//! The equations of motion at one configuration: mass matrix and the forces that no joint makes.
//!
//! Derivation in [`super`].

use model::real::Real;

use super::inertia::Inertia;
use super::ldl::{SPEEDS, Speeds, Symmetric};
use super::{BALLAST, FORWARD, LEFT, LIFT, PHI, RIGHT, SIDE, SPAR, YAW};

/// Gravity in the axes of the heading: how much of g points backward, rightward and downward, in m/s^2.
#[derive(Debug, Clone, Copy, Default)]
pub struct Gravity {
    /// Against the heading (uphill positive).
    pub along: f64,
    /// Against the left side (left uphill positive).
    pub across: f64,
    /// Against the plane's normal.
    pub normal: f64,
}

/// Sines, cosines and moments of one configuration.
#[derive(Debug, Clone, Copy)]
pub struct Configuration {
    /// Sine and cosine of the angle of the arm's centre of mass.
    pub arm: (f64, f64),
    /// Of the spar's.
    pub spar: (f64, f64),
    ballast: (f64, f64),
    /// Sine and cosine of the ballast's angle relative to the spar.
    relative: (f64, f64),
    /// Sum of masses times their place ahead of the axle.
    pub ahead: f64,
    /// Sum of masses times their place above the axle (negative: they hang).
    pub above: f64,
    /// Sum of masses times the squares of their places ahead.
    ahead2: f64,
    /// Sum of masses times place ahead times place above.
    pub product: f64,
}

impl Configuration {
    /// The configuration at the positions `q`.
    #[inline]
    pub fn new(inertia: &Inertia, q: &Speeds) -> Self {
        let arm = Real::sin_cos(q[PHI] + inertia.arm_offset);
        let (spar, ballast) = if inertia.has_spar {
            (Real::sin_cos(q[SPAR]), Real::sin_cos(q[BALLAST]))
        } else {
            ((0.0, 1.0), (0.0, 1.0))
        };
        let relative = (
            ballast.0 * spar.1 - ballast.1 * spar.0,
            ballast.1 * spar.1 + ballast.0 * spar.0,
        );
        let i = inertia;
        Self {
            arm,
            spar,
            ballast,
            relative,
            ahead: i.arm_first * arm.0 + i.spar_first * spar.0 + i.ballast_first * ballast.0,
            above: -(i.arm_first * arm.1 + i.spar_first * spar.1 + i.ballast_first * ballast.1),
            ahead2: i.arm_second * arm.0 * arm.0
                + i.spar_second * spar.0 * spar.0
                + i.ballast_second * ballast.0 * ballast.0
                + 2.0 * i.cross * spar.0 * ballast.0,
            product: -(i.arm_second * arm.0 * arm.1
                + i.spar_second * spar.0 * spar.1
                + i.ballast_second * ballast.0 * ballast.1
                + i.cross * (spar.0 * ballast.1 + spar.1 * ballast.0)),
        }
    }

    /// The mass matrix (lower triangle).
    #[inline]
    pub fn mass(&self, i: &Inertia) -> Symmetric {
        let mut m = [[0.0; SPEEDS]; SPEEDS];
        m[FORWARD][FORWARD] = i.total_mass;
        m[SIDE][SIDE] = i.total_mass;
        m[LIFT][LIFT] = i.total_mass;
        m[YAW][SIDE] = self.ahead;
        m[YAW][YAW] = i.yaw + self.ahead2;
        let [left, right] = i.rotor;
        m[RIGHT][RIGHT] = i.wheel + right;
        m[LEFT][LEFT] = i.wheel + left;
        m[PHI][FORWARD] = i.arm_first * self.arm.1;
        m[PHI][LIFT] = i.arm_first * self.arm.0;
        m[PHI][RIGHT] = right;
        m[PHI][LEFT] = left;
        m[PHI][PHI] = i.arm_second + (left + right);
        if i.has_spar {
            m[FORWARD][SPAR] = i.spar_first * self.spar.1;
            m[LIFT][SPAR] = i.spar_first * self.spar.0;
            m[SPAR][SPAR] = i.spar_second + i.ballast_rotor;
            m[FORWARD][BALLAST] = i.ballast_first * self.ballast.1;
            m[LIFT][BALLAST] = i.ballast_first * self.ballast.0;
            m[SPAR][BALLAST] = i.cross * self.relative.1 - i.ballast_rotor;
            m[BALLAST][BALLAST] = i.ballast_second + i.ballast_rotor;
        } else {
            // No spar: its speeds stay zero.
            m[SPAR][SPAR] = 1.0;
            m[BALLAST][BALLAST] = 1.0;
        }
        m
    }

    /// Rate of the masses' place ahead, sum m a', at the speeds `u`.
    #[inline]
    pub fn ahead_rate(&self, i: &Inertia, u: &Speeds) -> f64 {
        i.arm_first * self.arm.1 * u[PHI]
            + i.spar_first * self.spar.1 * u[SPAR]
            + i.ballast_first * self.ballast.1 * u[BALLAST]
    }

    /// Rate of the masses' place above, sum m b', at the speeds `u`.
    #[inline]
    pub fn above_rate(&self, i: &Inertia, u: &Speeds) -> f64 {
        i.arm_first * self.arm.0 * u[PHI]
            + i.spar_first * self.spar.0 * u[SPAR]
            + i.ballast_first * self.ballast.0 * u[BALLAST]
    }

    /// Rate of [`Configuration::product`] at the speeds `u`.
    #[inline]
    pub fn product_rate(&self, i: &Inertia, u: &Speeds) -> f64 {
        let double = |(s, c): (f64, f64)| c * c - s * s;
        let (s, b) = (self.spar, self.ballast);
        -(i.arm_second * double(self.arm) * u[PHI]
            + i.spar_second * double(s) * u[SPAR]
            + i.ballast_second * double(b) * u[BALLAST]
            + i.cross * (s.1 * b.1 - s.0 * b.0) * (u[SPAR] + u[BALLAST]))
    }

    /// Centrifugal, Coriolis and gravity forces at the speeds `u`.
    #[inline]
    pub fn forces(&self, i: &Inertia, u: &Speeds, g: &Gravity) -> Speeds {
        let (arm, spar, ballast) = (self.arm, self.spar, self.ballast);
        let yaw = u[YAW];
        let yaw2 = yaw * yaw;
        let turn = yaw * u[SIDE];
        let (phi2, spar2, ballast2) = (u[PHI] * u[PHI], u[SPAR] * u[SPAR], u[BALLAST] * u[BALLAST]);
        let ahead_rate = self.ahead_rate(i, u);
        let ahead2_rate = 2.0
            * (i.arm_second * arm.0 * arm.1 * u[PHI]
                + i.spar_second * spar.0 * spar.1 * u[SPAR]
                + i.ballast_second * ballast.0 * ballast.1 * u[BALLAST]
                + i.cross * (spar.1 * ballast.0 * u[SPAR] + spar.0 * ballast.1 * u[BALLAST]));
        let hang = |first: f64, (sin, cos): (f64, f64)| first * (cos * turn - (cos * g.along + sin * g.normal));
        let mut f = [0.0; SPEEDS];
        f[FORWARD] = i.arm_first * arm.0 * phi2
            + i.spar_first * spar.0 * spar2
            + i.ballast_first * ballast.0 * ballast2
            + yaw * (i.total_mass * u[SIDE] + yaw * self.ahead)
            - i.total_mass * g.along;
        f[SIDE] = -yaw * (i.total_mass * u[FORWARD] + 2.0 * ahead_rate) - i.total_mass * g.across;
        f[LIFT] =
            -(i.arm_first * arm.1 * phi2 + i.spar_first * spar.1 * spar2 + i.ballast_first * ballast.1 * ballast2)
                - i.total_mass * g.normal;
        f[YAW] = -ahead2_rate * yaw - self.ahead * (yaw * u[FORWARD] + g.across);
        f[PHI] = yaw2 * i.arm_second * arm.0 * arm.1 + hang(i.arm_first, arm);
        if i.has_spar {
            f[SPAR] = i.cross * self.relative.0 * ballast2
                + yaw2 * (i.spar_second * spar.0 * spar.1 + i.cross * spar.1 * ballast.0)
                + hang(i.spar_first, spar);
            f[BALLAST] = -i.cross * self.relative.0 * spar2
                + yaw2 * (i.ballast_second * ballast.0 * ballast.1 + i.cross * spar.0 * ballast.1)
                + hang(i.ballast_first, ballast);
        }
        f
    }

    /// Sum over the hanging masses of `a b' - b a'` each times its mass: their angular momentum about -y.
    #[inline]
    pub fn pitch_momentum(&self, i: &Inertia, u: &Speeds) -> f64 {
        i.arm_second * u[PHI]
            + i.spar_second * u[SPAR]
            + i.ballast_second * u[BALLAST]
            + i.cross * self.relative.1 * (u[SPAR] + u[BALLAST])
    }

    /// Kinetic energy at the speeds `u`, in J.
    pub fn kinetic(&self, i: &Inertia, u: &Speeds) -> f64 {
        let m = self.mass(i);
        let mut twice = 0.0;
        for row in 0..SPEEDS {
            twice += m[row][row] * u[row] * u[row];
            for column in 0..row {
                twice += 2.0 * m[row][column] * u[row] * u[column];
            }
        }
        0.5 * twice
    }
}
