//! Fault and blocker detection: compares one tick's readings with the vehicle's limits and derives the mode.

use super::arming::{Arming, Conditions, Mode};
use super::blocking::{ARM_IMU_FAULTS, ENCODER_FAULTS, blockers_of};
use super::codes::{Blocker, BlockerSet, Fault, FaultSet};
use super::debounce::Debounce;
use super::motor_watch::{self, MotorReading, MotorWatch};
use super::plausibility::{ImuHealth, ImuWatch};
use super::whirl_watch::WhirlWatch;
use crate::board::BoardScales;
use crate::command::{Command, Request};
use crate::control::motor::voltage;
use crate::control::motor_guard::MotorGuard;
use crate::estimate::Estimate;
use crate::sample::{Actuation, MOTORS, Motor, TICK_S};
use crate::sensed::Sensed;
use crate::vehicle::{BatteryParameters, MotorParameters, SafetyParameters, Vehicle};

/// A tick that begins later than this after the last tick counts as late.
const LATE_US: u64 = 1500;
/// A tick that begins later than this after the last tick is a fault.
const MISSED_US: u64 = 5000;

/// The result of supervision in one tick.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Findings {
    /// The mode from now on.
    pub mode: Mode,
    /// Whether the vehicle was armed in this tick.
    pub newly_armed: bool,
    /// Faults whose cause is present in this tick.
    pub faults: FaultSet,
}

/// The sensors that supervision believes: those without a present fault.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Believed {
    /// The arm IMU is fresh, plausible, and its gyro and accelerometer agree.
    pub arm_imu: bool,
    /// The spar IMU is fresh and plausible.
    pub spar_imu: bool,
    /// The wheels' encoders are fresh and plausible.
    pub encoders: bool,
}

impl Believed {
    /// Every sensor is believed.
    pub const ALL: Self = Self {
        arm_imu: true,
        spar_imu: true,
        encoders: true,
    };
}

/// The vehicle's limits, and its largest ages in the unit that ages have.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Thresholds {
    safety: SafetyParameters<f32>,
    battery: BatteryParameters<f32>,
    sensor_timeout_us: u32,
    command_timeout_us: u32,
}

/// The supervisor of one vehicle: thresholds, watches and the arming state machine.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Supervisor {
    arming: Arming,
    thresholds: Thresholds,
    arm_watch: ImuWatch,
    whirl_watch: WhirlWatch,
    spar_watch: Option<ImuWatch>,
    motor_watches: [MotorWatch; MOTORS],
    motor_guards: [MotorGuard; MOTORS],
    /// Difference of the wheels' rates, right less left, per yaw rate.
    wheel_rates_per_yaw: f32,
    debounce: Debounce,
    /// A drive motor's current sensor showed a current when the bridges were last open.
    current_offset: bool,
    /// The emergency stop's contacts have disagreed since faults were last cleared.
    contacts_disagreed: bool,
    last_time_us: Option<u64>,
    late_ticks: u32,
    believed: Believed,
}

/// Number of counts that an encoder cannot move within one tick: twice the no-load speed at the highest supply, plus a
/// margin.
fn jump_counts(motor: &MotorParameters<f32>, supply_max_v: f32) -> u32 {
    let turns_per_s = supply_max_v / motor.back_emf_constant_v_s_per_rad / (2.0 * core::f32::consts::PI);
    ((2.0 * turns_per_s * motor.encoder_counts_per_rev * TICK_S) as u32).saturating_add(16)
}

/// Time after which the supervisor gives up a controlled stop, in ticks.
fn stop_timeout_ticks(vehicle: &Vehicle<f32>) -> u32 {
    (vehicle.parameters().safety.stop_timeout_s / TICK_S) as u32
}

