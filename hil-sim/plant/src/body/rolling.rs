//! The solution of a substep for a vehicle that rolls on a plane, which is the usual case.
//!
//! The equations are those that [`super::ldl`] solves for any vehicle on any ground. If both wheels stick, the paths
//! do not rise above the plane and no external force acts, most of the matrix is zero, and the normal constraint sets
//! the axle's speed off the plane to 0. This module eliminates the other unknowns by hand: first each wheel, the
//! ballast, the spar and the speed to the left, which couple to few others; then forward speed, yaw rate and arm
//! together.

// The functions of nearly every substep are inlined into one function, so their results stay in registers.
#![allow(clippy::inline_always)]

use model::sample::MOTORS;

use super::contact::{ContactMode, GEAR_BAND_RAD_S, Linear, WHEEL_BAND_M_S};
use super::inertia::Inertia;
use super::joint::{Branch, JointTerm};
use super::ldl::{SPEEDS, Speeds};
use super::motion::Configuration;
use super::paths::Contacts;
use super::step::{NEWTON_MAX, Solution, Substep, joint_rates, middle};
use super::{BALLAST, Body, FORWARD, JointTorque, LEFT, LIFT, PHI, RIGHT, SIDE, SPAR, WheelContact, YAW};

/// The branches if no motor's current passes through a diode.
const LINEAR: [Branch; MOTORS] = [Branch::Linear; MOTORS];

impl Body {
    /// Solves the substep of a vehicle that keeps rolling on a plane; its gearboxes may stick or slide. The result
    /// equals that of the general substep bit for bit. Returns `None` and changes nothing if the vehicle does not
    /// keep rolling.
    #[inline]
    pub(super) fn roll(
        &mut self,
        h: f64,
        (c, contacts): (&Configuration, &Contacts),
        joints: &[JointTorque; MOTORS],
        weights: [f64; MOTORS],
        rates: &[f64; MOTORS],
        foretold: &Speeds,
    ) -> Option<(Speeds, Speeds)> {
        let rolls = self.wheel_modes == [ContactMode::Stick; 2] && !self.in_flight;
        if !rolls || !contacts.level || self.outside.acts {
            return None;
        }
        let linear = |(joint, rate): (&JointTorque, &f64)| joint.branch(*rate) == Branch::Linear;
        if !joints.iter().zip(rates).all(linear) {
            return None;
        }
        let (u, bearing) = (self.speed, self.spar_bearing(h));
        let mut normals = self.wheels.map(|wheel| wheel.normal_n);
        let mut gears = self.gear_modes;
        let mut mean = *foretold;
        for _ in 0..NEWTON_MAX {
            if normals[0] <= 0.0 || normals[1] <= 0.0 {
                return None;
            }
            let substep = Substep {
                h,
                configuration: c,
                contacts,
                joints: self.joint_terms(h, joints, rates, weights, (&LINEAR, &gears), false),
                bearing,
                impulse: c.forces(&self.inertia, &mean, &self.gravity).map(|force| h * force),
            };
            let (change, push, laws) = self.solve_rolling(&substep, normals);
            mean = middle(&u, &change);
            let end: Speeds = core::array::from_fn(|i| u[i] + change[i]);
            let slip = contacts.slips(&end).map(|along| [along, end[SIDE]]);
            let within = |slip: [f64; 2]| ContactMode::of(slip, WHEEL_BAND_M_S) == ContactMode::Stick;
            if !(push > 0.0 && within(slip[0]) && within(slip[1])) {
                return None;
            }
            let end_rates = joint_rates(&end);
            let mut means = [0.0; MOTORS];
            let mut again = false;
            for i in 0..MOTORS {
                let (mode, changed) = gears[i].next(end_rates[i], GEAR_BAND_RAD_S);
                again |= changed && joints[i].coulomb_n_m > 0.0;
                gears[i] = mode;
                means[i] = rates[i] + weights[i] * (end_rates[i] - rates[i]);
                if joints[i].branch(means[i]) != Branch::Linear {
                    return None;
                }
            }
            let forces: [[f64; 2]; 2] = core::array::from_fn(|i| laws[i].force(slip[i]));
            normals = self.share_normal(h, c, contacts, push, forces, &change, &mean);
            if !again {
                self.wheels = core::array::from_fn(|i| WheelContact {
                    normal_n: normals[i],
                    longitudinal_n: forces[i][0],
                    lateral_n: forces[i][1],
                    slip_m_s: slip[i][0],
                    sliding: false,
                    lifted: normals[i] <= 0.0,
                });
                self.gear_modes = gears;
                self.mean_rates = means;
                self.rolled = true;
                return Some((change, mean));
            }
        }
        None
    }

