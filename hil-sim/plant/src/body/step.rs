//! One substep: assembles the equations, solves for the change of the speeds, determines which contacts stick and
//! which slide, and moves the bodies.
//!
//! The scheme is described in [`super`].

// The functions of nearly every substep are inlined into one function, so their results stay in registers.
#![allow(clippy::inline_always)]

use model::sample::MOTORS;

use super::contact::{ContactMode, GEAR_BAND_RAD_S, GearMode, Linear, WHEEL_BAND_M_S};
use super::joint::{Branch, JointTerm};
use super::ldl::{Factored, SPEEDS, Speeds, Symmetric, add_outer, add_scaled, dot};
use super::motion::Configuration;
use super::paths::Contacts;
use super::{
    ANGLES, BALLAST, Body, FORWARD, JOINTS, JointTorque, LEFT, LIFT, PHI, RIGHT, SIDE, SPAR, WheelContact, YAW,
};
use crate::terrain::Ground;

/// Stiffness of the normal constraint on the end-of-step speed, in N s/m: 13 kg sink by 0.1 um/s.
const NORMAL_N_S_M: f64 = 1e9;
/// Number of Newton iterations after which the secant takes over, and largest number of iterations.
pub(super) const NEWTON_MAX: usize = 6;
const ITERATIONS_MAX: usize = 16;

const SPAR_BEARING: [(usize, f64); 2] = [(SPAR, 1.0), (PHI, -1.0)];

/// The rates of the motors' joints at the speeds `u`.
#[inline]
pub(super) fn joint_rates(u: &Speeds) -> [f64; MOTORS] {
    JOINTS.map(|row| dot(&row, u))
}

/// The speeds in the middle of a substep that changes `u` by `change`: their means.
#[inline]
pub(super) fn middle(u: &Speeds, change: &Speeds) -> Speeds {
    core::array::from_fn(|i| u[i] + 0.5 * change[i])
}

/// Weight of the end of the step in a damper's mean rate. The weight of the middle (second order) is used as long
/// as the damper cannot stop its `inertia` within the step. A stronger damper would make the trapezoidal rule
/// ring, so its weight is that of the end.
fn end_weight(impulse_per_rate: f64, inertia: f64) -> f64 {
    if impulse_per_rate < inertia { 0.5 } else { 1.0 }
}

/// The assumptions of a substep, which are revised until the solution agrees with them.
#[derive(Clone, Copy)]
struct Assumed {
    grounded: bool,
    wheels: [ContactMode; 2],
    gears: [GearMode; MOTORS],
    branches: [Branch; MOTORS],
    normals: [f64; 2],
}

/// The input of a substep's solution.
pub(super) struct Substep<'a> {
    pub(super) h: f64,
    pub(super) configuration: &'a Configuration,
    pub(super) contacts: &'a Contacts,
    pub(super) joints: [JointTerm; MOTORS],
    pub(super) bearing: JointTerm,
    /// Impulses of all forces except those of the joints.
    pub(super) impulse: Speeds,
}

/// A solution: the changes of the speeds, the total normal force, the laws of the wheels' contacts.
pub(super) type Solution = (Speeds, f64, [Linear; 2]);

impl Body {
    /// Advances by `h` seconds under the motors' `joints`.
    pub fn step(&mut self, h: f64, ground: &Ground, joints: &[JointTorque; MOTORS]) {
        let weights = self.joint_weights(h, joints);
        self.step_weighted(h, ground, joints, weights);
    }

    /// As [`Body::step`], with each joint's mean rate at this share of the substep.
    pub(crate) fn step_weighted(
        &mut self,
        h: f64,
        ground: &Ground,
        joints: &[JointTorque; MOTORS],
        weights: [f64; MOTORS],
    ) {
        let u = self.speed;
        let half = 0.5 * h;
        let angle = |index: usize| self.position[index] + half * u[index];
        let arm = angle(PHI) + self.inertia.arm_offset;
        self.middle = self.middle.to([arm, angle(SPAR), angle(BALLAST), angle(YAW)]);
        let [arm, spar, ballast, heading] = self.middle.sin_cos();
        let c = Configuration::new(&self.inertia, [arm, spar, ballast]);
        let contacts = self.contacts(h, ground, heading);

        let rates = joint_rates(&u);
        // The forces are evaluated at the mean speeds, predicted from the change in the previous substep.
        let foretold = middle(&u, &core::array::from_fn(|i| h * self.acceleration[i]));
        let rolled = self.roll(h, (&c, &contacts), joints, weights, &rates, &foretold);
        let (change, mean, grounded) = match rolled {
            Some((change, mean)) => (change, mean, true),
            None => self.find_contacts(h, (&c, &contacts), joints, weights, &rates, &foretold),
        };
        self.finish(h, ground, heading, (&change, &mean), grounded);
    }

