//! Fault and blocker detection: what one tick shows against the vehicle's limits, and the mode that follows.

use super::arming::{Arming, Conditions, Mode};
use super::codes::{Blocker, BlockerSet, Fault, FaultSet};
use super::plausibility::{EncoderWatch, ImuHealth, ImuWatch, Persistence};
use crate::board::BoardScales;
use crate::command::Command;
use crate::control::motor::{MotorLimits, voltage};
use crate::estimate::Estimate;
use crate::sample::TICK_S;
use crate::sample::{Actuation, MOTORS, Motor};
use crate::sensed::Sensed;
use crate::vehicle::{MotorParameters, Vehicle};

/// A tick that comes later than this after the last one is counted late.
const LATE_US: u64 = 1500;
/// A tick that comes later than this after the last one is a fault.
const MISSED_US: u64 = 5000;
const OVERCURRENT_TICKS: u16 = 3;
const BATTERY_TICKS: u16 = 50;

/// What supervision finds in one tick.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Verdict {
    /// The mode from now on.
    pub mode: Mode,
    /// The vehicle was armed in this tick.
    pub newly_armed: bool,
    /// Faults whose cause is present in this tick.
    pub faults: FaultSet,
}

/// Fault limits in the units they are compared in.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Thresholds {
    phi_max_rad: f32,
    spar_max_rad: f32,
    overcurrent_a: f32,
    battery_min_v: f32,
    battery_max_v: f32,
    sensor_timeout_us: u32,
    command_timeout_us: u32,
}

/// The supervisor of one vehicle: thresholds, watches and the arming state machine.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Supervisor {
    arming: Arming,
    thresholds: Thresholds,
    arm_watch: ImuWatch,
    spar_watch: Option<ImuWatch>,
    encoder_watches: [EncoderWatch; MOTORS],
    overcurrent: Persistence,
    battery_low: Persistence,
    battery_high: Persistence,
    last_time_us: Option<u64>,
    late_ticks: u32,
}

/// Counts that an encoder cannot move within one tick: twice the no-load speed at the highest supply, and some.
fn jump_counts(motor: &MotorParameters<f32>, supply_max_v: f32) -> i64 {
    let turns_per_s = supply_max_v / motor.back_emf_constant_v_s_per_rad / (2.0 * core::f32::consts::PI);
    i64::from((2.0 * turns_per_s * motor.encoder_counts_per_rev * TICK_S) as i32) + 16
}

/// Time after which a controlled stop is given up, in ticks.
fn stop_timeout_ticks(vehicle: &Vehicle<f32>) -> u32 {
    (vehicle.parameters().safety.stop_timeout_s / TICK_S) as u32
}

impl Supervisor {
    /// The supervisor of `vehicle` on a board of the given scales: disarmed, every blocker set.
    pub fn new(vehicle: &Vehicle<f32>, scales: &BoardScales) -> Self {
        let p = vehicle.parameters();
        let us = |s: f32| (s * 1e6) as u32;
        let sensor_timeout_us = us(p.safety.sensor_timeout_s);
        let encoder_watch = |motor: &MotorParameters<f32>| {
            EncoderWatch::new(MotorLimits::new(motor), jump_counts(motor, p.battery.maximum_v))
        };
        let ballast_motor = p.spar.as_ref().map_or(&p.drive_motor, |(_, motor)| motor);
        let imu_watch = ImuWatch::new(sensor_timeout_us, &scales.imu);
        Self {
            arming: Arming::new(stop_timeout_ticks(vehicle)),
            thresholds: Thresholds {
                phi_max_rad: p.safety.phi_max_rad,
                spar_max_rad: p.safety.spar_max_rad,
                overcurrent_a: p.safety.overcurrent_a,
                battery_min_v: p.battery.minimum_v,
                battery_max_v: p.battery.maximum_v,
                sensor_timeout_us,
                command_timeout_us: us(p.safety.command_timeout_s),
            },
            arm_watch: imu_watch,
            spar_watch: p.spar.as_ref().map(|_| imu_watch),
            encoder_watches: [
                encoder_watch(&p.drive_motor),
                encoder_watch(&p.drive_motor),
                encoder_watch(ballast_motor),
            ],
            overcurrent: Persistence::new(OVERCURRENT_TICKS),
            battery_low: Persistence::new(BATTERY_TICKS),
            battery_high: Persistence::new(BATTERY_TICKS),
            last_time_us: None,
            late_ticks: 0,
        }
    }

    /// This supervisor, made for `vehicle`, with everything that another one has told: mode, latched faults, blockers,
    /// refused requests and late ticks.
    #[must_use]
    pub fn with_record_of(self, other: &Self, vehicle: &Vehicle<f32>) -> Self {
        Self {
            arming: other.arming.with_stop_timeout(stop_timeout_ticks(vehicle)),
            last_time_us: other.last_time_us,
            late_ticks: other.late_ticks,
            ..self
        }
    }

    /// One tick. `applied` is what the bridges did since the last tick.
    pub fn step(&mut self, sensed: &Sensed, estimate: &Estimate, command: &Command, applied: Actuation) -> Verdict {
        let faults = self.faults(sensed, estimate, command, applied);
        let blockers = self.blockers(faults, estimate, command);
        let before = self.arming.mode();
        let mode = self.arming.step(&Conditions {
            faults,
            blockers,
            request: command.request,
            stopped: estimate.stopped,
        });
        Verdict {
            mode,
            newly_armed: before == Mode::Disarmed && mode != Mode::Disarmed,
            faults,
        }
    }