    /// Solves for a vehicle that rolls on a plane, with the normal forces `normals` of the left and the right wheel.
    #[inline(always)]
    pub(super) fn solve_rolling(&self, substep: &Substep<'_>, normals: [f64; 2]) -> Solution {
        let contacts = substep.contacts;
        let laws: [Linear; 2] =
            core::array::from_fn(|i| ContactMode::Stick.linear(contacts.friction[i] * normals[i], WHEEL_BAND_M_S));
        let load = Load {
            impulse: &substep.impulse,
            joints: &substep.joints,
            bearing: substep.bearing,
            grip: laws.map(|law| substep.h * law.stiffness[0]),
            radii: contacts.radii,
        };
        let (change, push) = solve(&self.inertia, substep.configuration, &self.speed, &load);
        (change, push / substep.h, laws)
    }
}

/// The elimination of a wheel from the equations of forward speed, yaw rate and arm.
struct Wheel {
    /// Reciprocal of the wheel's inertia including its damping and stiffness terms.
    inverse: f64,
    /// Coupling with the contact point's speed: grip times radius.
    contact: f64,
    /// Coupling with the arm.
    arm: f64,
    /// The wheel's impulse.
    impulse: f64,
}

impl Wheel {
    /// The wheel's contributions to the equation of the contact point's speed: to the inertia, to the coupling with
    /// the arm, and to the impulse.
    fn on_contact(&self, grip: f64) -> [f64; 3] {
        let share = self.contact * self.inverse;
        [grip - share * self.contact, share * self.arm, share * self.impulse]
    }

    /// The change of the wheel's rate, from the changes of the contact point's speed and of the arm's rate.
    fn change(&self, contact: f64, arm: f64) -> f64 {
        (self.impulse + self.contact * contact - self.arm * arm) * self.inverse
    }
}

/// The loads of a substep, in addition to the masses.
struct Load<'a> {
    /// Impulses of all forces except those of the joints.
    impulse: &'a Speeds,
    /// The motors' joints.
    joints: &'a [JointTerm; 3],
    /// The spar's bearing.
    bearing: JointTerm,
    /// Stiffness of the left and the right wheel's contact on its slip, times the substep.
    grip: [f64; 2],
    /// Radii of the left and the right wheel.
    radii: [f64; 2],
}

