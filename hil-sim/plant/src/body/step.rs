//! One substep: assembles the equations, solves for the change of the speeds, finds which contacts stick and
//! which slide, and moves the bodies.
//!
//! The scheme is described in [`super`].

use model::real::Real;
use model::sample::MOTORS;

use super::contact::{ContactMode, GEAR_BAND_RAD_S, Linear, WHEEL_BAND_M_S};
use super::joint::Branch;
use super::ldl::{Factored, SPEEDS, Speeds, Symmetric, add_outer, add_scaled, dot};
use super::motion::Configuration;
use super::{ANGLES, Body, FORWARD, JOINTS, JointTorque, LEFT, LIFT, PHI, RIGHT, SIDE, SPAR, WheelContact, YAW};
use crate::terrain::Ground;

/// Stiffness of the normal constraint on the end-of-step speed, in N s/m: 13 kg sink 0.1 um/s.
const NORMAL_N_S_M: f64 = 1e9;
/// Newton iterations after which the secant takes over, and at most.
const NEWTON_MAX: usize = 6;
const ITERATIONS_MAX: usize = 16;

const SPAR_BEARING: [(usize, f64); 2] = [(SPAR, 1.0), (PHI, -1.0)];
const SIDE_SLIP: [(usize, f64); 1] = [(SIDE, 1.0)];

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

/// Weight of the end of the step in a damper's mean rate: the middle, second order, as long as the damper
/// cannot stop its `inertia` within the step; beyond that the trapezoidal rule would ring, so the end.
fn end_weight(impulse_per_rate: f64, inertia: f64) -> f64 {
    if impulse_per_rate < inertia { 0.5 } else { 1.0 }
}

impl Body {
    /// Advances by `h` seconds under the motors' `joints`.
    pub fn step(&mut self, h: f64, ground: &Ground, joints: &[JointTorque; MOTORS]) {
        let weights = self.joint_weights(h, joints);
        self.step_weighted(h, ground, joints, weights);
    }

