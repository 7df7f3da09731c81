//! A gearbox with play and stiffness: the rotor turns by itself, and drives the joint through its teeth.
//!
//! Angles, rates and inertias are at the gearbox output and relative to the arm, as the joint's are. With
//! rotor angle rho, joint angle j and twist s = rho - j, the teeth carry
//!
//! ```text
//! T = k (s - b/2) + d s'   while s > b/2 and T > 0,
//! T = k (s + b/2) + d s'   while s < -b/2 and T < 0,   else 0
//! ```
//!
//! and the rotor obeys `J rho'' = T_motor - T`, whose J is the n^2 J_rotor that a rigid gearbox adds to the
//! joint. Friction stays at the output, where the vehicle file has it.
//!
//! # Step
//! The motor's law is linear in the rotor's rate, the teeth's law on one flank linear in both, so the
//! rotor's rate at the end of the substep can be eliminated: what is left is a torque on the joint that is
//! linear in the joint's rate, which the body solves with everything else. The teeth act with the twist
//! and its rate at the middle of the substep (energy is kept), at its end where they are too stiff to be
//! resolved (unconditionally stable). Which flank touches is found with the body's answer, in a few
//! repetitions of the substep.

use model::sample::MOTORS;

use crate::body::{Body, JointTorque};
use crate::terrain::Ground;

/// Largest number of repetitions of a substep; two flanks on two sides have nine states.
const REPETITIONS_MAX: usize = 10;
/// Smallest inertia of a rotor, in kg m^2 at the output: a rotor without any would have no equation.
const ROTOR_MIN_KG_M2: f64 = 1e-6;
/// Geared joints: the drives, left and right.
pub(crate) const GEARS: usize = 2;

/// How the teeth touch.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Flank {
    /// Not at all.
    Free,
    /// The rotor drives forward.
    Forward,
    /// The rotor drives backward.
    Backward,
}

impl Flank {
    fn sign(self) -> f64 {
        match self {
            Self::Free => 0.0,
            Self::Forward => 1.0,
            Self::Backward => -1.0,
        }
    }
}

/// What the motor does within a substep: its linear law, or the torque at a limit.
type MotorLaw = Option<f64>;

/// One gearbox and its rotor.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Gear {
    half_backlash: f64,
    stiffness: f64,
    damping: f64,
    /// Rotor inertia at the output.
    rotor: f64,
    /// Of the wheel at least: what the teeth move on the other side.
    joint: f64,
    angle: f64,
    rate: f64,
    mean_rate: f64,
    flank: Flank,
    held: MotorLaw,
}

/// A substep's elimination: the rotor gains `free + follow * y` of rate when the joint gains y, and the
/// teeth carry `torque - slope * y`.
#[derive(Debug, Clone, Copy, Default)]
struct Eliminated {
    free: f64,
    follow: f64,
    torque: f64,
    slope: f64,
}

impl Gear {
    /// A gearbox in the middle of its play, at rest, at the joint's angle.
    pub(crate) fn new(
        backlash_rad: f64,
        stiffness: f64,
        damping: f64,
        (rotor, joint): (f64, f64),
        joint_angle: f64,
    ) -> Self {
        Self {
            half_backlash: 0.5 * backlash_rad,
            stiffness,
            damping,
            rotor: rotor.max(ROTOR_MIN_KG_M2),
            joint,
            angle: joint_angle,
            rate: 0.0,
            mean_rate: 0.0,
            flank: Flank::Free,
            held: None,
        }
    }

    /// Angle of the rotor, at the output.
    pub(crate) fn angle(&self) -> f64 {
        self.angle
    }

    /// Rate of the rotor, at the output.
    pub(crate) fn rate(&self) -> f64 {
        self.rate
    }

    /// Its mean over the last substep, as the motor felt it.
    pub(crate) fn mean_rate(&self) -> f64 {
        self.mean_rate
    }

    /// How far into the substep teeth and motor act: in its middle, or at its end where they are stiff.
    fn weights(&self, h: f64, motor: &JointTorque) -> (f64, f64) {
        let reduced = self.rotor * self.joint / (self.rotor + self.joint);
        let teeth = if h * (h * self.stiffness + self.damping) < reduced {
            0.5
        } else {
            1.0
        };
        let drive = if h * motor.damping_n_m_s < self.rotor { 0.5 } else { 1.0 };
        (teeth, drive)
    }

    /// Eliminates the rotor of a joint at `angle` and `rate`.
    fn eliminate(&self, h: f64, motor: &JointTorque, (angle, rate): (f64, f64)) -> Eliminated {
        let (teeth, drive) = self.weights(h, motor);
        let (constant, damping) = match self.held {
            None => (motor.constant_n_m, motor.damping_n_m_s),
            Some(torque) => (torque, 0.0),
        };
        let driven = constant - damping * self.rate;
        let inertia = self.rotor + h * drive * damping;
        if self.flank == Flank::Free {
            return Eliminated {
                free: h * driven / inertia,
                ..Eliminated::default()
            };
        }
        let slip = self.rate - rate;
        let twist = self.angle - angle + teeth * h * slip - self.flank.sign() * self.half_backlash;
        let start = self.stiffness * twist + self.damping * slip;
        let slope = teeth * (0.5 * h * self.stiffness + self.damping);
        let inertia = inertia + h * slope;
        let (free, follow) = (h * (driven - start) / inertia, h * slope / inertia);
        Eliminated {
            free,
            follow,
            torque: start + slope * free,
            slope: slope * (1.0 - follow),
        }
    }