    /// The changes of the speeds for any vehicle on any ground, their means, and whether the axle is on the
    /// ground.
    // Not inlined: nearly every substep takes the path of a rolling vehicle.
    #[inline(never)]
    fn find_contacts(
        &mut self,
        h: f64,
        (c, contacts): (&Configuration, &Contacts),
        joints: &[JointTorque; MOTORS],
        weights: [f64; MOTORS],
        rates: &[f64; MOTORS],
        foretold: &Speeds,
    ) -> (Speeds, Speeds, bool) {
        let u = self.speed;
        let (mut change, mut mean) = ([0.0; SPEEDS], *foretold);
        self.rolled = false;
        let predicted = self.position[LIFT] + h * u[LIFT];
        let mut assumed = Assumed {
            grounded: !self.in_flight || predicted <= contacts.height,
            wheels: self.wheel_modes,
            gears: self.gear_modes,
            branches: core::array::from_fn(|i| joints[i].branch(rates[i])),
            normals: [self.wheels[0].normal_n, self.wheels[1].normal_n],
        };
        for iteration in 0..ITERATIONS_MAX {
            let secant = iteration >= NEWTON_MAX;
            let substep = Substep {
                h,
                configuration: c,
                contacts,
                joints: self.joint_terms(h, joints, rates, weights, (&assumed.branches, &assumed.gears), secant),
                bearing: self.spar_bearing(h),
                impulse: c.forces(&self.inertia, &mean, &self.gravity).map(|force| h * force),
            };
            let sticks = assumed.grounded && assumed.wheels == [ContactMode::Stick; 2];
            let rolls = sticks && contacts.level && !self.outside.acts;
            let (found_change, push, laws) = if rolls {
                self.solve_rolling(&substep, assumed.normals)
            } else {
                self.solve(&substep, &assumed, secant)
            };
            change = found_change;
            mean = middle(&u, &change);
            if push < 0.0 {
                // The ground cannot pull: solve again without the normal constraint.
                assumed.grounded = false;
                continue;
            }
            let end: Speeds = core::array::from_fn(|i| u[i] + change[i]);
            let mut again = false;
            let slip = contacts.slips(&end).map(|along| [along, end[SIDE]]);
            for (wheel, slip) in assumed.wheels.iter_mut().zip(slip) {
                let (mode, changed) = wheel.next(slip, WHEEL_BAND_M_S);
                again |= changed && assumed.grounded;
                *wheel = mode;
            }
            let end_rates = joint_rates(&end);
            for i in 0..MOTORS {
                let (mode, changed) = assumed.gears[i].next(end_rates[i], GEAR_BAND_RAD_S);
                again |= changed && joints[i].coulomb_n_m > 0.0;
                assumed.gears[i] = mode;
                self.mean_rates[i] = rates[i] + weights[i] * (end_rates[i] - rates[i]);
                let branch = joints[i].next_branch(assumed.branches[i], self.mean_rates[i]);
                again |= branch != assumed.branches[i];
                assumed.branches[i] = branch;
            }
            let forces: [[f64; 2]; 2] = core::array::from_fn(|i| laws[i].force(slip[i]));
            let found = self.share_normal(h, c, contacts, push, forces, &change, &mean);
            for i in 0..2 {
                // A wrong friction bound matters only to a wheel that slides or that had no bound.
                let slides = assumed.wheels[i] != ContactMode::Stick;
                let bound_matters = slides || assumed.normals[i] <= 0.0;
                again |= bound_matters && (found[i] - assumed.normals[i]).abs() > 1e-3 * found[i];
                self.wheels[i] = WheelContact {
                    normal_n: found[i],
                    longitudinal_n: forces[i][0],
                    lateral_n: forces[i][1],
                    slip_m_s: slip[i][0],
                    sliding: assumed.grounded && found[i] > 0.0 && slides,
                    lifted: found[i] <= 0.0,
                };
            }
            assumed.normals = found;
            if !again {
                self.rolled = rolls;
                break;
            }
        }
        self.wheel_modes = assumed.wheels;
        self.gear_modes = assumed.gears;
        (change, mean, assumed.grounded)
    }