/// The changes of the speeds `u`, and the impulse of the ground's normal force.
#[inline(always)]
fn solve(i: &Inertia, c: &Configuration, u: &Speeds, load: &Load<'_>) -> (Speeds, f64) {
    let ([arm_forward, on_spar_forward, ballast_forward], [arm_lift, spar_lift, ballast_lift]) = (c.forward, c.lift);
    let [left_joint, right_joint, ballast_joint] = load.joints;
    let d = i.half_track;
    // The constraint: the axle stays on the plane.
    let lift = -u[LIFT];

    let wheel = |index: usize, side: f64, joint: &JointTerm, rotor: f64, grip: f64, radius: f64| {
        let slip = u[FORWARD] + side * d * u[YAW] - radius * u[index];
        let arm = rotor + joint.damping;
        let contact = grip * radius;
        let wheel = Wheel {
            inverse: 1.0 / (i.wheel + arm + contact * radius),
            contact,
            arm,
            impulse: joint.impulse + contact * slip,
        };
        (wheel, grip * slip)
    };
    let ([rotor_left, rotor_right], [grip_left, grip_right]) = (i.rotor, load.grip);
    let [radius_left, radius_right] = load.radii;
    let (right, held_right) = wheel(RIGHT, 1.0, right_joint, rotor_right, grip_right, radius_right);
    let (left, held_left) = wheel(LEFT, -1.0, left_joint, rotor_left, grip_left, radius_left);
    let [inertia_right, arm_right, impulse_right] = right.on_contact(grip_right);
    let [inertia_left, arm_left, impulse_left] = left.on_contact(grip_left);

    // Forward, yaw, arm: the lower triangle of their matrix, and their impulses.
    let mut forward2 = i.total_mass + inertia_right + inertia_left;
    let yaw_forward = d * (inertia_right - inertia_left);
    let mut yaw2 = i.yaw + c.ahead2 + d * d * (inertia_right + inertia_left);
    let mut arm_forward = arm_forward + arm_right + arm_left;
    let arm_yaw = d * (arm_right - arm_left);
    let mut arm2 = i.arm_second + right.arm - right.arm * right.arm * right.inverse + left.arm
        - left.arm * left.arm * left.inverse;
    let mut forward = load.impulse[FORWARD] - held_right - held_left + impulse_right + impulse_left;
    let mut yaw = load.impulse[YAW] + d * (held_left - held_right + impulse_right - impulse_left);
    let mut arm = load.impulse[PHI] + left_joint.impulse + right_joint.impulse
        - right.arm * right.impulse * right.inverse
        - left.arm * left.impulse * left.inverse
        - arm_lift * lift;

    // The ballast from spar and forward, the spar from forward and arm.
    let (mut ballast, mut spar) = (0.0, 0.0);
    let (mut ballast_inverse, mut spar_inverse) = (1.0, 1.0);
    let (mut spar_ballast, mut spar_forward) = (0.0, 0.0);
    if i.has_spar {
        ballast_inverse = 1.0 / (i.ballast_second + i.ballast_rotor + ballast_joint.damping);
        spar_ballast = c.spar_ballast() - i.ballast_rotor - ballast_joint.damping;
        ballast = load.impulse[BALLAST] + ballast_joint.impulse - ballast_lift * lift;
        let (on_spar, on_forward) = (spar_ballast * ballast_inverse, ballast_forward * ballast_inverse);
        forward2 -= on_forward * ballast_forward;
        forward -= on_forward * ballast;
        spar_forward = on_spar_forward - on_spar * ballast_forward;
        spar_inverse = 1.0
            / (i.spar_second + i.ballast_rotor + ballast_joint.damping + load.bearing.damping - on_spar * spar_ballast);
        spar = load.impulse[SPAR] - ballast_joint.impulse + load.bearing.impulse - spar_lift * lift - on_spar * ballast;
        let (on_forward, on_arm) = (spar_forward * spar_inverse, -load.bearing.damping * spar_inverse);
        forward2 -= on_forward * spar_forward;
        arm_forward -= on_arm * spar_forward;
        arm2 += load.bearing.damping + on_arm * load.bearing.damping;
        forward -= on_forward * spar;
        arm -= load.bearing.impulse + on_arm * spar;
    }

    // The speed to the left from the yaw rate.
    let side_inverse = 1.0 / (i.total_mass + grip_right + grip_left);
    let side = load.impulse[SIDE] - (grip_right + grip_left) * u[SIDE];
    let on_yaw = c.ahead * side_inverse;
    yaw2 -= on_yaw * c.ahead;
    yaw -= on_yaw * side;

    // Forward from yaw and arm, yaw from the arm.
    let forward_inverse = 1.0 / forward2;
    let (on_yaw, on_arm) = (yaw_forward * forward_inverse, arm_forward * forward_inverse);
    yaw2 -= on_yaw * yaw_forward;
    let arm_yaw = arm_yaw - on_arm * yaw_forward;
    arm2 -= on_arm * arm_forward;
    yaw -= on_yaw * forward;
    arm -= on_arm * forward;
    let yaw_inverse = 1.0 / yaw2;
    let on_arm = arm_yaw * yaw_inverse;
    arm2 -= on_arm * arm_yaw;
    arm -= on_arm * yaw;

    // Back substitution.
    let mut x = [0.0; SPEEDS];
    x[PHI] = arm / arm2;
    x[YAW] = (yaw - arm_yaw * x[PHI]) * yaw_inverse;
    x[FORWARD] = (forward - yaw_forward * x[YAW] - arm_forward * x[PHI]) * forward_inverse;
    x[SIDE] = (side - c.ahead * x[YAW]) * side_inverse;
    x[SPAR] = (spar - spar_forward * x[FORWARD] + load.bearing.damping * x[PHI]) * spar_inverse;
    x[BALLAST] = (ballast - spar_ballast * x[SPAR] - ballast_forward * x[FORWARD]) * ballast_inverse;
    x[RIGHT] = right.change(x[FORWARD] + d * x[YAW], x[PHI]);
    x[LEFT] = left.change(x[FORWARD] - d * x[YAW], x[PHI]);
    x[LIFT] = lift;
    let push =
        i.total_mass * lift + arm_lift * x[PHI] + spar_lift * x[SPAR] + ballast_lift * x[BALLAST] - load.impulse[LIFT];
    (x, push)
}