impl Supervisor {
    /// The supervisor of `vehicle` on a board with the given scales: disarmed, with every blocker set.
    pub fn new(vehicle: &Vehicle<f32>, scales: &BoardScales) -> Self {
        let p = vehicle.parameters();
        let us = |s: f32| (s * 1e6) as u32;
        let sensor_timeout_us = us(p.safety.sensor_timeout_s);
        let motor_watch =
            |motor: &MotorParameters<f32>| MotorWatch::new(motor, jump_counts(motor, p.battery.maximum_v));
        let imu_watch = ImuWatch::new(sensor_timeout_us, &scales.imu);
        let [left, right, ballast] = p.motors();
        Self {
            arming: Arming::new(stop_timeout_ticks(vehicle)),
            thresholds: Thresholds {
                safety: p.safety,
                battery: p.battery,
                sensor_timeout_us,
                command_timeout_us: us(p.safety.command_timeout_s),
            },
            arm_watch: imu_watch,
            whirl_watch: WhirlWatch::new(vehicle),
            spar_watch: p.spar.as_ref().map(|_| imu_watch),
            motor_watches: p.motors().map(motor_watch),
            motor_guards: [
                MotorGuard::new(left, 0),
                MotorGuard::new(right, 1),
                MotorGuard::new(ballast, 2),
            ],
            wheel_rates_per_yaw: 2.0 * p.body.half_track_m / p.body.wheel_radius_m,
            debounce: Debounce::default(),
            current_offset: false,
            contacts_disagreed: false,
            last_time_us: None,
            late_ticks: 0,
            believed: Believed::default(),
        }
    }

    /// This supervisor, made for `vehicle`, with everything that another supervisor has reported: mode, latched faults,
    /// blockers, refused requests, late ticks and the emergency stop's contacts. Motors and bridges keep their heats.
    #[must_use]
    pub fn with_record_of(self, other: &Self, vehicle: &Vehicle<f32>) -> Self {
        let mut motor_guards = self.motor_guards;
        for (guard, warm) in motor_guards.iter_mut().zip(&other.motor_guards) {
            *guard = guard.as_warm_as(warm);
        }
        Self {
            motor_guards,
            arming: other.arming.with_stop_timeout(stop_timeout_ticks(vehicle)),
            debounce: self.debounce.with_run_of(Fault::StopContacts, other.debounce),
            contacts_disagreed: other.contacts_disagreed,
            last_time_us: other.last_time_us,
            late_ticks: other.late_ticks,
            ..self
        }
    }

    /// One tick. `applied` are the bridges' commands since the last tick.
    #[inline]
    pub fn step(&mut self, sensed: &Sensed, estimate: &Estimate, command: &Command, applied: Actuation) -> Findings {
        if command.request == Request::ClearFaults && self.mode() == Mode::Disarmed {
            self.contacts_disagreed = false;
        }
        let faults = self.faults(sensed, estimate, command, applied);
        self.believed = Believed {
            arm_imu: !faults.has_any(ARM_IMU_FAULTS),
            spar_imu: !faults.contains(Fault::SparImu),
            encoders: !faults.has_any(ENCODER_FAULTS),
        };
        let blockers = self
            .blockers(faults, estimate, command)
            .union(BlockerSet::from_bits(sensed.board_blockers));
        let before = self.arming.mode();
        let mode = self.arming.step(&Conditions {
            faults,
            blockers,
            request: command.request,
            stopped: estimate.stopped,
        });
        Findings {
            mode,
            newly_armed: before == Mode::Disarmed && mode != Mode::Disarmed,
            faults,
        }
    }

    /// Begins a controlled stop for a fault that the laws found, and latches it; no effect unless armed.
    pub fn stop(&mut self, fault: Fault) {
        self.arming.stop(fault);
    }

    /// Opens the bridges for a fault that was found after the decision, and latches it.
    pub fn trip(&mut self, fault: Fault) {
        self.arming.trip(fault);
    }

    /// The present mode.
    pub fn mode(&self) -> Mode {
        self.arming.mode()
    }

    /// The sensors that the last tick believed; none before the first tick.
    pub fn believed(&self) -> Believed {
        self.believed
    }

    /// Faults that have been latched since the operator last cleared them.
    pub fn latched(&self) -> FaultSet {
        self.arming.latched()
    }

    /// Blockers of the last tick.
    pub fn blocking(&self) -> BlockerSet {
        self.arming.blockers()
    }

    /// Number of refused requests to arm.
    pub fn refused_arms(&self) -> u32 {
        self.arming.refused()
    }

    /// Share of its current limit that each motor may use, 0 to 1.
    pub fn motor_shares(&self) -> [f32; MOTORS] {
        self.motor_guards.each_ref().map(MotorGuard::share)
    }

    /// Number of late ticks.
    pub fn late_ticks(&self) -> u32 {
        self.late_ticks
    }

