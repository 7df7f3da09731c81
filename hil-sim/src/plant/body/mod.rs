//! The vehicle's bodies in space, on wheels that may slip or leave the ground.
//!
//! # Coordinates
//! Axle centre x, y in the base plane and z above its height on the bare plane; heading; wheel angles;
//! arm angle phi, spar angle and ballast angle, these three **from the plane's normal** and forward
//! positive (a rotation about -y). The ballast's angle is kept absolute here, its relative rate is what
//! its motor turns. Speeds: (u, w, v_z) of the axle in the heading's axes (forward, left, up), yaw rate
//! and the five rates, so that all nine are free: rolling is what friction makes of them.
//!
//! # Equations
//! With e1 forward, e2 left, e3 the plane's normal, every mass off the axle sits at a e1 + b e3 with
//! a = sum of arms times sines, b = minus the same with cosines. Its velocity is
//! `(u + a') e1 + (w + yaw a) e2 + (v_z + b') e3`, hence
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
//! for q = phi, spar, ballast (spar and ballast coupled by m_r l_m l_r cos(ballast - spar)). On a plane,
//! wheels rolling, they are Eq. 3.12/3.13 of the planar vehicle, the corrected reduced equations of ch. 6
//! (erratum E23) and the corrected coupled vehicle of ch. 8 with the spar pivoted on the chassis (errata
//! E32 to E36): the tests hold them against `model::dynamics`.
//!
//! # Contact
//! Normal: the wheels' centres follow their paths over the profile ([`super::terrain`]); one unilateral
//! constraint `v_z = rate of the mean path height` with the multiplier as total normal force. Where it
//! would pull, the axle is in flight: no normal force, no friction, until it lands (inelastic). Tangent:
//! [`contact`], per wheel, longitudinal along the path and lateral together. Normal forces of the two
//! wheels follow from the roll balance about the axle, gyroscopic and lateral loads included.
//!
//! # Approximations
//! - No roll coordinate: the axle's roll angle is that of the paths under its wheels, its rate and inertia
//!   are neglected; a wheel that the roll balance unloads is flagged, keeps no friction, but the vehicle
//!   does not tip over.
//! - Yaw turns about the plane's normal also while the path is inclined by a profile; exact on planes.
//! - The normal force is the mean over a substep, so a kerb's impact shows as a peak whose area, not
//!   whose height, has a meaning. Impacts are inelastic, tyres are rigid.
//! - The lateral force of both wheels is shared in proportion to what each can hold.
//!
//! # Step
//! Midpoint in the configuration, implicit in everything stiff: with the mass matrix and geometry at the
//! half step, `(M + h/2 D + h G) du = h f(u_mid) - ...` where D collects viscous and back-EMF damping
//! (trapezoidal), G the regularised dry frictions and the normal constraint (end of step). Second order
//! between events, first order across a change of stick and slip; unconditionally stable in D and G.

mod contact;
mod inertia;
mod ldl;
mod motion;
#[cfg(test)]
mod tests;

use contact::{GEAR_BAND_RAD_S, Linear, Mode, WHEEL_BAND_M_S};
pub use inertia::Inertia;
use ldl::{Factored, SPEEDS, Speeds, Symmetric, add_outer, add_scaled, dot};
use model::real::Real;
use model::sample::MOTORS;
use model::vehicle::Vehicle;
use motion::Configuration;
pub use motion::Gravity;

use super::terrain::Ground;

/// Index of x (position) and of the forward speed.
pub const FORWARD: usize = 0;
/// Index of y (position) and of the speed to the left.
pub const SIDE: usize = 1;
/// Index of the height and of the speed off the plane.
pub const LIFT: usize = 2;
/// Index of heading and yaw rate.
pub const YAW: usize = 3;
/// Index of the right wheel.
pub const RIGHT: usize = 4;
/// Index of the left wheel.
pub const LEFT: usize = 5;
/// Index of the arm.
pub const PHI: usize = 6;
/// Index of the camera spar.
pub const SPAR: usize = 7;
/// Index of the ballast (absolute).
pub const BALLAST: usize = 8;