    /// Opens the bridges for a fault that was found after the decision, and latches it.
    pub fn trip(&mut self, fault: Fault) {
        self.arming.trip(fault);
    }

    /// The present mode.
    pub fn mode(&self) -> Mode {
        self.arming.mode()
    }

    /// Faults latched since they were last cleared.
    pub fn latched(&self) -> FaultSet {
        self.arming.latched()
    }

    /// What blocked arming in the last tick.
    pub fn blocking(&self) -> BlockerSet {
        self.arming.blockers()
    }

    /// Requests to arm that were refused.
    pub fn refused_arms(&self) -> u32 {
        self.arming.refused()
    }

    /// Ticks that came late.
    pub fn late_ticks(&self) -> u32 {
        self.late_ticks
    }

    /// The faults whose cause is present in this tick.
    fn faults(&mut self, sensed: &Sensed, estimate: &Estimate, command: &Command, applied: Actuation) -> FaultSet {
        let limits = self.thresholds;
        let mut faults = FaultSet::EMPTY;

        let gap_us = self.last_time_us.map_or(0, |last| sensed.time_us.saturating_sub(last));
        self.last_time_us = Some(sensed.time_us);
        if gap_us > LATE_US {
            self.late_ticks = self.late_ticks.wrapping_add(1);
        }
        faults.set(Fault::DeadlineMissed, gap_us > MISSED_US);

        faults.set(Fault::EmergencyStop, sensed.emergency_stop);
        faults.set(Fault::BridgeBreak, sensed.bridge_break);

        let arm = self.arm_watch.update(&sensed.arm_imu);
        faults.set(Fault::ImuStale, arm == ImuHealth::Stale);
        faults.set(
            Fault::ImuImplausible,
            arm == ImuHealth::Implausible || estimate.contradicted,
        );
        if let Some(watch) = &mut self.spar_watch {
            faults.set(Fault::SparImu, watch.update(&sensed.spar_imu) != ImuHealth::Good);
            faults.set(Fault::SparAngle, estimate.spar_rad.abs() > limits.spar_max_rad);
        }

        faults.set(Fault::EncoderStale, sensed.encoder_age_us > limits.sensor_timeout_us);
        // Without a spar the third bridge has no motor.
        let motors = if self.spar_watch.is_some() {
            MOTORS
        } else {
            Motor::Ballast as usize
        };
        let mut implausible = false;
        for (i, watch) in self.encoder_watches.iter_mut().enumerate().take(motors) {
            // The ballast's idle bridge holds 0 V, which is as good a test as any other voltage.
            let applied_v = applied.enable.then(|| voltage(applied.duty[i], sensed.battery_v));
            implausible |= watch.update(
                sensed.encoder_counts[i],
                applied_v,
                sensed.current_a[i],
                sensed.relative_rate_rad_s[i],
            );
        }
        faults.set(Fault::EncoderImplausible, implausible);

        let over = sensed.current_a.iter().any(|a| a.abs() > limits.overcurrent_a);
        faults.set(Fault::Overcurrent, self.overcurrent.update(over));
        let low = self.battery_low.update(sensed.battery_v < limits.battery_min_v);
        faults.set(Fault::BatteryLow, low);
        let high = self.battery_high.update(sensed.battery_v > limits.battery_max_v);
        faults.set(Fault::BatteryHigh, high);
        faults.set(Fault::AnalogStale, sensed.analog_age_us > limits.sensor_timeout_us);

        faults.set(Fault::ArmAngle, estimate.phi_rad.abs() > limits.phi_max_rad);
        faults.set(Fault::NotFinite, !estimate.is_finite());
        faults.set(
            Fault::CommandTimeout,
            !command.is_finite() || command.age_us > limits.command_timeout_us,
        );
        faults
    }

    /// What blocks arming in this tick.
    fn blockers(&self, faults: FaultSet, estimate: &Estimate, command: &Command) -> BlockerSet {
        let any = |codes: &[Fault]| codes.iter().any(|code| faults.contains(*code));
        let mut blockers = BlockerSet::EMPTY;
        blockers.set(Blocker::NotCalibrated, !estimate.calibrated);
        blockers.set(Blocker::EmergencyStop, any(&[Fault::EmergencyStop]));
        blockers.set(Blocker::BridgeBreak, any(&[Fault::BridgeBreak]));
        blockers.set(
            Blocker::Imu,
            any(&[Fault::ImuStale, Fault::ImuImplausible, Fault::NotFinite]),
        );
        blockers.set(Blocker::Encoder, any(&[Fault::EncoderStale, Fault::EncoderImplausible]));
        blockers.set(Blocker::Analog, any(&[Fault::AnalogStale, Fault::Overcurrent]));
        blockers.set(Blocker::Battery, any(&[Fault::BatteryLow, Fault::BatteryHigh]));
        blockers.set(Blocker::NotAtRest, !estimate.at_rest);
        // Written so that a phi that is not a number blocks.
        let upright = estimate.phi_rad.abs() < 0.5 * self.thresholds.phi_max_rad;
        blockers.set(Blocker::ArmAngle, !upright);
        blockers.set(Blocker::NoCommand, any(&[Fault::CommandTimeout]));
        blockers.set(Blocker::CommandNotNeutral, !command.is_neutral());
        blockers.set(Blocker::Parameters, command.parameters_pending);
        blockers
    }
}

#[cfg(test)]
mod tests;