    /// The faults whose cause is present in this tick.
    fn faults(&mut self, sensed: &Sensed, estimate: &Estimate, command: &Command, applied: Actuation) -> FaultSet {
        let mut faults = FaultSet::EMPTY;

        let gap_us = self.last_time_us.map_or(0, |last| sensed.time_us.saturating_sub(last));
        self.last_time_us = Some(sensed.time_us);
        if gap_us > LATE_US {
            self.late_ticks = self.late_ticks.wrapping_add(1);
        }
        faults.insert_if(Fault::DeadlineMissed, gap_us > MISSED_US);

        faults.insert_if(Fault::EmergencyStop, sensed.emergency_stop);
        faults.insert_if(Fault::BridgeBreak, sensed.bridge_break);
        // The finding is kept, because a contact that does not open shows only while somebody presses the stop.
        let differ = sensed.emergency_stop != sensed.break_input;
        self.contacts_disagreed |= self.debounce.update(Fault::StopContacts, differ);
        faults.insert_if(Fault::StopContacts, self.contacts_disagreed);

        let arm = self.arm_watch.update(&sensed.arm_imu);
        faults.insert_if(Fault::ImuStale, arm == ImuHealth::Stale);
        faults.insert_if(
            Fault::ImuImplausible,
            arm == ImuHealth::Implausible || estimate.contradicted,
        );
        if let Some(watch) = &mut self.spar_watch {
            let good = watch.update(&sensed.spar_imu) == ImuHealth::Good;
            faults.insert_if(Fault::SparImu, !good || estimate.spar_contradicted);
            faults.insert_if(
                Fault::SparAngle,
                estimate.spar_rad.abs() > self.thresholds.safety.spar_max_rad,
            );
        }

        faults.insert_if(
            Fault::EncoderStale,
            sensed.encoder_age_us > self.thresholds.sensor_timeout_us,
        );
        faults = faults.union(self.motors(sensed, estimate.yaw_rate_rad_s, applied));
        let low = sensed.battery_v < self.thresholds.battery.minimum_v;
        faults.insert_if(Fault::BatteryLow, self.debounce.update(Fault::BatteryLow, low));
        let high = sensed.battery_v > self.thresholds.battery.maximum_v;
        faults.insert_if(Fault::BatteryHigh, self.debounce.update(Fault::BatteryHigh, high));
        faults.insert_if(
            Fault::AnalogStale,
            sensed.analog_age_us > self.thresholds.sensor_timeout_us,
        );

        let lost = self.whirl_watch.update(estimate.phi_rad, self.arming.mode());
        faults.insert_if(Fault::ArmAngle, lost);
        faults.insert_if(Fault::NotFinite, !estimate.is_finite());
        faults.insert_if(
            Fault::CommandTimeout,
            !command.drive.is_finite() || command.age_us > self.thresholds.command_timeout_us,
        );
        faults
    }

    /// The faults of the motors, their encoders, current sensors and leads.
    fn motors(&mut self, sensed: &Sensed, yaw_rate_rad_s: f32, applied: Actuation) -> FaultSet {
        let left = self.update_motor(Motor::Left, sensed, applied);
        let right = self.update_motor(Motor::Right, sensed, applied);
        // Without a spar the third bridge has no motor.
        let with_ballast = self.spar_watch.is_some();
        let ballast = with_ballast && self.update_motor(Motor::Ballast, sensed, applied);
        let [left_watch, right_watch, _] = &self.motor_watches;
        self.current_offset = left_watch.has_current_offset() || right_watch.has_current_offset();
        let [left_a, right_a, ballast_a] = sensed.current_a.map(f32::abs);
        let limit_a = self.thresholds.safety.overcurrent_a;
        let over = left_a > limit_a || right_a > limit_a;
        let over = self.debounce.update(Fault::Overcurrent, over);
        let ballast_over = with_ballast && ballast_a > limit_a;
        let ballast_over = self.debounce.update(Fault::BallastOvercurrent, ballast_over);
        let mut faults = FaultSet::EMPTY;
        let hot = self.motor_guards.iter().any(MotorGuard::is_overheated);
        if !(left || right || ballast || over || ballast_over || hot) {
            // The usual case.
            return faults;
        }
        let readings = self.motor_readings(sensed, applied);
        let yaw_rad_s = self.wheel_rates_per_yaw * yaw_rate_rad_s;
        let [left, right, ballast] =
            motor_watch::healths(&mut self.motor_watches, [left, right, ballast], &readings, yaw_rad_s);
        let [left_guard, right_guard, ballast_guard] = &self.motor_guards;
        faults.insert_if(Fault::EncoderImplausible, left.encoder || right.encoder);
        faults.insert_if(Fault::Overcurrent, over);
        faults.insert_if(Fault::LeftMotorOpen, left.open);
        faults.insert_if(Fault::RightMotorOpen, right.open);
        faults.insert_if(Fault::CurrentSensor, left.current_sensor || right.current_sensor);
        faults.insert_if(
            Fault::DriveMotorHot,
            left_guard.winding_is_overheated() || right_guard.winding_is_overheated(),
        );
        faults.insert_if(
            Fault::DriveBridgeHot,
            left_guard.bridge_is_overheated() || right_guard.bridge_is_overheated(),
        );
        faults.insert_if(Fault::BallastEncoder, ballast.encoder);
        faults.insert_if(Fault::BallastOvercurrent, ballast_over);
        faults.insert_if(Fault::BallastMotorOpen, ballast.open);
        faults.insert_if(Fault::BallastMotorHot, ballast_guard.winding_is_overheated());
        faults.insert_if(Fault::BallastBridgeHot, ballast_guard.bridge_is_overheated());
        faults.insert_if(
            Fault::BallastCurrentSensor,
            ballast.current_sensor || ballast.current_offset,
        );
        faults
    }

