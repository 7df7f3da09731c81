//! The equations of motion at one configuration: the mass matrix and all forces except those of the joints.
//!
//! See [`super`] for the derivation.

use super::inertia::Inertia;
use super::ldl::{SPEEDS, Speeds, Symmetric};
use super::{BALLAST, FORWARD, LEFT, LIFT, PHI, RIGHT, SIDE, SPAR, YAW};

/// Components of g in the axes of the heading, in m/s^2: backward, rightward and downward.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Gravity {
    /// Against the heading (uphill positive), in m/s^2.
    pub along: f64,
    /// Against the left side (left uphill positive), in m/s^2.
    pub across: f64,
    /// Against the plane's normal, in m/s^2.
    pub normal: f64,
}

/// How the axle is rolled out of the plane, by wheels on paths of different height or of different radii.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct AxleRoll {
    /// Its sine: positive with the left end up.
    pub sin: f64,
    /// Its rate, rad/s.
    pub rate: f64,
}

/// The bodies that swing about the axle, in the order of the arrays of [`Configuration`].
const SWINGING: [usize; 3] = [PHI, SPAR, BALLAST];

/// Sines, cosines and moments of one configuration. The arrays contain arm, spar and ballast.
#[derive(Debug, Clone, Copy)]
pub struct Configuration {
    /// Sine and cosine of the angle of the arm's centre of mass.
    pub arm: (f64, f64),
    /// Sine and cosine of the spar's angle.
    pub spar: (f64, f64),
    /// First moments times cosine, in kg m: the coupling of a body's angle with the forward speed.
    pub forward: [f64; 3],
    /// First moments times sine, in kg m: the coupling of a body's angle with the speed off the plane.
    pub lift: [f64; 3],
    /// Second moments times sine times sine, in kg m^2.
    sine2: [f64; 3],
    /// Second moments times sine times cosine, in kg m^2.
    mixed: [f64; 3],
    /// The coupling of spar and ballast times the spar's sine or cosine times the ballast's sine or cosine, in kg m^2.
    sine_sine: f64,
    sine_cosine: f64,
    cosine_sine: f64,
    cosine_cosine: f64,
    /// Sum of the masses times their distances ahead of the axle, in kg m.
    pub ahead: f64,
    /// Sum of the masses times their heights above the axle (negative while they hang), in kg m.
    pub above: f64,
    /// Sum of the masses times the squares of their distances ahead, in kg m^2.
    pub ahead2: f64,
    /// Sum of the masses times distance ahead times height above, in kg m^2.
    pub product: f64,
}

impl Configuration {
    /// The configuration with these sines and cosines of arm, spar and ballast.
    #[inline]
    pub fn new(i: &Inertia, [arm, spar, ballast]: [(f64, f64); 3]) -> Self {
        let bodies = [
            (arm, i.arm_first, i.arm_second),
            (spar, i.spar_first, i.spar_second),
            (ballast, i.ballast_first, i.ballast_second),
        ];
        let forward = bodies.map(|((_, cos), first, _)| first * cos);
        let lift = bodies.map(|((sin, _), first, _)| first * sin);
        let sine2 = bodies.map(|((sin, _), _, second)| second * sin * sin);
        let mixed = bodies.map(|((sin, cos), _, second)| second * sin * cos);
        let (sine, cosine) = (i.cross * spar.0, i.cross * spar.1);
        let (sine_sine, sine_cosine) = (sine * ballast.0, sine * ballast.1);
        let (cosine_sine, cosine_cosine) = (cosine * ballast.0, cosine * ballast.1);
        Self {
            arm,
            spar,
            forward,
            lift,
            sine2,
            mixed,
            sine_sine,
            sine_cosine,
            cosine_sine,
            cosine_cosine,
            ahead: sum(lift),
            above: -sum(forward),
            ahead2: sum(sine2) + 2.0 * sine_sine,
            product: -(sum(mixed) + sine_cosine + cosine_sine),
        }
    }