/// Stiffness of the normal constraint on the end-of-step speed, in N s/m: 13 kg sink 0.1 um/s.
const NORMAL_N_S_M: f64 = 1e9;
/// Stiffness of a chock on its wheel's rate, in N m s/rad.
const CHOCK_N_M_S: f64 = 1e7;
/// Newton iterations after which the secant takes over, and at most.
const NEWTON_MAX: usize = 6;
const ITERATIONS_MAX: usize = 16;

/// Rows of the joints over the speeds, in the order of [`model::sample::Motor`].
const JOINTS: [[(usize, f64); 2]; MOTORS] = [
    [(LEFT, 1.0), (PHI, 1.0)],
    [(RIGHT, 1.0), (PHI, 1.0)],
    [(BALLAST, 1.0), (SPAR, -1.0)],
];
const SPAR_BEARING: [(usize, f64); 2] = [(SPAR, 1.0), (PHI, -1.0)];
const SIDE_SLIP: [(usize, f64); 1] = [(SIDE, 1.0)];

/// What a motor does to its joint within one substep: `constant - damping * mean rate`, and dry friction.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct JointTorque {
    /// Torque at rate zero, in N m at the gearbox output.
    pub constant_n_m: f64,
    /// Slope against the mean rate over the substep, in N m s/rad.
    pub damping_n_m_s: f64,
    /// Coulomb friction at the output, in N m.
    pub coulomb_n_m: f64,
}

/// A contact of a wheel as it was in the last substep.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct WheelContact {
    /// Normal force in N (mean over the substep).
    pub normal_n: f64,
    /// Longitudinal force on the wheel, forward positive.
    pub longitudinal_n: f64,
    /// Lateral force on the wheel, left positive.
    pub lateral_n: f64,
    /// Slip of the contact point: forward speed of the centre along its path less r theta'.
    pub slip_m_s: f64,
    /// The contact slides (beyond the band of the regularised law).
    pub sliding: bool,
    /// The wheel does not touch the ground.
    pub lifted: bool,
}

/// The vehicle's bodies: positions, speeds, and what the last substep left.
#[derive(Debug, Clone)]
pub struct Body {
    inertia: Inertia,
    position: Speeds,
    speed: Speeds,
    acceleration: Speeds,
    gravity: Gravity,
    /// Right and left.
    wheels: [WheelContact; 2],
    wheel_modes: [Mode; 2],
    gear_modes: [Mode; MOTORS],
    in_flight: bool,
    chocked: bool,
    slope: [f64; 2],
}

/// Geometry of the contacts in one substep.
struct Contacts {
    /// Longitudinal slip of right and left over the speeds.
    roll: [[(usize, f64); 4]; 2],
    /// Speed of the axle off its path over the speeds.
    normal: [(usize, f64); 4],
    friction: [f64; 2],
    /// Reciprocal cosine of each path's slope.
    secant: [f64; 2],
    height: f64,
}

impl Body {
    /// The vehicle at rest at the origin, heading along x, everything hanging from the vertical.
    pub fn new(vehicle: &Vehicle<f64>, ground: &Ground) -> Self {
        let mut body = Self {
            inertia: Inertia::new(vehicle),
            position: [0.0; SPEEDS],
            speed: [0.0; SPEEDS],
            acceleration: [0.0; SPEEDS],
            gravity: Gravity::default(),
            wheels: [WheelContact::default(); 2],
            wheel_modes: [Mode::Stick; 2],
            gear_modes: [Mode::Stick; MOTORS],
            in_flight: false,
            chocked: false,
            slope: [0.0; 2],
        };
        body.place(ground, 0.0, 0.0, 0.0);
        body
    }

    /// Puts the vehicle at rest at (x, y) with a heading, arm, spar and ballast hanging vertically.
    pub fn place(&mut self, ground: &Ground, x_m: f64, y_m: f64, heading_rad: f64) {
        self.position[FORWARD] = x_m;
        self.position[SIDE] = y_m;
        self.position[YAW] = heading_rad;
        self.speed = [0.0; SPEEDS];
        self.acceleration = [0.0; SPEEDS];
        let (sin, cos) = Real::sin_cos(heading_rad);
        let reach = self.inertia.half_track * sin;
        let paths = [ground.wheel(x_m + reach), ground.wheel(x_m - reach)];
        self.position[LIFT] = 0.5 * (paths[0].height_m + paths[1].height_m);
        self.slope = [paths[0].slope * cos, paths[1].slope * cos];
        self.gravity = self.gravity_at(ground, (sin, cos), [paths[0].height_m, paths[1].height_m]);
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
        self.wheel_modes = [Mode::Stick; 2];
        self.gear_modes = [Mode::Stick; MOTORS];
        self.in_flight = false;
    }

