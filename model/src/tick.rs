//! One tick of the vehicle: all of its decisions in one pure step.
//!
//! `sample + command -> actuation + status`, in the stages *sense* (raw to SI), *estimate*, *decide*
//! (supervision and control laws) and *actuate* (limits, duties). Each stage takes what the stages before it
//! returned. Inside the core, *decide* also reads the sines that *estimate* computed, and *actuate* reads the shares of
//! the current limits that supervision found in *decide*. The step uses no clock and no hardware: a recorded sequence
//! of samples and commands replays bit for bit.

use crate::board::BoardScales;
use crate::command::Command;
use crate::control::motor::{LimitedVoltage, MotorLimits, duty};
use crate::control::supply_guard::SupplyGuard;
use crate::estimate::Estimate;
use crate::sample::{Actuation, MOTORS, Motor, Sample};
use crate::sensed::Sensed;
use crate::status::Status;
use crate::supervise::arming::Mode;
use crate::supervise::codes::{Fault, Limit};
use crate::supervise::supervisor::Supervisor;
use crate::vehicle::Vehicle;

mod decide;
mod estimate;
mod sense;

pub use decide::Decision;
use decide::Laws;
use estimate::Estimator;
pub use estimate::{Estimated, STOPPED_M_S, Sines};
use sense::Sensing;

/// The result of one tick.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Output {
    /// For the bridges.
    pub actuation: Actuation,
    /// For the link, the log and the tests.
    pub status: Status,
}

/// The vehicle's decision core, with all state that passes from one tick to the next.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct VehicleCore {
    scales: BoardScales,
    sensing: Sensing,
    estimator: Estimator,
    supervisor: Supervisor,
    laws: Laws,
    motor_limits: [MotorLimits; MOTORS],
    supply_guards: [SupplyGuard; MOTORS],
    tick: u32,
    /// The bridges' commands since the last tick.
    applied: Actuation,
}

impl VehicleCore {
    /// The core for a checked vehicle on a board with the given scales: disarmed, uncalibrated, with every blocker set.
    pub fn new(vehicle: &Vehicle<f32>, scales: &BoardScales) -> Self {
        let p = vehicle.parameters();
        let motors = p.motors();
        Self {
            scales: *scales,
            sensing: Sensing::new(vehicle, scales),
            estimator: Estimator::new(vehicle),
            supervisor: Supervisor::new(vehicle, scales),
            laws: Laws::new(vehicle, scales.duty_max),
            motor_limits: motors.map(MotorLimits::new),
            supply_guards: motors.map(|motor| SupplyGuard::new(&p.battery, motor)),
            tick: 0,
            applied: Actuation::SAFE,
        }
    }

    /// This core for another vehicle, for a change of the parameters while disarmed.
    ///
    /// The new core keeps what the vehicle has reported: latched faults, blockers, refused requests, ticks, heading and
    /// pose. The laws, the watches and the calibration start again.
    #[must_use]
    pub fn with_vehicle(&self, vehicle: &Vehicle<f32>) -> Self {
        let new = Self::new(vehicle, &self.scales);
        Self {
            sensing: new.sensing.with_counts_of(&self.sensing),
            estimator: new.estimator.with_pose_of(&self.estimator),
            supervisor: new.supervisor.with_record_of(&self.supervisor, vehicle),
            tick: self.tick,
            applied: self.applied,
            ..new
        }
    }

    /// The mode after the last tick.
    pub fn mode(&self) -> Mode {
        self.supervisor.mode()
    }

    /// One tick: all stages.
    pub fn step(&mut self, sample: &Sample, command: &Command) -> Output {
        let sensed = self.sense(sample);
        let estimated = self.estimate(&sensed);
        let decision = self.decide(&sensed, &estimated, command);
        self.actuate(&sensed, &estimated.estimate, decision)
    }

    /// Stage 1: raw counts to SI units.
    // On the host a part of the tick, as are the other stages: what one hands the next need not pass through memory.
    #[allow(clippy::inline_always)]
    #[cfg_attr(not(target_os = "none"), inline(always))]
    pub fn sense(&mut self, sample: &Sample) -> Sensed {
        self.sensing.step(sample)
    }

    /// Stage 2: angles, rates, slope, pose. The laws' intent is that of the last tick.
    // Inlined like `sense`.
    #[allow(clippy::inline_always)]
    #[cfg_attr(not(target_os = "none"), inline(always))]
    pub fn estimate(&mut self, sensed: &Sensed) -> Estimated {
        let disarmed = self.mode() == Mode::Disarmed;
        let estimate = self
            .estimator
            .step(sensed, self.supervisor.believed(), disarmed, self.laws.intent());
        Estimated {
            estimate,
            sines: self.estimator.sines(),
        }
    }