    /// The inertial coupling of spar and ballast: m_r l_m l_r times the cosine of the angle between them.
    #[inline]
    pub fn spar_ballast(&self) -> f64 {
        self.cosine_cosine + self.sine_sine
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
        let ([arm_forward, spar_forward, ballast_forward], [arm_lift, spar_lift, ballast_lift]) =
            (self.forward, self.lift);
        m[PHI][FORWARD] = arm_forward;
        m[PHI][LIFT] = arm_lift;
        m[PHI][RIGHT] = right;
        m[PHI][LEFT] = left;
        m[PHI][PHI] = i.arm_second + (left + right);
        if i.has_spar {
            m[FORWARD][SPAR] = spar_forward;
            m[LIFT][SPAR] = spar_lift;
            m[SPAR][SPAR] = i.spar_second + i.ballast_rotor;
            m[FORWARD][BALLAST] = ballast_forward;
            m[LIFT][BALLAST] = ballast_lift;
            m[SPAR][BALLAST] = self.spar_ballast() - i.ballast_rotor;
            m[BALLAST][BALLAST] = i.ballast_second + i.ballast_rotor;
        } else {
            // Without a spar its speeds stay zero.
            m[SPAR][SPAR] = 1.0;
            m[BALLAST][BALLAST] = 1.0;
        }
        m
    }

    /// Rate of [`Configuration::above`], sum m b', at the speeds `u`.
    #[inline]
    pub fn above_rate(&self, u: &Speeds) -> f64 {
        weighted(self.lift, swinging(u))
    }

    /// Rate of [`Configuration::product`] at the speeds `u`.
    #[inline]
    pub fn product_rate(&self, i: &Inertia, u: &Speeds) -> f64 {
        let [arm, spar, ballast] = self.sine2;
        // Second moment times the cosine of twice the angle.
        let doubles = [
            i.arm_second - 2.0 * arm,
            i.spar_second - 2.0 * spar,
            i.ballast_second - 2.0 * ballast,
        ];
        -(weighted(doubles, swinging(u)) + (self.cosine_cosine - self.sine_sine) * (u[SPAR] + u[BALLAST]))
    }

    /// Centrifugal, Coriolis and gravity forces at the speeds `u`.
    // Every substep calls this function; inlined, its result stays in registers.
    #[allow(clippy::inline_always)]
    #[inline(always)]
    pub fn forces(&self, i: &Inertia, u: &Speeds, g: &Gravity) -> Speeds {
        let yaw = u[YAW];
        let yaw2 = yaw * yaw;
        let rates = swinging(u);
        let squares = rates.map(|rate| rate * rate);
        let ahead_rate = weighted(self.forward, rates);
        let ahead2_rate =
            2.0 * (weighted(self.mixed, rates) + self.cosine_sine * u[SPAR] + self.sine_cosine * u[BALLAST]);
        let mut f = [0.0; SPEEDS];
        f[FORWARD] =
            weighted(self.lift, squares) + yaw * (i.total_mass * u[SIDE] + yaw * self.ahead) - i.total_mass * g.along;
        f[SIDE] = -yaw * (i.total_mass * u[FORWARD] + 2.0 * ahead_rate) - i.total_mass * g.across;
        f[LIFT] = -weighted(self.forward, squares) - i.total_mass * g.normal;
        f[YAW] = -ahead2_rate * yaw - self.ahead * (yaw * u[FORWARD] + g.across);
        let along = yaw * u[SIDE] - g.along;
        let hang = |body: usize| self.forward[body] * along - self.lift[body] * g.normal;
        f[PHI] = yaw2 * self.mixed[0] + hang(0);
        if i.has_spar {
            // The coupling times the sine of the ballast's angle from the spar.
            let relative = self.cosine_sine - self.sine_cosine;
            f[SPAR] = relative * squares[2] + yaw2 * (self.mixed[1] + self.cosine_sine) + hang(1);
            f[BALLAST] = -relative * squares[1] + yaw2 * (self.mixed[2] + self.sine_cosine) + hang(2);
        }
        f
    }

    /// Sum of `a b' - b a'` times the mass over the hanging masses: their angular momentum about -y.
    #[inline]
    pub fn pitch_momentum(&self, i: &Inertia, u: &Speeds) -> f64 {
        i.arm_second * u[PHI]
            + i.spar_second * u[SPAR]
            + i.ballast_second * u[BALLAST]
            + self.spar_ballast() * (u[SPAR] + u[BALLAST])
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

/// The rates of arm, spar and ballast.
#[inline]
fn swinging(u: &Speeds) -> [f64; 3] {
    SWINGING.map(|index| u[index])
}

fn sum([a, b, c]: [f64; 3]) -> f64 {
    a + b + c
}

fn weighted([a, b, c]: [f64; 3], [x, y, z]: [f64; 3]) -> f64 {
    a * x + b * y + c * z
}