    /// The constants of the vehicle.
    pub fn inertia(&self) -> &Inertia {
        &self.inertia
    }

    /// Positions (see the indices of this module).
    pub fn position(&self) -> &Speeds {
        &self.position
    }

    /// Speeds (see the indices of this module).
    pub fn speed(&self) -> &Speeds {
        &self.speed
    }

    /// Positions and speeds, to set a state. The height is put back on the ground by the next step.
    pub fn state_mut(&mut self) -> (&mut Speeds, &mut Speeds) {
        (&mut self.position, &mut self.speed)
    }

    /// Mean acceleration over the last substep.
    pub fn acceleration(&self) -> &Speeds {
        &self.acceleration
    }

    /// Gravity in the heading's axes.
    pub fn gravity(&self) -> Gravity {
        self.gravity
    }

    /// Contacts of the right and left wheel.
    pub fn wheels(&self) -> &[WheelContact; 2] {
        &self.wheels
    }

    /// Rise of the right and left wheel's path a metre along the heading.
    pub fn path_slopes(&self) -> [f64; 2] {
        self.slope
    }

    /// The axle is off the ground.
    pub fn in_flight(&self) -> bool {
        self.in_flight
    }

    /// Wheels blocked by chocks (a hand on the rims): they do not turn; the arm still swings.
    pub fn chocked(&self) -> bool {
        self.chocked
    }

    /// Puts chocks to the wheels or takes them away.
    pub fn set_chocked(&mut self, chocked: bool) {
        self.chocked = chocked;
    }

    /// Pitch of the base plane along the heading: angle from the plane's normal to the vertical. Adding
    /// it to an angle from the normal gives the angle from the vertical (erratum E20).
    pub fn vertical_rad(&self) -> f64 {
        libm::atan2(self.gravity.along, self.gravity.normal)
    }

    /// Rate of a motor's joint: wheel relative to arm, ballast relative to spar.
    #[inline]
    pub fn joint_rate(&self, motor: usize) -> f64 {
        JOINTS.get(motor).map_or(0.0, |row| dot(row, &self.speed))
    }

    /// Angle of a motor's joint.
    #[inline]
    pub fn joint_angle(&self, motor: usize) -> f64 {
        JOINTS.get(motor).map_or(0.0, |row| dot(row, &self.position))
    }

    /// Kinetic and potential energy in J; zero potential with every mass at the axle at the origin.
    pub fn energy(&self, ground: &Ground) -> f64 {
        let c = Configuration::new(&self.inertia, &self.position);
        let (sin, cos) = Real::sin_cos(self.position[YAW]);
        let [n1, n2, n3] = ground.up_m_s2();
        let mass = self.inertia.total_mass;
        let [x, y, z] = [self.position[FORWARD], self.position[SIDE], self.position[LIFT]];
        c.kinetic(&self.inertia, &self.speed)
            + mass * (n1 * x + n2 * y + n3 * z)
            + c.ahead * (n1 * cos + n2 * sin)
            + c.above * n3
    }

    /// Gravity in the heading's axes, the plane rolled by the paths' difference in height.
    fn gravity_at(&self, ground: &Ground, (sin, cos): (f64, f64), heights: [f64; 2]) -> Gravity {
        let [n1, n2, n3] = ground.up_m_s2();
        let across = n2 * cos - n1 * sin;
        let rise = (heights[1] - heights[0]) / (2.0 * self.inertia.half_track);
        // Left wheel higher: the axle's left end points up by `rise`.
        let scale = 1.0 / (1.0 + rise * rise).sqrt();
        Gravity {
            along: n1 * cos + n2 * sin,
            across: (across + n3 * rise) * scale,
            normal: (n3 - across * rise) * scale,
        }
    }

