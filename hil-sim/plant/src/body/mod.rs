//! The vehicle's bodies in space; the wheels may slip or leave the ground.
//!
//! # Coordinates
//! Positions: axle centre x, y in the base plane and z above its height on the bare plane; heading; wheel angles; arm
//! angle phi, spar angle and ballast angle. The last three are measured **from the plane's normal** and are forward
//! positive (a rotation about -y). The ballast's angle is absolute here; its motor turns the ballast relative to the
//! spar. Speeds: (u, w, v_z) of the axle in the heading's axes (forward, left, up), the yaw rate and the five rates.
//! All nine are free: the wheels roll because of friction.
//!
//! # Equations
//! With e1 forward, e2 left and e3 the plane's normal, every mass off the axle is at a e1 + b e3, where a is the sum of
//! the lengths times the angles' sines, and b minus the sum of the lengths times the cosines. Its velocity is `(u + a')
//! e1 + (w + yaw a) e2 + (v_z + b') e3`, hence
//!
//! ```text
//! 2T = Mt (u^2 + w^2 + v_z^2) + 2 u A' + 2 w yaw A + 2 v_z B' + yaw^2 (J + sum m a^2)
//!      + sum m (a'^2 + b'^2) + I_w (th_r'^2 + th_l'^2)
//!      + n^2 J_rotor [(th_r' + phi')^2 + (th_l' + phi')^2] + n_c^2 J_c (ballast' - spar')^2
//! ```
//!
//! with A = sum m a, B = sum m b. u, w, v_z and yaw are quasi-velocities, so the equations are Euler's
//! (p = dT/du etc.: p' + yaw e3 x p = F and, about the moving axle, H' + v x p = M) and Lagrange's for
//! the angles:
//!
//! ```text
//! Mt u' + A''|acc       = F_1 + sum first sin q'^2 + yaw (Mt w + yaw A) - Mt g_f
//! Mt w' + A yaw'        = F_2 - yaw (Mt u + 2 A') - Mt g_l
//! Mt v_z' + B''|acc     = F_3 - sum first cos q'^2 - Mt g_n
//! A w' + (J+K) yaw'     = M_3 - K' yaw - A (yaw u + g_l),        K = sum m a^2
//! first cos (u' - yaw w) + first sin v_z' + second q'' + ...
//!                       = Q + yaw^2 dK/dq / 2 - first (cos g_f + sin g_n)
//! ```
//!
//! for q = phi, spar, ballast (spar and ballast coupled by m_r l_m l_r cos(ballast - spar)). On a plane with rolling
//! wheels the equations reduce to Eq. 3.12/3.13 of the planar vehicle, to the corrected equations of ch. 6 (erratum
//! E23), and to the corrected coupled vehicle of ch. 8 with the spar pivoted on the arm (errata E32 to E36). The tests
//! compare them with `model::dynamics`.
//!
//! # Contact
//! Normal: the wheels' centres follow their paths over the profile ([`super::terrain`]); one unilateral constraint `v_z
//! = rate of the mean path height`, whose multiplier is the total normal force. If the force would pull, the axle is in
//! flight, without normal force and friction, until it lands inelastically. Tangential: `contact` treats each wheel's
//! longitudinal (along the path) and lateral friction together. The normal forces of the two wheels follow from the
//! roll balance about the axle, which includes gyroscopic and lateral loads.
//!
//! # Approximations
//! - There is no roll coordinate: the axle's roll angle is that of the paths under its wheels, and its rate and inertia
//!   are neglected. A wheel that the roll balance unloads is flagged and has no friction, but the vehicle does not tip
//!   over.
//! - Yaw is a rotation about the plane's normal even while a profile inclines the path. This is exact on planes.
//! - The normal force is the mean over a substep. A kerb's impact therefore appears as a peak with a meaningful area
//!   but a meaningless height. Impacts are inelastic and tyres are rigid.
//! - The two wheels share the lateral force in proportion to the force that each can hold.
//!
//! # Step
//! The scheme is midpoint in the configuration and implicit in every stiff term. With the mass matrix and geometry at
//! the half step, `(M + h/2 D + h G) du = h f(u_mid) - ...` where D collects viscous and back-EMF damping (trapezoidal,
//! or at the end of the step where a damper stops its inertia within the step), and G the regularised dry frictions and
//! the normal constraint (end of step). In `f(u_mid)` the middle speed is the old speed plus half the change of the
//! previous substep; a repeated solution uses half of its own change. The scheme is second order between events, first
//! order across a change of stick and slip, and unconditionally stable in D and G. Elimination solves the system: `ldl`
//! for any vehicle on any ground, `rolling` with the known zeros of a vehicle that rolls on a plane.