    /// Viscous damping of each motor's joint, without the motor's own damping.
    pub(super) fn viscous(&self) -> [f64; MOTORS] {
        let drive = self.inertia.bearing_damping;
        [drive, drive, 0.0]
    }

    /// Share of the substep at which each joint's mean rate is taken.
    pub(crate) fn joint_weights(&self, h: f64, joints: &[JointTorque; MOTORS]) -> [f64; MOTORS] {
        let [left, right] = self.inertia.rotor.map(|rotor| self.inertia.wheel + rotor);
        let inertias = [left, right, self.inertia.ballast_second + self.inertia.ballast_rotor];
        let viscous = self.viscous();
        core::array::from_fn(|i| end_weight(h * (joints[i].damping_n_m_s + viscous[i]), inertias[i]))
    }

    /// The motors' joints in a substep: torques, viscous and dry friction, linearised about the assumed modes.
    #[inline]
    pub(super) fn joint_terms(
        &self,
        h: f64,
        joints: &[JointTorque; MOTORS],
        rates: &[f64; MOTORS],
        weights: [f64; MOTORS],
        (branches, gears): (&[Branch; MOTORS], &[GearMode; MOTORS]),
        secant: bool,
    ) -> [JointTerm; MOTORS] {
        let viscous = self.viscous();
        let mut terms = [JointTerm::default(); MOTORS];
        let count = if self.inertia.has_spar { MOTORS } else { MOTORS - 1 };
        for (i, term) in terms.iter_mut().enumerate().take(count) {
            let (constant, damping) = joints[i].on(branches[i]);
            let dry = gears[i].linear(joints[i].coulomb_n_m, GEAR_BAND_RAD_S, secant);
            *term = JointTerm::new(h, (constant, damping + viscous[i]), dry, rates[i], weights[i]);
        }
        terms
    }

    /// The spar's bearing in a substep.
    pub(super) fn spar_bearing(&self, h: f64) -> JointTerm {
        let damping = h * self.inertia.spar_damping;
        let weight = end_weight(damping, self.inertia.spar_second);
        JointTerm {
            impulse: -damping * dot(&SPAR_BEARING, &self.speed),
            damping: weight * damping,
        }
    }

    /// Solves for any vehicle on any ground.
    fn solve(&mut self, substep: &Substep<'_>, assumed: &Assumed, secant: bool) -> Solution {
        let mut a = substep.configuration.mass(&self.inertia);
        let mut b = substep.impulse;
        for (row, term) in JOINTS.iter().zip(&substep.joints) {
            add_outer(&mut a, row, term.damping);
            add_scaled(&mut b, row, term.impulse);
        }
        add_outer(&mut a, &SPAR_BEARING, substep.bearing.damping);
        add_scaled(&mut b, &SPAR_BEARING, substep.bearing.impulse);
        if self.outside.acts {
            self.act(substep.h, substep.configuration, &mut a, &mut b);
        }
        let laws = self.ground_terms(substep, assumed, secant, (&mut a, &mut b));
        let change = Factored::new(&mut a).solve(b);
        let push = if assumed.grounded {
            let normal = substep.contacts.normal();
            -NORMAL_N_S_M * (dot(&normal, &self.speed) + dot(&normal, &change))
        } else {
            0.0
        };
        (change, push, laws)
    }