    /// Updates the watch and the heat of one motor. Returns whether the watch shows anything wrong.
    // On the host the function is inlined for each motor, so the watch's inputs and outputs stay in registers. On the
    // board three copies would take 2 KiB of flash.
    #[allow(clippy::inline_always)]
    #[cfg_attr(not(target_os = "none"), inline(always))]
    fn update_motor(&mut self, motor: Motor, sensed: &Sensed, applied: Actuation) -> bool {
        let i = motor as usize;
        // Before the first conversion the counts are meaningless and may mean the largest possible current. In one tick
        // that current would heat the model of a motor with a small continuous current so far that arming would be
        // blocked for seconds.
        if sensed.analog_age_us <= self.thresholds.sensor_timeout_us {
            self.motor_guards[i].update(sensed.current_a[i]);
        }
        let reading = self.motor_reading(i, sensed, applied);
        self.motor_watches[i].update(&reading)
    }

    /// What the watches of the motors compare, once more.
    // Out of line: it is needed only where something is wrong.
    #[cold]
    #[inline(never)]
    fn motor_readings(&self, sensed: &Sensed, applied: Actuation) -> [MotorReading; MOTORS] {
        core::array::from_fn(|i| self.motor_reading(i, sensed, applied))
    }

    /// What the watch of motor `i` compares.
    // Inlined like `update_motor`, which needs no copy of it in memory.
    #[allow(clippy::inline_always)]
    #[inline(always)]
    fn motor_reading(&self, i: usize, sensed: &Sensed, applied: Actuation) -> MotorReading {
        // A reading below `minimum_v` is true or false.
        let applied_shares = (sensed.battery_v < sensed.supply_v)
            .then(|| [sensed.battery_v, self.thresholds.battery.maximum_v].map(|v| v / sensed.supply_v));
        MotorReading {
            count: sensed.encoder_counts[i] as i32,
            // The ballast motor's idle bridge holds 0 V, which is as good a test as any other voltage.
            applied_v: applied.enable.then(|| voltage(applied.duty[i], sensed.supply_v)),
            applied_shares,
            current_a: sensed.current_a[i],
            rate_rad_s: sensed.relative_rate_rad_s[i],
        }
    }

    /// The blockers of this tick.
    fn blockers(&self, faults: FaultSet, estimate: &Estimate, command: &Command) -> BlockerSet {
        let mut blockers = if faults.is_empty() {
            BlockerSet::EMPTY
        } else {
            blockers_of(faults)
        };
        blockers.insert_if(Blocker::NotCalibrated, !estimate.calibrated);
        blockers.insert_if(Blocker::NotAtRest, !estimate.at_rest);
        // Written so that a NaN in phi blocks.
        let upright = estimate.phi_rad.abs() < 0.5 * self.thresholds.safety.phi_max_rad;
        blockers.insert_if(Blocker::ArmAngle, !upright);
        blockers.insert_if(Blocker::CommandNotNeutral, !command.drive.is_neutral());
        blockers.insert_if(Blocker::Parameters, command.parameters_pending);
        blockers.insert_if(Blocker::CurrentSensor, self.current_offset);
        blockers
    }
}

#[cfg(test)]
mod tests;
