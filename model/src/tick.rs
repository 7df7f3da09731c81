//! One tick of the vehicle: everything it decides, behind one pure step.
//!
//! `sample + command -> actuation + telemetry`, in the stages *sense* (raw to SI), *estimate*,
//! *decide* (supervision and control laws) and *actuate* (limits, duties). The step holds no clock and
//! no hardware: a recorded sequence of samples and commands replays bit for bit.

use crate::control::camera::{CameraController, CameraState};
use crate::control::motor::{DUTY_MAX, MotorLimits, duty, voltage};
use crate::control::speed::{SpeedController, SpeedInput};
use crate::control::steering::{SteeringController, SteeringInput};
use crate::estimate::rate_filter::LowPass;
use crate::sample::{Actuation, MOTORS, Motor, Sample};
use crate::supervise::arming::{Arming, Conditions, Mode, Request};
use crate::supervise::codes::{Blocker, BlockerSet, Fault, FaultSet, Limit, LimitSet};
use crate::supervise::plausibility::{EncoderWatch, ImuHealth, ImuWatch, Persistence};
use crate::vehicle::Vehicle;

mod estimate;
mod sense;

pub use estimate::Estimate;
use estimate::Estimator;
pub use sense::Sensed;
use sense::Sensing;

/// The tick, s.
pub const TICK_S: f32 = crate::sample::TICK_US as f32 * 1e-6;

/// What the operator wants, as known when the tick begins.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[repr(C)]
pub struct Command {
    /// Speed of the axle, m/s, forward positive.
    pub speed_m_s: f32,
    /// Yaw rate, rad/s, anticlockwise (to the left) positive; exactly 0 holds the heading.
    pub yaw_rate_rad_s: f32,
    /// Age of the two above, us; `u32::MAX` while there has been none.
    pub age_us: u32,
    /// A request to the arming state machine; given in one tick only.
    pub request: Request,
    /// Parameters are being changed: arming is blocked.
    pub parameters_pending: bool,
}

impl Command {
    /// No command yet.
    pub const NONE: Self = Self {
        speed_m_s: 0.0,
        yaw_rate_rad_s: 0.0,
        age_us: u32::MAX,
        request: Request::None,
        parameters_pending: false,
    };
}

/// What the vehicle tells of one tick. Angles and signs as in the module's estimates.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Telemetry {
    /// Ticks since the step began.
    pub tick: u32,
    /// Time of the sample, us since boot.
    pub time_us: u64,
    /// Arming state.
    pub mode: Mode,
    /// Latched faults.
    pub faults: FaultSet,
    /// What blocks arming.
    pub blockers: BlockerSet,
    /// What bounds the response.
    pub limits: LimitSet,
    /// What is estimated.
    pub estimate: Estimate,
    /// Governed speed reference, m/s.
    pub speed_reference_m_s: f32,
    /// Governed yaw-rate reference, rad/s.
    pub yaw_rate_reference_rad_s: f32,
    /// Voltage of each motor, V.
    pub voltage_v: [f32; MOTORS],
    /// Measured current of each motor, A.
    pub current_a: [f32; MOTORS],
    /// Filtered supply voltage, V.
    pub battery_v: f32,
    /// Ticks that came late since the step began.
    pub late_ticks: u32,
    /// Requests to arm that were refused.
    pub refused_arms: u32,
}

/// What one tick gives.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Output {
    /// For the bridges.
    pub actuation: Actuation,
    /// For the link, the log and the tests.
    pub telemetry: Telemetry,
}

/// A tick that comes later than this after the last is counted late.
const LATE_US: u64 = 1500;
/// A tick that comes later than this after the last is a fault.
const MISSED_US: u64 = 5000;
const OVERCURRENT_TICKS: u16 = 3;
const BATTERY_TICKS: u16 = 50;
/// Share of the supply that steering may take from driving.
const STEERING_SHARE: f32 = 0.5;
const BATTERY_TIME_CONSTANT_S: f32 = 0.005;

/// The vehicle's decisions: state carried from tick to tick.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct VehicleCore {
    sensing: Sensing,
    estimator: Estimator,
    speed: SpeedController,
    steering: SteeringController,
    camera: Option<CameraController>,
    arming: Arming,
    chassis_watch: ImuWatch,
    spar_watch: ImuWatch,
    encoder_watches: [EncoderWatch; MOTORS],
    motor_limits: [MotorLimits; MOTORS],
    overcurrent: Persistence,
    battery_low: Persistence,
    battery_high: Persistence,
    battery: LowPass,
    thresholds: Thresholds,
    camera_off: bool,
    tick: u32,
    late_ticks: u32,
    last_time_us: Option<u64>,
    applied: Actuation,
    limits: LimitSet,
    voltage_v: [f32; MOTORS],
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