    /// Whether the body's answer, a joint that gained `y` of rate, agrees with the flank and the motor's
    /// branch assumed; takes on those it asks for.
    fn agrees(&mut self, h: f64, motor: &JointTorque, joint: (f64, f64), y: f64) -> bool {
        let (teeth, drive) = self.weights(h, motor);
        let e = self.eliminate(h, motor, joint);
        let x = e.free + e.follow * y;
        let slip = self.rate - joint.1;
        let twist = self.angle - joint.0 + teeth * h * (slip + 0.5 * (x - y));
        let twisting = slip + teeth * (x - y);
        let carries = |sign: f64| {
            let torque = self.stiffness * (twist - sign * self.half_backlash) + self.damping * twisting;
            sign * twist > self.half_backlash && sign * torque > 0.0
        };
        let flank = if carries(1.0) {
            Flank::Forward
        } else if carries(-1.0) {
            Flank::Backward
        } else {
            Flank::Free
        };
        let torque = motor.constant_n_m - motor.damping_n_m_s * (self.rate + drive * x);
        let held = (torque.abs() > motor.limit_n_m).then(|| motor.limit_n_m.copysign(torque));
        let agrees = flank == self.flank && held == self.held;
        // From one limit past the other lies the linear law.
        self.held = if matches!((self.held, held), (Some(a), Some(b)) if a != b) {
            None
        } else {
            held
        };
        self.flank = flank;
        agrees
    }

    /// Moves the rotor by the substep whose joint gained `y`.
    fn finish(&mut self, h: f64, motor: &JointTorque, joint: (f64, f64), y: f64) {
        let (_, drive) = self.weights(h, motor);
        let e = self.eliminate(h, motor, joint);
        let x = e.free + e.follow * y;
        self.mean_rate = self.rate + drive * x;
        self.angle += h * (self.rate + 0.5 * x);
        self.rate += x;
    }
}

/// Puts the rotors' rates in place of the joints'.
pub(crate) fn overwrite(rates: &mut [f64; MOTORS], gears: &[Option<Gear>; GEARS], of: fn(&Gear) -> f64) {
    for (rate, gear) in rates.iter_mut().zip(gears) {
        if let Some(gear) = gear {
            *rate = of(gear);
        }
    }
}

/// One substep of the body whose drives (left, right) have gearboxes where there is a `Gear`.
pub(crate) fn step(
    h: f64,
    body: &mut Body,
    ground: &Ground,
    gears: &mut [Option<Gear>; GEARS],
    motors: &[JointTorque; MOTORS],
) {
    let start = body.clone();
    let before: [(f64, f64); GEARS] = core::array::from_fn(|i| (start.joint_angle(i), start.joint_rate(i)));
    for repetition in 0..REPETITIONS_MAX {
        let mut joints = *motors;
        for ((joint, gear), motor) in joints.iter_mut().zip(gears.iter()).zip(motors) {
            if gear.is_some() {
                *joint = JointTorque {
                    coulomb_n_m: motor.coulomb_n_m,
                    ..JointTorque::NONE
                };
            }
        }
        let weights = start.joint_weights(h, &joints);
        for (i, gear) in gears.iter().enumerate() {
            if let Some(gear) = gear {
                let e = gear.eliminate(h, &motors[i], before[i]);
                // The mean rate is that at the start and a part of the gain.
                let damping = e.slope / weights[i];
                joints[i].constant_n_m = e.torque + damping * before[i].1;
                joints[i].damping_n_m_s = damping;
            }
        }
        if repetition > 0 {
            *body = start.clone();
        }
        body.step_weighted(h, ground, &joints, weights);
        let mut agree = true;
        let last = *gears;
        for (i, gear) in gears.iter_mut().enumerate() {
            if let Some(gear) = gear {
                let gained = body.joint_rate(i) - before[i].1;
                agree &= gear.agrees(h, &motors[i], before[i], gained);
            }
        }
        if agree || repetition + 1 == REPETITIONS_MAX {
            // Moved on the flanks that the body has felt.
            for (i, (gear, felt)) in gears.iter_mut().zip(last).enumerate() {
                if let (Some(gear), Some(mut felt)) = (gear, felt) {
                    felt.finish(h, &motors[i], before[i], body.joint_rate(i) - before[i].1);
                    let (flank, held) = (gear.flank, gear.held);
                    *gear = Gear { flank, held, ..felt };
                }
            }
            return;
        }
    }
}

#[cfg(test)]
mod tests;