    /// Advances by `h` seconds under the motors' `joints`.
    pub fn step(&mut self, h: f64, ground: &Ground, joints: &[JointTorque; MOTORS]) {
        let u = self.speed;
        let half = 0.5 * h;
        let mut middle = self.position;
        for index in YAW..SPEEDS {
            middle[index] += half * u[index];
        }
        let heading = Real::sin_cos(middle[YAW]);
        let c = Configuration::new(&self.inertia, &middle);
        let contacts = self.contacts(h, ground, heading);

        let mut base = c.mass(&self.inertia);
        let mut load = [0.0; SPEEDS];
        self.joint_terms(h, joints, &mut base, &mut load);

        let predicted = self.position[LIFT] + h * u[LIFT];
        let mut grounded = !self.in_flight || predicted <= contacts.height;
        let mut wheel_modes = self.wheel_modes;
        let mut gear_modes = self.gear_modes;
        let mut normals = [self.wheels[0].normal_n, self.wheels[1].normal_n];
        let mut change = [0.0; SPEEDS];
        for iteration in 0..ITERATIONS_MAX {
            let mut a = base;
            let mut b = load;
            let secant = iteration >= NEWTON_MAX;
            let laws = self.dry_terms(
                h,
                joints,
                &contacts,
                grounded,
                (&wheel_modes, &gear_modes),
                normals,
                secant,
                &mut a,
                &mut b,
            );
            let factored = Factored::new(a);
            // Predictor with the forces at the old speeds, corrector with those at the middle ones.
            for _ in 0..if iteration == 0 { 2 } else { 1 } {
                let mean: Speeds = core::array::from_fn(|i| u[i] + 0.5 * change[i]);
                let f = c.forces(&self.inertia, &mean, &self.gravity);
                let right: Speeds = core::array::from_fn(|i| b[i] + h * f[i]);
                change = factored.solve(right);
            }
            let end: Speeds = core::array::from_fn(|i| u[i] + change[i]);

            let push = if grounded {
                -NORMAL_N_S_M * dot(&contacts.normal, &end)
            } else {
                0.0
            };
            if push < 0.0 {
                // The ground cannot pull: solve again without it.
                grounded = false;
                continue;
            }
            let mut again = false;
            let slip: [[f64; 2]; 2] = core::array::from_fn(|i| [dot(&contacts.roll[i], &end), dot(&SIDE_SLIP, &end)]);
            for i in 0..2 {
                let (mode, changed) = wheel_modes[i].next(slip[i], WHEEL_BAND_M_S);
                again |= changed && grounded;
                wheel_modes[i] = mode;
            }
            for i in 0..MOTORS {
                let rate = [dot(&JOINTS[i], &end), 0.0];
                let (mode, changed) = gear_modes[i].next(rate, GEAR_BAND_RAD_S);
                again |= changed && joints[i].coulomb_n_m > 0.0;
                gear_modes[i] = mode;
            }
            let forces: [[f64; 2]; 2] = core::array::from_fn(|i| laws[i].force(slip[i]));
            let found = self.share_normal(h, &c, &contacts, push, forces, &change, &u);
            for i in 0..2 {
                // A bound that was wrong matters to a wheel that slides, or had none.
                let bound_matters = wheel_modes[i] != Mode::Stick || normals[i] <= 0.0;
                again |= bound_matters && (found[i] - normals[i]).abs() > 1e-3 * found[i];
                self.wheels[i] = WheelContact {
                    normal_n: found[i],
                    longitudinal_n: forces[i][0],
                    lateral_n: forces[i][1],
                    slip_m_s: slip[i][0],
                    sliding: grounded && found[i] > 0.0 && wheel_modes[i] != Mode::Stick,
                    lifted: found[i] <= 0.0,
                };
            }
            normals = found;
            if !again {
                break;
            }
        }
        self.wheel_modes = wheel_modes;
        self.gear_modes = gear_modes;
        self.finish(h, ground, heading, &change, grounded);
    }