/// Time after which a controlled stop is given up, in ticks.
fn stop_timeout_ticks(vehicle: &Vehicle<f32>) -> u32 {
    (vehicle.parameters().safety.stop_timeout_s / TICK_S) as u32
}

impl VehicleCore {
    /// The core for a checked vehicle: disarmed, uncalibrated, every blocker set.
    pub fn new(vehicle: &Vehicle<f32>) -> Self {
        let p = vehicle.parameters();
        let drive = MotorLimits::drive(&p.drive_motor);
        let camera = p.camera.as_ref().map_or(drive, |(_, motor)| MotorLimits::camera(motor));
        let motor_limits = [drive, drive, camera];
        // Twice the no-load speed at the highest supply.
        let jump = |constant: f32, counts: f32| {
            let turns_per_s = p.battery.maximum_v / constant / (2.0 * core::f32::consts::PI);
            i64::from((2.0 * turns_per_s * counts * TICK_S) as i32) + 16
        };
        let drive_jump = jump(
            p.drive_motor.back_emf_constant_v_s_per_rad,
            p.drive_motor.encoder_counts_per_rev,
        );
        let camera_jump = p.camera.as_ref().map_or(drive_jump, |(_, motor)| {
            jump(motor.back_emf_constant_v_s_per_rad, motor.encoder_counts_per_rev)
        });
        let us = |s: f32| (s * 1e6) as u32;
        let sensor_timeout_us = us(p.safety.sensor_timeout_s);
        Self {
            sensing: Sensing::new(vehicle),
            estimator: Estimator::new(vehicle),
            speed: SpeedController::new(vehicle, TICK_S),
            steering: SteeringController::new(vehicle, TICK_S),
            camera: CameraController::new(vehicle),
            arming: Arming::new(stop_timeout_ticks(vehicle)),
            chassis_watch: ImuWatch::new(sensor_timeout_us),
            spar_watch: ImuWatch::new(sensor_timeout_us),
            encoder_watches: [
                EncoderWatch::new(drive, drive_jump),
                EncoderWatch::new(drive, drive_jump),
                EncoderWatch::new(camera, camera_jump),
            ],
            motor_limits,
            overcurrent: Persistence::new(OVERCURRENT_TICKS),
            battery_low: Persistence::new(BATTERY_TICKS),
            battery_high: Persistence::new(BATTERY_TICKS),
            battery: LowPass::new(TICK_S, BATTERY_TIME_CONSTANT_S),
            thresholds: Thresholds {
                phi_max_rad: p.safety.phi_max_rad,
                spar_max_rad: p.safety.spar_max_rad,
                overcurrent_a: p.safety.overcurrent_a,
                battery_min_v: p.battery.minimum_v,
                battery_max_v: p.battery.maximum_v,
                sensor_timeout_us,
                command_timeout_us: us(p.safety.command_timeout_s),
            },
            camera_off: false,
            tick: 0,
            late_ticks: 0,
            last_time_us: None,
            applied: Actuation::SAFE,
            limits: LimitSet::EMPTY,
            voltage_v: [0.0; MOTORS],
        }
    }

    /// This core for another vehicle, as after a change of the parameters while disarmed.
    ///
    /// What was told of the vehicle stays: latched faults, blockers, refused requests, ticks, heading and pose. The
    /// laws, the watches and the calibration begin anew.
    pub fn with_vehicle(&self, vehicle: &Vehicle<f32>) -> Self {
        let new = Self::new(vehicle);
        Self {
            sensing: new.sensing.with_counts_of(&self.sensing),
            estimator: new.estimator.with_pose_of(&self.estimator),
            arming: self.arming.with_stop_timeout(stop_timeout_ticks(vehicle)),
            battery: self.battery,
            camera_off: self.camera_off,
            tick: self.tick,
            late_ticks: self.late_ticks,
            last_time_us: self.last_time_us,
            applied: self.applied,
            ..new
        }
    }