mod contact;
mod coordinates;
mod inertia;
mod joint;
mod ldl;
mod motion;
mod outside;
mod paths;
mod payload;
mod rolling;
mod step;
#[cfg(test)]
mod tests;
mod tracked_angle;

use contact::{ContactMode, GearMode};
use coordinates::{ANGLES, JOINTS};
pub use coordinates::{BALLAST, FORWARD, LEFT, LIFT, PHI, RIGHT, SIDE, SPAR, YAW};
pub use inertia::Inertia;
pub use joint::JointTorque;
use ldl::{SPEEDS, Speeds, dot};
use model::real::Real;
use model::sample::MOTORS;
use model::vehicle::Vehicle;
use motion::Configuration;
pub use motion::{AxleRoll, Gravity};
use outside::Outside;
pub use outside::{Push, PushedBody};
pub use payload::Payload;
use tracked_angle::TrackedAngles;

use super::terrain::Ground;

/// The motion over the last substep of a body that swings about the axle.
#[derive(Debug, Clone, Copy)]
pub struct Swing {
    /// Sine and cosine of its angle from the plane's normal, in the middle of the substep.
    pub sin_cos: (f64, f64),
    /// Mean rate, in rad/s.
    pub rate: f64,
    /// Mean acceleration, in rad/s^2.
    pub acceleration: f64,
}

/// A wheel's contact in the last substep.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct WheelContact {
    /// Normal force in N (mean over the substep).
    pub normal_n: f64,
    /// Longitudinal force on the wheel in N, forward positive.
    pub longitudinal_n: f64,
    /// Lateral force on the wheel in N, left positive.
    pub lateral_n: f64,
    /// Slip of the contact point: forward speed of the centre along its path less r theta'.
    pub slip_m_s: f64,
    /// Whether the contact slides (its slip is beyond the band of the regularised law).
    pub sliding: bool,
    /// Whether the wheel is off the ground.
    pub lifted: bool,
}

/// The vehicle's bodies: positions, speeds, and the results of the last substep.
#[derive(Debug, Clone)]
pub struct Body {
    inertia: Inertia,
    position: Speeds,
    speed: Speeds,
    /// Mean speeds over the last substep.
    mean_speed: Speeds,
    acceleration: Speeds,
    gravity: Gravity,
    axle_roll: AxleRoll,
    /// Contacts of the left and the right wheel.
    wheels: [WheelContact; 2],
    wheel_modes: [ContactMode; 2],
    gear_modes: [GearMode; MOTORS],
    /// Angles of the arm's centre of mass, spar, ballast and heading in the middle of the last substep.
    middle: TrackedAngles<4>,
    /// Mean rates of the motors' joints over the last substep.
    mean_rates: [f64; MOTORS],
    in_flight: bool,
    /// Whether over the last substep both wheels rolled on the plane and no external force acted.
    rolled: bool,
    outside: Outside,
    payload: Payload,
    slope: [f64; 2],
}