    /// Adds the motors' torques and the viscous dampers.
    fn joint_terms(&self, h: f64, joints: &[JointTorque; MOTORS], a: &mut Symmetric, b: &mut Speeds) {
        let half = 0.5 * h;
        let drive = self.inertia.bearing_damping;
        let viscous = [drive, drive, 0.0];
        let count = if self.inertia.has_camera { MOTORS } else { MOTORS - 1 };
        for i in 0..count {
            let damping = joints[i].damping_n_m_s + viscous[i];
            add_outer(a, &JOINTS[i], half * damping);
            let torque = joints[i].constant_n_m - damping * dot(&JOINTS[i], &self.speed);
            add_scaled(b, &JOINTS[i], h * torque);
        }
        if self.inertia.has_camera {
            let damping = self.inertia.spar_damping;
            add_outer(a, &SPAR_BEARING, half * damping);
            add_scaled(b, &SPAR_BEARING, -h * damping * dot(&SPAR_BEARING, &self.speed));
        }
        if self.chocked {
            for wheel in [RIGHT, LEFT] {
                let row = [(wheel, 1.0)];
                add_outer(a, &row, h * CHOCK_N_M_S);
                add_scaled(b, &row, -h * CHOCK_N_M_S * self.speed[wheel]);
            }
        }
    }

    /// Adds the dry frictions and the normal constraint, linearised about the modes; returns the
    /// wheels' laws.
    #[allow(clippy::too_many_arguments)] // One matrix is assembled from all of these.
    fn dry_terms(
        &self,
        h: f64,
        joints: &[JointTorque; MOTORS],
        contacts: &Contacts,
        grounded: bool,
        (wheel_modes, gear_modes): (&[Mode; 2], &[Mode; MOTORS]),
        normals: [f64; 2],
        secant: bool,
        a: &mut Symmetric,
        b: &mut Speeds,
    ) -> [Linear; 2] {
        let u = &self.speed;
        for i in 0..MOTORS {
            let limit = joints[i].coulomb_n_m;
            if limit > 0.0 {
                let law = if secant {
                    gear_modes[i].secant(limit, GEAR_BAND_RAD_S)
                } else {
                    gear_modes[i].linear(limit, GEAR_BAND_RAD_S)
                };
                add_outer(a, &JOINTS[i], h * law.stiffness[0]);
                let [force, _] = law.force([dot(&JOINTS[i], u), 0.0]);
                add_scaled(b, &JOINTS[i], h * force);
            }
        }
        let mut laws = [Linear::default(); 2];
        if grounded {
            add_outer(a, &contacts.normal, h * NORMAL_N_S_M);
            add_scaled(b, &contacts.normal, -h * NORMAL_N_S_M * dot(&contacts.normal, u));
            for i in 0..2 {
                let limit = contacts.friction[i] * normals[i];
                let law = if secant {
                    wheel_modes[i].secant(limit, WHEEL_BAND_M_S)
                } else {
                    wheel_modes[i].linear(limit, WHEEL_BAND_M_S)
                };
                let [xx, xy, yy] = law.stiffness;
                let roll = &contacts.roll[i];
                add_outer(a, roll, h * xx);
                add_outer(a, &SIDE_SLIP, h * yy);
                for &(index, value) in roll {
                    let (row, column) = if index > SIDE { (index, SIDE) } else { (SIDE, index) };
                    a[row][column] += h * xy * value;
                }
                let [along, across] = law.force([dot(roll, u), dot(&SIDE_SLIP, u)]);
                add_scaled(b, roll, h * along);
                add_scaled(b, &SIDE_SLIP, h * across);
                laws[i] = law;
            }
        }
        laws
    }

    /// Geometry of the contacts at the end of the step, as far as the old speeds foretell it.
    fn contacts(&mut self, h: f64, ground: &Ground, (sin, cos): (f64, f64)) -> Contacts {
        let (u, d, r) = (&self.speed, self.inertia.half_track, self.inertia.radius);
        let x = self.position[FORWARD] + h * (u[FORWARD] * cos - u[SIDE] * sin);
        // Heading at the end, to first order in the turn.
        let reach = d * (sin + 0.5 * h * u[YAW] * cos);
        let wheel_x = [x + reach, x - reach];
        let paths = [ground.wheel(wheel_x[0]), ground.wheel(wheel_x[1])];
        let tangent = [paths[0].slope * cos, paths[1].slope * cos];
        let secant: [f64; 2] = core::array::from_fn(|i| (1.0 + tangent[i] * tangent[i]).sqrt());
        let side = 0.5 * (paths[0].slope + paths[1].slope) * sin;
        self.slope = tangent;
        self.gravity = self.gravity_at(ground, (sin, cos), [paths[0].height_m, paths[1].height_m]);
        let roll = |wheel: usize, sign: f64, i: usize| {
            let cosine = 1.0 / secant[i];
            [
                (FORWARD, cosine),
                (LIFT, tangent[i] * cosine),
                (YAW, sign * d * cosine),
                (wheel, -r),
            ]
        };
        Contacts {
            roll: [roll(RIGHT, 1.0, 0), roll(LEFT, -1.0, 1)],
            normal: [
                (FORWARD, -0.5 * (tangent[0] + tangent[1])),
                (SIDE, side),
                (LIFT, 1.0),
                (YAW, -0.5 * d * (tangent[0] - tangent[1])),
            ],
            friction: [ground.friction_right(wheel_x[0]), ground.friction_left(wheel_x[1])],
            secant,
            height: 0.5 * (paths[0].height_m + paths[1].height_m),
        }
    }