    /// Adds the normal constraint and the wheels' friction, linearised about the modes; returns the wheels' laws.
    #[inline]
    fn ground_terms(
        &self,
        substep: &Substep<'_>,
        assumed: &Assumed,
        secant: bool,
        (a, b): (&mut Symmetric, &mut Speeds),
    ) -> [Linear; 2] {
        let (h, contacts, u) = (substep.h, substep.contacts, &self.speed);
        let mut laws = [Linear::default(); 2];
        if assumed.grounded {
            let normal = contacts.normal();
            add_outer(a, &normal, h * NORMAL_N_S_M);
            add_scaled(b, &normal, -h * NORMAL_N_S_M * dot(&normal, u));
            // The right wheel is summed first, as `rolling` does: to the bit the same.
            for (i, found) in laws.iter_mut().enumerate().rev() {
                let limit = contacts.friction[i] * assumed.normals[i];
                let law = if secant {
                    assumed.wheels[i].secant(limit, WHEEL_BAND_M_S)
                } else {
                    assumed.wheels[i].linear(limit, WHEEL_BAND_M_S)
                };
                let [xx, xy, yy] = law.stiffness;
                let roll = &contacts.roll(i);
                add_outer(a, roll, h * xx);
                a[SIDE][SIDE] += h * yy;
                for &(index, value) in roll {
                    let (row, column) = if index > SIDE { (index, SIDE) } else { (SIDE, index) };
                    a[row][column] += h * xy * value;
                }
                let [along, across] = law.force([dot(roll, u), u[SIDE]]);
                add_scaled(b, roll, h * along);
                b[SIDE] += h * across;
                *found = law;
            }
        }
        laws
    }

    /// Splits the total normal force `push` between left and right by the roll balance about the axle:
    /// `d (N_l - N_r) + r F_lateral + g_l sum m b = H_1' - yaw H_2 + w p_3 - v_z p_2`.
    #[allow(clippy::too_many_arguments)] // One balance of all of these.
    #[inline(always)]
    pub(super) fn share_normal(
        &self,
        h: f64,
        c: &Configuration,
        contacts: &Contacts,
        push: f64,
        forces: [[f64; 2]; 2],
        change: &Speeds,
        u: &Speeds,
    ) -> [f64; 2] {
        if push <= 0.0 {
            return [0.0; 2];
        }
        let i = &self.inertia;
        let (side_rate, yaw_rate) = (change[SIDE] / h, change[YAW] / h);
        let above_rate = c.above_rate(u);
        let yaw = u[YAW];
        // H_1 = -(sum m b w + sum m a b yaw).
        let h1_rate = -(above_rate * u[SIDE] + c.above * side_rate + c.product_rate(i, u) * yaw + c.product * yaw_rate);
        // H_2: spin of the wheels and pitching of the masses, about +y.
        let h2 = i.wheel * (u[RIGHT] + u[LEFT]) + c.above * u[FORWARD] - c.ahead * u[LIFT] - c.pitch_momentum(i, u);
        let p2 = i.total_mass * u[SIDE] + yaw * c.ahead;
        let p3 = i.total_mass * u[LIFT] + above_rate;
        let lateral = forces[0][1] + forces[1][1];
        let moment = h1_rate - yaw * h2 + u[SIDE] * p3
            - u[LIFT] * p2
            - i.radius * lateral
            - self.gravity.across * c.above
            - self.outside.roll_n_m;
        // Not `clamp`, which panics on NaN; validity is checked after the step.
        let difference = (moment / i.half_track).max(-push).min(push);
        // The multiplier of the height constraint is the normal force's component along the plane's normal.
        [
            0.5 * (push + difference) * contacts.secant[0],
            0.5 * (push - difference) * contacts.secant[1],
        ]
    }

    // Indices of the speeds, each with a meaning.
    #[allow(clippy::needless_range_loop)]
    /// Moves the positions with the mean of old and new speeds.
    fn finish(
        &mut self,
        h: f64,
        ground: &Ground,
        (sin, cos): (f64, f64),
        (change, mean): (&Speeds, &Speeds),
        grounded: bool,
    ) {
        let frequency = 1.0 / h;
        for i in 0..SPEEDS {
            self.speed[i] += change[i];
            self.acceleration[i] = change[i] * frequency;
        }
        self.mean_speed = *mean;
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
            // Keeps the axle on its path and ends a flight at the path, not below it.
            self.position[LIFT] = height;
        }
    }
}