impl Body {
    /// The vehicle at rest at the origin, heading along x, with arm, spar and ballast hanging vertically.
    pub fn new(vehicle: &Vehicle<f64>, ground: &Ground) -> Self {
        let mut body = Self {
            inertia: Inertia::new(vehicle),
            position: [0.0; SPEEDS],
            speed: [0.0; SPEEDS],
            mean_speed: [0.0; SPEEDS],
            acceleration: [0.0; SPEEDS],
            gravity: Gravity::default(),
            axle_roll: AxleRoll::default(),
            wheels: [WheelContact::default(); 2],
            wheel_modes: [ContactMode::Stick; 2],
            gear_modes: [GearMode::Stick; MOTORS],
            middle: TrackedAngles::new([0.0; 4]),
            mean_rates: [0.0; MOTORS],
            in_flight: false,
            rolled: false,
            outside: Outside::default(),
            payload: Payload::default(),
            slope: [0.0; 2],
        };
        body.place(ground, 0.0, 0.0, 0.0);
        body
    }

    /// Puts the vehicle at rest at (x, y) with a heading. Arm, spar and ballast hang vertically.
    pub fn place(&mut self, ground: &Ground, x_m: f64, y_m: f64, heading_rad: f64) {
        self.position[FORWARD] = x_m;
        self.position[SIDE] = y_m;
        self.position[YAW] = heading_rad;
        self.speed = [0.0; SPEEDS];
        self.mean_speed = [0.0; SPEEDS];
        self.acceleration = [0.0; SPEEDS];
        let (sin, cos) = Real::sin_cos(heading_rad);
        let reach = self.inertia.half_track * sin;
        let paths = [ground.wheel(x_m - reach), ground.wheel(x_m + reach)];
        self.position[LIFT] = 0.5 * (paths[0].height_m + paths[1].height_m);
        self.slope = [paths[0].slope * cos, paths[1].slope * cos];
        let heights = [paths[0].height_m, paths[1].height_m];
        (self.gravity, self.axle_roll.sin) = self.gravity_at(ground, (sin, cos), heights);
        self.axle_roll.rate = 0.0;
        let vertical = self.vertical_rad();
        for index in [PHI, SPAR, BALLAST] {
            self.position[index] = -vertical;
        }
        let share = 0.5 * self.inertia.total_mass * self.gravity.normal;
        for wheel in &mut self.wheels {
            *wheel = WheelContact {
                normal_n: share,
                ..WheelContact::default()
            };
        }
        self.wheel_modes = [ContactMode::Stick; 2];
        self.gear_modes = [GearMode::Stick; MOTORS];
        self.in_flight = false;
    }

    /// The constants of the vehicle.
    pub fn inertia(&self) -> &Inertia {
        &self.inertia
    }

    /// The constants of the vehicle, mutable.
    pub(crate) fn inertia_mut(&mut self) -> &mut Inertia {
        &mut self.inertia
    }

    /// Positions (see the indices of this module).
    pub fn position(&self) -> &Speeds {
        &self.position
    }

    /// Speeds (see the indices of this module).
    pub fn speed(&self) -> &Speeds {
        &self.speed
    }

    /// Positions and speeds, mutable. The next step puts the height back on the ground.
    pub fn state_mut(&mut self) -> (&mut Speeds, &mut Speeds) {
        (&mut self.position, &mut self.speed)
    }

    /// Mean speeds over the last substep.
    pub fn mean_speed(&self) -> &Speeds {
        &self.mean_speed
    }

    /// Mean acceleration over the last substep.
    pub fn acceleration(&self) -> &Speeds {
        &self.acceleration
    }

    /// The arm's swing over the last substep.
    pub fn arm_swing(&self) -> Swing {
        let [middle, ..] = self.middle.sin_cos();
        if self.inertia.arm_offset == 0.0 {
            return self.swing(PHI, middle);
        }
        // The stored angle is that of the centre of mass; the arm's axis differs by the offset.
        let [angle, ..] = *self.middle.angles();
        self.swing(PHI, Real::sin_cos(angle - self.inertia.arm_offset))
    }

    /// The spar's swing over the last substep.
    pub fn spar_swing(&self) -> Swing {
        let [_, middle, ..] = self.middle.sin_cos();
        self.swing(SPAR, middle)
    }