    /// The arming state after the last tick.
    pub fn mode(&self) -> Mode {
        self.arming.mode()
    }

    /// One tick: all stages.
    pub fn step(&mut self, sample: &Sample, command: &Command) -> Output {
        let sensed = self.sense(sample);
        let estimate = self.estimate(&sensed);
        self.decide(sample, &sensed, &estimate, command);
        self.actuate(sample, &sensed, &estimate)
    }

    /// Stage 1: raw counts to SI units.
    pub fn sense(&mut self, sample: &Sample) -> Sensed {
        let sensed = self.sensing.step(sample);
        if self.last_time_us.is_none() {
            self.battery.reset(sensed.battery_v);
        }
        self.battery.update(sensed.battery_v);
        sensed
    }

    /// Stage 2: angles, rates, slope, pose.
    pub fn estimate(&mut self, sensed: &Sensed) -> Estimate {
        self.estimator.step(sensed, self.arming.mode() == Mode::Disarmed)
    }

    /// Stage 3: supervision, then the control laws. Leaves the wanted motor voltages.
    pub fn decide(&mut self, sample: &Sample, sensed: &Sensed, estimate: &Estimate, command: &Command) {
        self.limits = LimitSet::EMPTY;
        let faults = self.faults(sample, sensed, estimate, command);
        let blockers = self.blockers(faults, estimate, command);
        let before = self.arming.mode();
        let mode = self.arming.step(&Conditions {
            faults,
            blockers,
            request: command.request,
            stopped: estimate.stopped,
        });
        if mode == Mode::Disarmed {
            self.voltage_v = [0.0; MOTORS];
            return;
        }
        if before == Mode::Disarmed {
            self.speed.reset(estimate.speed_m_s);
            self.steering.reset();
            self.camera_off = false;
        }
        self.camera_off |= !faults.intersection(FaultSet::CAMERA).is_empty();

        let (speed_m_s, yaw_rate_rad_s) = if mode == Mode::Armed {
            (command.speed_m_s, command.yaw_rate_rad_s)
        } else {
            (0.0, 0.0)
        };
        let supply_v = DUTY_MAX * self.battery.value();
        let turn_v = self.steering.step(&SteeringInput {
            target_rad_s: yaw_rate_rad_s,
            yaw_rate_rad_s: estimate.yaw_rate_rad_s,
            heading_rad: estimate.heading_rad,
            voltage_max_v: STEERING_SHARE * supply_v,
        });
        let drive_max_v = supply_v - turn_v.abs();
        let drive_v = self.speed.step(&SpeedInput {
            target_m_s: speed_m_s,
            phi_rad: estimate.phi_rad,
            theta_rate_rad_s: estimate.theta_rate_rad_s,
            phi_rate_rad_s: estimate.phi_rate_rad_s,
            sin_slope: estimate.sin_slope,
            distance_m: estimate.distance_m,
            voltage_max_v: drive_max_v,
        });
        let camera_v = match &self.camera {
            Some(camera) if !self.camera_off => camera.step(
                &CameraState {
                    spar_rad: estimate.spar_rad,
                    ballast_rad: estimate.ballast_rad,
                    spar_rate_rad_s: estimate.spar_rate_rad_s,
                    ballast_rate_rad_s: estimate.ballast_rate_rad_s,
                },
                supply_v,
            ),
            _ => 0.0,
        };
        self.limits.set(Limit::Voltage, drive_v.abs() >= drive_max_v);
        self.limits
            .set(Limit::Reference, (self.speed.reference_m_s() - speed_m_s).abs() > 0.01);
        self.voltage_v = [drive_v - turn_v, drive_v + turn_v, camera_v];
    }