    /// As [`Body::step`], with each joint's mean rate this far into the substep.
    pub(crate) fn step_weighted(
        &mut self,
        h: f64,
        ground: &Ground,
        joints: &[JointTorque; MOTORS],
        weights: [f64; MOTORS],
    ) {
        let u = self.speed;
        let half = 0.5 * h;
        let mut middle = self.position;
        for index in ANGLES {
            middle[index] += half * u[index];
        }
        let heading = Real::sin_cos(middle[YAW]);
        let c = Configuration::new(&self.inertia, &middle);
        self.middle = [(middle[PHI], c.arm), (middle[SPAR], c.spar)];
        let contacts = self.contacts(h, ground, heading);

        let mut branches: [Branch; MOTORS] = core::array::from_fn(|i| joints[i].branch(dot(&JOINTS[i], &u)));
        let predicted = self.position[LIFT] + h * u[LIFT];
        let mut grounded = !self.in_flight || predicted <= contacts.height;
        let mut wheel_modes = self.wheel_modes;
        let mut gear_modes = self.gear_modes;
        let mut normals = [self.wheels[0].normal_n, self.wheels[1].normal_n];
        let mut change = [0.0; SPEEDS];
        for iteration in 0..ITERATIONS_MAX {
            let mut a = c.mass(&self.inertia);
            let mut b = [0.0; SPEEDS];
            self.smooth_terms(h, joints, branches, weights, (&mut a, &mut b));
            if self.outside.acts {
                self.act(h, &c, &mut a, &mut b);
            }
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
            let factored = Factored::new(&mut a);
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
                // The ground cannot pull: solve again without the normal constraint.
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
                let (start, rate) = (dot(&JOINTS[i], &u), dot(&JOINTS[i], &end));
                let (mode, changed) = gear_modes[i].next([rate, 0.0], GEAR_BAND_RAD_S);
                again |= changed && joints[i].coulomb_n_m > 0.0;
                gear_modes[i] = mode;
                self.mean_rates[i] = start + weights[i] * (rate - start);
                let branch = joints[i].next_branch(branches[i], self.mean_rates[i]);
                again |= branch != branches[i];
                branches[i] = branch;
            }
            let forces: [[f64; 2]; 2] = core::array::from_fn(|i| laws[i].force(slip[i]));
            let found = self.share_normal(h, &c, &contacts, push, forces, &change, &u);
            for i in 0..2 {
                // A bound that was wrong matters to a wheel that slides, or had none.
                let bound_matters = wheel_modes[i] != ContactMode::Stick || normals[i] <= 0.0;
                again |= bound_matters && (found[i] - normals[i]).abs() > 1e-3 * found[i];
                self.wheels[i] = WheelContact {
                    normal_n: found[i],
                    longitudinal_n: forces[i][0],
                    lateral_n: forces[i][1],
                    slip_m_s: slip[i][0],
                    sliding: grounded && found[i] > 0.0 && wheel_modes[i] != ContactMode::Stick,
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

    /// Viscous damping of each motor's joint that is not the motor's.
    fn viscous(&self) -> [f64; MOTORS] {
        let drive = self.inertia.bearing_damping;
        [drive, drive, 0.0]
    }

    /// How far into the substep each joint's mean rate lies.
    pub(crate) fn joint_weights(&self, h: f64, joints: &[JointTorque; MOTORS]) -> [f64; MOTORS] {
        let [left, right] = self.inertia.rotor.map(|rotor| self.inertia.wheel + rotor);
        let inertias = [left, right, self.inertia.ballast_second + self.inertia.ballast_rotor];
        let viscous = self.viscous();
        core::array::from_fn(|i| end_weight(h * (joints[i].damping_n_m_s + viscous[i]), inertias[i]))
    }

    /// Adds the motors' torques and the viscous dampers.
    #[inline]
    fn smooth_terms(
        &self,
        h: f64,
        joints: &[JointTorque; MOTORS],
        branches: [Branch; MOTORS],
        weights: [f64; MOTORS],
        (a, b): (&mut Symmetric, &mut Speeds),
    ) {
        let viscous = self.viscous();
        let count = if self.inertia.has_spar { MOTORS } else { MOTORS - 1 };
        for i in 0..count {
            let (constant, damping) = joints[i].on(branches[i]);
            let damping = damping + viscous[i];
            add_outer(a, &JOINTS[i], weights[i] * h * damping);
            let torque = constant - damping * dot(&JOINTS[i], &self.speed);
            add_scaled(b, &JOINTS[i], h * torque);
        }
        if self.inertia.has_spar {
            let damping = self.inertia.spar_damping;
            let weight = end_weight(h * damping, self.inertia.spar_second);
            add_outer(a, &SPAR_BEARING, weight * h * damping);
            add_scaled(b, &SPAR_BEARING, -h * damping * dot(&SPAR_BEARING, &self.speed));
        }
    }

    /// Adds the dry frictions and the normal constraint, linearised about the modes; returns the
    /// wheels' laws.
    #[allow(clippy::too_many_arguments)] // One matrix is assembled from all of these.
    #[inline]
    fn dry_terms(
        &self,
        h: f64,
        joints: &[JointTorque; MOTORS],
        contacts: &Contacts,
        grounded: bool,
        (wheel_modes, gear_modes): (&[ContactMode; 2], &[ContactMode; MOTORS]),
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
        let (u, d) = (&self.speed, self.inertia.half_track);
        let half_difference = 0.5 * self.inertia.radius_difference;
        let radii = [
            self.inertia.radius - half_difference,
            self.inertia.radius + half_difference,
        ];
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
                (wheel, -radii[i]),
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
        let moment = h1_rate - yaw * h2 + u[SIDE] * p3
            - u[LIFT] * p2
            - i.radius * lateral
            - self.gravity.across * c.above
            - self.outside.roll_n_m;
        // Not `clamp`, which panics on what is not a number; validity is judged after the step.
        let difference = (moment / i.half_track).max(-push).min(push);
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
        self.position[LIFT] += h * mean[LIFT];
        for index in ANGLES {
            self.position[index] += h * mean[index];
        }
        let reach = self.inertia.half_track * (sin + 0.5 * h * mean[YAW] * cos);
        let x = self.position[FORWARD];
        let height = 0.5 * (ground.wheel(x + reach).height_m + ground.wheel(x - reach).height_m);
        self.in_flight = !grounded;
        if grounded || self.position[LIFT] < height {
            // The axle does not drift off its path, and a flight never ends below the path.
            self.position[LIFT] = height;
        }
    }
}