    #[inline]
    fn swing(&self, index: usize, sin_cos: (f64, f64)) -> Swing {
        Swing {
            sin_cos,
            rate: self.mean_speed[index],
            acceleration: self.acceleration[index],
        }
    }

    /// Gravity in the heading's axes.
    pub fn gravity(&self) -> Gravity {
        self.gravity
    }

    /// How the axle is rolled out of the plane.
    pub fn axle_roll(&self) -> AxleRoll {
        self.axle_roll
    }

    /// Contacts of the left and right wheel.
    pub fn wheels(&self) -> &[WheelContact; 2] {
        &self.wheels
    }

    /// Rise per metre along the heading of each wheel's path: left, right.
    pub fn path_slopes(&self) -> [f64; 2] {
        self.slope
    }

    /// Whether over the last substep both wheels rolled on the plane and no external force acted. The motion then has
    /// no kinks except those of the gearboxes' friction.
    pub fn rolled(&self) -> bool {
        self.rolled
    }

    /// Whether the axle is off the ground.
    pub fn in_flight(&self) -> bool {
        self.in_flight
    }

    /// Inclination of the base plane along the heading: angle from the plane's normal to the vertical. Adding
    /// it to an angle from the normal gives the angle from the vertical (erratum E20).
    pub fn vertical_rad(&self) -> f64 {
        libm::atan2(self.gravity.along, self.gravity.normal)
    }

    /// Rates of the motors' joints `dt_s` seconds from now, at the mean acceleration of the last substep.
    pub(crate) fn joint_rates_after(&self, dt_s: f64) -> [f64; MOTORS] {
        JOINTS.map(|row| dot(&row, &self.speed) + dt_s * dot(&row, &self.acceleration))
    }

    /// Rate of a motor's joint: wheel relative to arm, ballast relative to spar.
    #[inline]
    pub fn joint_rate(&self, motor: usize) -> f64 {
        JOINTS.get(motor).map_or(0.0, |row| dot(row, &self.speed))
    }

    /// Mean rates of the motors' joints over the last substep, as used in their torque laws.
    pub fn mean_joint_rates(&self) -> &[f64; MOTORS] {
        &self.mean_rates
    }

    /// Angle of a motor's joint.
    #[inline]
    pub fn joint_angle(&self, motor: usize) -> f64 {
        JOINTS.get(motor).map_or(0.0, |row| dot(row, &self.position))
    }

    /// Kinetic and potential energy in J; zero potential with every mass at the axle at the origin.
    pub fn energy(&self, ground: &Ground) -> f64 {
        let [arm, spar, ballast] = [self.arm_mass_angle(), self.position[SPAR], self.position[BALLAST]];
        let c = Configuration::new(&self.inertia, [arm, spar, ballast].map(Real::sin_cos));
        let (sin, cos) = Real::sin_cos(self.position[YAW]);
        let [n1, n2, n3] = ground.up_m_s2();
        let mass = self.inertia.total_mass;
        let [x, y, z] = [self.position[FORWARD], self.position[SIDE], self.position[LIFT]];
        c.kinetic(&self.inertia, &self.speed)
            + mass * (n1 * x + n2 * y + n3 * z)
            + c.ahead * (n1 * cos + n2 * sin)
            + c.above * n3
    }

    /// Gravity in the heading's axes, the plane rolled by the paths' difference in height, and the sine of that roll.
    fn gravity_at(&self, ground: &Ground, (sin, cos): (f64, f64), heights: [f64; 2]) -> (Gravity, f64) {
        let [n1, n2, n3] = ground.up_m_s2();
        let across = n2 * cos - n1 * sin;
        let rise = (heights[0] - heights[1] + self.inertia.radius_difference) / (2.0 * self.inertia.half_track);
        // Left wheel higher: the axle's left end points up by `rise`.
        let scale = 1.0 / (1.0 + rise * rise).sqrt();
        let gravity = Gravity {
            along: n1 * cos + n2 * sin,
            across: (across + n3 * rise) * scale,
            normal: (n3 - across * rise) * scale,
        };
        (gravity, rise * scale)
    }
}