    /// Stage 3: supervision, then the control laws.
    // Inlined like `sense`.
    #[allow(clippy::inline_always)]
    #[cfg_attr(not(target_os = "none"), inline(always))]
    pub fn decide(&mut self, sensed: &Sensed, estimated: &Estimated, command: &Command) -> Decision {
        let estimate = &estimated.estimate;
        let verdict = self.supervisor.step(sensed, estimate, command, self.applied);
        let wish = self.laws.step(verdict, sensed, estimated, command);
        if self.laws.refuses_slope() {
            self.supervisor.stop(Fault::SteepSlope);
        }
        Decision {
            mode: self.supervisor.mode(),
            faults: self.supervisor.latched(),
            blockers: self.supervisor.blocking(),
            late_ticks: self.supervisor.late_ticks(),
            refused_arms: self.supervisor.refused_arms(),
            limits: wish.limits,
            voltage_v: wish.voltage_v,
            ballast_off: wish.ballast_off,
            motor_shares: self.supervisor.motor_shares(),
            terms: wish.terms,
            speed_reference_m_s: self.laws.speed_reference_m_s(),
            yaw_rate_reference_rad_s: self.laws.yaw_rate_reference_rad_s(),
        }
    }

    /// Stage 4: current limits, battery compensation, duties; opens the bridges if any value is not finite.
    // Inlined like `sense`.
    #[allow(clippy::inline_always)]
    #[cfg_attr(not(target_os = "none"), inline(always))]
    pub fn actuate(&mut self, sensed: &Sensed, estimate: &Estimate, decision: Decision) -> Output {
        let Decision {
            mut mode,
            mut faults,
            mut limits,
            mut voltage_v,
            motor_shares: shares,
            ..
        } = decision;
        let supply_v = sensed.supply_v;
        let mut actuation = Actuation::SAFE;
        if mode != Mode::Disarmed {
            let [left_v, right_v, ballast_v] = voltage_v;
            let [left_rad_s, right_rad_s, ballast_rad_s] = sensed.relative_rate_rad_s;
            let mut motor_limits = self.motor_limits;
            for (limits, share) in motor_limits.iter_mut().zip(shares) {
                *limits = limits.with_share(share);
            }
            let [left_limits, right_limits, ballast_limits] = motor_limits;
            let drive_limits = [left_limits, right_limits];
            let [left, right] = MotorLimits::limit_pair(drive_limits, [left_v, right_v], [left_rad_s, right_rad_s]);
            let ballast = ballast_limits.limit(ballast_v, ballast_rad_s);
            let mut drive = |motor: Motor, limited: LimitedVoltage, by_current: Limit| {
                let i = motor as usize;
                limits.insert_if(by_current, limited.by_current);
                if limited.by_current && shares[i] < 1.0 {
                    limits.insert(Limit::MotorHeat);
                }
                let kept_v = self.supply_guards[i].limit(limited.voltage_v, sensed.relative_rate_rad_s[i], supply_v);
                if kept_v != limited.voltage_v {
                    limits.insert(Limit::Regeneration);
                }
                voltage_v[i] = kept_v;
                actuation.duty[i] = duty(kept_v, supply_v, self.scales.duty_max);
            };
            drive(Motor::Left, left, Limit::LeftCurrent);
            drive(Motor::Right, right, Limit::RightCurrent);
            if decision.ballast_off {
                // A current limit around the back-EMF of a wrong encoder would drive the motor.
                voltage_v[Motor::Ballast as usize] = 0.0;
            } else {
                drive(Motor::Ballast, ballast, Limit::BallastCurrent);
            }
            if voltage_v.iter().all(|v| v.is_finite()) && supply_v.is_finite() {
                actuation.enable = true;
            } else {
                self.supervisor.trip(Fault::NotFinite);
                mode = Mode::Disarmed;
                faults.insert(Fault::NotFinite);
                actuation = Actuation::SAFE;
            }
        }
        self.applied = actuation;
        self.tick = self.tick.wrapping_add(1);
        Output {
            actuation,
            status: Status {
                tick: self.tick,
                time_us: sensed.time_us,
                mode,
                faults,
                blockers: decision.blockers,
                limits,
                estimate: *estimate,
                speed_reference_m_s: decision.speed_reference_m_s,
                yaw_rate_reference_rad_s: decision.yaw_rate_reference_rad_s,
                terms: decision.terms,
                voltage_v,
                current_a: sensed.current_a,
                battery_v: sensed.battery_v,
                late_ticks: decision.late_ticks,
                refused_arms: decision.refused_arms,
            },
        }
    }
}

#[cfg(test)]
mod tests;