    /// Splits the total normal force `push` between right and left by the roll balance about the axle:
    /// `d (N_l - N_r) + r F_lateral + g_l sum m b = H_1' - yaw H_2 + w p_3 - v_z p_2`.
    #[allow(clippy::too_many_arguments)] // One balance of all of these.
    fn share_normal(
        &self,
        h: f64,
        c: &Configuration,
        contacts: &Contacts,
        push: f64,
        forces: [[f64; 2]; 2],
        change: &Speeds,
        before: &Speeds,
    ) -> [f64; 2] {
        if push <= 0.0 {
            return [0.0; 2];
        }
        let i = &self.inertia;
        let u: Speeds = core::array::from_fn(|k| before[k] + 0.5 * change[k]);
        let (side_rate, yaw_rate) = (change[SIDE] / h, change[YAW] / h);
        let above_rate = c.above_rate(i, &u);
        let yaw = u[YAW];
        // H_1 = -(sum m b w + sum m a b yaw).
        let h1_rate =
            -(above_rate * u[SIDE] + c.above * side_rate + c.product_rate(i, &u) * yaw + c.product * yaw_rate);
        // H_2: spin of the wheels and pitching of the masses, about +y.
        let h2 = i.wheel * (u[RIGHT] + u[LEFT]) + c.above * u[FORWARD] - c.ahead * u[LIFT] - c.pitch_momentum(i, &u);
        let p2 = i.total_mass * u[SIDE] + yaw * c.ahead;
        let p3 = i.total_mass * u[LIFT] + above_rate;
        let lateral = forces[0][1] + forces[1][1];
        let moment =
            h1_rate - yaw * h2 + u[SIDE] * p3 - u[LIFT] * p2 - i.radius * lateral - self.gravity.across * c.above;
        let difference = (moment / i.half_track).clamp(-push, push);
        // A multiplier on the height is the normal force's share along the plane's normal.
        [
            0.5 * (push - difference) * contacts.secant[0],
            0.5 * (push + difference) * contacts.secant[1],
        ]
    }

    // Indices of the speeds, each with a meaning.
    #[allow(clippy::needless_range_loop)]
    /// Moves the positions with the mean of old and new speeds.
    fn finish(&mut self, h: f64, ground: &Ground, (sin, cos): (f64, f64), change: &Speeds, grounded: bool) {
        let mean: Speeds = core::array::from_fn(|i| self.speed[i] + 0.5 * change[i]);
        for i in 0..SPEEDS {
            self.speed[i] += change[i];
            self.acceleration[i] = change[i] / h;
        }
        self.position[FORWARD] += h * (mean[FORWARD] * cos - mean[SIDE] * sin);
        self.position[SIDE] += h * (mean[FORWARD] * sin + mean[SIDE] * cos);
        for index in LIFT..SPEEDS {
            self.position[index] += h * mean[index];
        }
        let reach = self.inertia.half_track * (sin + 0.5 * h * mean[YAW] * cos);
        let x = self.position[FORWARD];
        let height = 0.5 * (ground.wheel(x + reach).height_m + ground.wheel(x - reach).height_m);
        self.in_flight = !grounded;
        if grounded || self.position[LIFT] < height {
            // No drift off the path; a flight never ends below it.
            self.position[LIFT] = height;
        }
    }
}