    /// Stage 4: current limits, battery compensation, duties; opens the bridges if anything is not a number.
    pub fn actuate(&mut self, sample: &Sample, sensed: &Sensed, estimate: &Estimate) -> Output {
        let battery_v = self.battery.value();
        let mut actuation = Actuation::SAFE;
        if self.arming.mode() != Mode::Disarmed {
            for motor in [Motor::Left, Motor::Right, Motor::Camera] {
                let i = motor as usize;
                let limited = self.motor_limits[i].limit(self.voltage_v[i], sensed.relative_rate_rad_s[i]);
                let limit = [Limit::LeftCurrent, Limit::RightCurrent, Limit::Camera][i];
                self.limits.set(limit, limited.by_current);
                self.voltage_v[i] = limited.voltage_v;
                actuation.duty[i] = duty(limited.voltage_v, battery_v);
            }
            let finite = self.voltage_v.iter().all(|v| v.is_finite()) && battery_v.is_finite();
            if finite {
                actuation.enable = true;
            } else {
                self.arming.trip(Fault::NotFinite);
                actuation = Actuation::SAFE;
            }
        }
        self.applied = actuation;
        self.tick = self.tick.wrapping_add(1);
        self.last_time_us = Some(sample.time_us);
        Output {
            actuation,
            telemetry: Telemetry {
                tick: self.tick,
                time_us: sample.time_us,
                mode: self.arming.mode(),
                faults: self.arming.latched(),
                blockers: self.arming.blockers(),
                limits: self.limits,
                estimate: *estimate,
                speed_reference_m_s: self.speed.reference_m_s(),
                yaw_rate_reference_rad_s: self.steering.reference_rad_s(),
                voltage_v: self.voltage_v,
                current_a: sensed.current_a,
                battery_v,
                late_ticks: self.late_ticks,
                refused_arms: self.arming.refused(),
            },
        }
    }

    /// The faults whose cause is there in this tick.
    fn faults(&mut self, sample: &Sample, sensed: &Sensed, estimate: &Estimate, command: &Command) -> FaultSet {
        let limits = self.thresholds;
        let battery_v = self.battery.value();
        let mut faults = FaultSet::EMPTY;

        let gap_us = self.last_time_us.map_or(0, |last| sample.time_us.saturating_sub(last));
        if gap_us > LATE_US {
            self.late_ticks = self.late_ticks.wrapping_add(1);
        }
        faults.set(Fault::DeadlineMissed, gap_us > MISSED_US);

        faults.set(Fault::EmergencyStop, sample.emergency_stop);
        faults.set(Fault::BridgeBreak, sample.bridge_break);

        let chassis = self.chassis_watch.update(&sample.chassis_imu);
        faults.set(Fault::ImuStale, chassis == ImuHealth::Stale);
        faults.set(
            Fault::ImuImplausible,
            chassis == ImuHealth::Implausible || estimate.contradicted,
        );
        if self.camera.is_some() {
            faults.set(
                Fault::SparImu,
                self.spar_watch.update(&sample.spar_imu) != ImuHealth::Good,
            );
            faults.set(Fault::SparAngle, estimate.spar_rad.abs() > limits.spar_max_rad);
        }

        faults.set(Fault::EncoderStale, sample.encoder_age_us > limits.sensor_timeout_us);
        let motors = if self.camera.is_some() {
            MOTORS
        } else {
            Motor::Camera as usize
        };
        let mut implausible = false;
        for (i, watch) in self.encoder_watches.iter_mut().enumerate().take(motors) {
            // The camera's idle bridge holds 0 V, which is as good a test as any other voltage.
            let applied = self.applied.enable.then(|| voltage(self.applied.duty[i], battery_v));
            implausible |= watch.update(
                sample.encoder_counts[i],
                applied,
                sensed.current_a[i],
                sensed.relative_rate_rad_s[i],
            );
        }
        faults.set(Fault::EncoderImplausible, implausible);

        let over = sensed.current_a.iter().any(|a| a.abs() > limits.overcurrent_a);
        faults.set(Fault::Overcurrent, self.overcurrent.update(over));
        faults.set(
            Fault::BatteryLow,
            self.battery_low.update(battery_v < limits.battery_min_v),
        );
        faults.set(
            Fault::BatteryHigh,
            self.battery_high.update(battery_v > limits.battery_max_v),
        );
        faults.set(Fault::AnalogStale, sample.analog_age_us > limits.sensor_timeout_us);

        faults.set(Fault::ArmAngle, estimate.phi_rad.abs() > limits.phi_max_rad);
        faults.set(Fault::NotFinite, !estimate.is_finite());
        // A command that is not a number is no command.
        let believable = command.speed_m_s.is_finite() && command.yaw_rate_rad_s.is_finite();
        faults.set(
            Fault::CommandTimeout,
            !believable || command.age_us > limits.command_timeout_us,
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
        let neutral = command.speed_m_s == 0.0 && command.yaw_rate_rad_s == 0.0;
        blockers.set(Blocker::CommandNotNeutral, !neutral);
        blockers.set(Blocker::Parameters, command.parameters_pending);
        blockers
    }
}
