//! A gearbox with play and stiffness: the rotor is a separate body that drives the joint through the teeth.
//!
//! Angles, rates and inertias are given at the gearbox output and relative to the arm, like those of the
//! joint. With rotor angle rho, joint angle j and twist s = rho - j, the teeth carry
//!
//! ```text
//! T = k (s - b/2) + d s'   while s > b/2 and T > 0,
//! T = k (s + b/2) + d s'   while s < -b/2 and T < 0,   else 0
//! ```
//!
//! and the rotor obeys `J rho'' = T_motor - T`, where J is the n^2 J_rotor that a rigid gearbox adds to the
//! joint. Friction acts at the output, as in the vehicle file.
//!
//! # Step
//! The motor's law is linear in the rotor's rate, and the teeth's law on one flank is linear in both rates.
//! The rotor's rate at the end of the substep can therefore be eliminated. The result is a torque on the
//! joint that is linear in the joint's rate; the body solves this torque together with its own equations.
//! The teeth act with the twist and its rate at the middle of the substep (energy is conserved), or at its
//! end where the teeth are too stiff to be resolved (unconditionally stable). A few repetitions of the
//! substep determine which flank touches.

use model::sample::MOTORS;

use crate::body::{Body, JointTorque};
use crate::terrain::Ground;

/// Largest number of repetitions of a substep; the contact states of two gearboxes have nine combinations.
const REPETITIONS_MAX: usize = 10;
/// Smallest inertia of a rotor, in kg m^2 at the output: a rotor without inertia would have no equation of
/// motion.
const ROTOR_MIN_KG_M2: f64 = 1e-6;
/// Number of geared joints: the left and the right drive.
pub(crate) const GEARS: usize = 2;

/// The contact state of the teeth.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Flank {
    /// The teeth do not touch.
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

/// The motor's law within a substep: `None` for the linear law, or the torque at a limit.
type MotorLaw = Option<f64>;

/// One gearbox and its rotor.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Gear {
    half_backlash: f64,
    stiffness: f64,
    damping: f64,
    /// Rotor inertia at the output.
    rotor: f64,
    /// Inertia on the joint's side of the teeth: at least that of the wheel.
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

    /// Mean rate of the rotor over the last substep, as used in the motor's law.
    pub(crate) fn mean_rate(&self) -> f64 {
        self.mean_rate
    }

    /// Share of the substep at which teeth and motor act: the middle, or the end where they are stiff.
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

    /// Whether the body's solution, in which the joint gained the rate `y`, agrees with the assumed flank
    /// and motor branch. Otherwise adopts the flank and the branch of the solution.
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
        // The linear law lies between the two limits.
        self.held = if matches!((self.held, held), (Some(a), Some(b)) if a != b) {
            None
        } else {
            held
        };
        self.flank = flank;
        agrees
    }

    /// Advances the rotor by the substep in which the joint gained the rate `y`.
    fn finish(&mut self, h: f64, motor: &JointTorque, joint: (f64, f64), y: f64) {
        let (_, drive) = self.weights(h, motor);
        let e = self.eliminate(h, motor, joint);
        let x = e.free + e.follow * y;
        self.mean_rate = self.rate + drive * x;
        self.angle += h * (self.rate + 0.5 * x);
        self.rate += x;
    }
}

/// Replaces the joints' rates by the rotors' rates.
pub(crate) fn overwrite(rates: &mut [f64; MOTORS], gears: &[Option<Gear>; GEARS], of: fn(&Gear) -> f64) {
    for (rate, gear) in rates.iter_mut().zip(gears) {
        if let Some(gear) = gear {
            *rate = of(gear);
        }
    }
}

/// One substep of a body whose drives (left, right) have a gearbox with play where `gears` has a `Gear`.
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
                // The mean rate is the initial rate plus a part of the gain.
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
            // The rotors advance on the flanks of the body's last solution.
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
