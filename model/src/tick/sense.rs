//! Stage 1: raw counts to SI units.

use crate::analog::{Analog, AnalogScale};
use crate::board::BoardScales;
use crate::bounded::Bounded;
use crate::estimate::rate_filter::{LowPass, RateFilter, nearest};
use crate::estimate::tilt::TiltReading;
use crate::sample::{ImuRaw, MOTORS, Motor, Sample, TICK_S};
use crate::sensed::Sensed;
use crate::vehicle::{G, MotorParameters, Vehicle};

const BATTERY_TIME_CONSTANT_S: f32 = 0.005;
const BALLAST: usize = Motor::Ballast as usize;

/// Scales, filters and counters of stage 1.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Sensing {
    filters: [RateFilter; MOTORS],
    rad_per_count: [f32; MOTORS],
    imu: ImuUnits,
    analog: Analog<AnalogScale>,
    battery: LowPass,
    battery_min_v: f32,
    last_counts: Option<[i64; MOTORS]>,
    ballast_start: i64,
    /// Number of motors of the vehicle: without a spar nothing is wired to the ballast motor's inputs.
    motors: usize,
}

impl Sensing {
    pub(super) fn new(vehicle: &Vehicle<f32>, scales: &BoardScales) -> Self {
        let p = vehicle.parameters();
        let tau = p.estimator.wheel_rate_time_constant_s;
        let rad_per_count = |motor: &MotorParameters<f32>| {
            2.0 * core::f32::consts::PI / (motor.encoder_counts_per_rev * motor.gear_ratio)
        };
        let drive = rad_per_count(&p.drive_motor);
        let ballast = p.spar.as_ref().map_or(drive, |(_, motor)| rad_per_count(motor));
        Self {
            filters: [RateFilter::new(TICK_S, tau); MOTORS],
            rad_per_count: [drive, drive, ballast],
            imu: ImuUnits {
                rad_s_per_lsb: core::f32::consts::PI / 180.0 / scales.imu.gyro_lsb_per_deg_s,
                m_s2_per_lsb: G / scales.imu.accel_lsb_per_g,
            },
            analog: scales.analog,
            battery: LowPass::new(TICK_S, BATTERY_TIME_CONSTANT_S),
            battery_min_v: p.battery.minimum_v,
            last_counts: None,
            ballast_start: 0,
            motors: if p.spar.is_some() { MOTORS } else { BALLAST },
        }
    }

    /// This stage with the supply voltage and the encoder counts of another stage; the next tick's advance starts
    /// from these counts.
    pub(super) fn with_counts_of(self, other: &Self) -> Self {
        Self {
            last_counts: other.last_counts,
            ballast_start: other.ballast_start,
            battery: other.battery,
            ..self
        }
    }

    pub(super) fn step(&mut self, sample: &Sample) -> Sensed {
        let counts = sample.encoder_counts;
        let analog = sample.analog.with(&self.analog, |raw, scale| scale.value(raw));
        let last = self.last_counts.unwrap_or_else(|| {
            self.ballast_start = counts[BALLAST];
            self.battery.reset(analog.battery_voltage);
            counts
        });
        self.last_counts = Some(counts);
        self.battery.update(analog.battery_voltage);
        let mut relative_rate_rad_s = [0.0; MOTORS];
        let mut relative_advance_rad = [0.0; MOTORS];
        for (i, filter) in self.filters.iter_mut().enumerate().take(self.motors) {
            filter.update(counts[i]);
            relative_rate_rad_s[i] = filter.rate_per_s() * self.rad_per_count[i];
            relative_advance_rad[i] = nearest(counts[i].wrapping_sub(last[i])) * self.rad_per_count[i];
        }
        let arm = &sample.arm_imu.raw;
        let mut current_a = [0.0; MOTORS];
        for (current, measured) in current_a.iter_mut().zip(analog.currents()).take(self.motors) {
            *current = measured;
        }
        Sensed {
            time_us: sample.time_us,
            relative_rate_rad_s,
            relative_advance_rad,
            ballast_turned_rad: nearest(counts[BALLAST].wrapping_sub(self.ballast_start)) * self.rad_per_count[BALLAST],
            arm: self.imu.tilt(arm),
            arm_force_y_m_s2: self.imu.force_m_s2(arm, 1),
            arm_gyro_xz_rad_s: [self.imu.rate_rad_s(arm, 0), self.imu.rate_rad_s(arm, 2)],
            spar: self.imu.tilt(&sample.spar_imu.raw),
            spar_force_y_m_s2: self.imu.force_m_s2(&sample.spar_imu.raw, 1),
            spar_gyro_x_rad_s: self.imu.rate_rad_s(&sample.spar_imu.raw, 0),
            battery_v: self.battery.value(),
            supply_v: self.battery.value().bounded(self.battery_min_v, f32::MAX),
            current_a,
            analog,
            encoder_counts: counts,
            encoder_age_us: sample.encoder_age_us,
            arm_imu: sample.arm_imu,
            spar_imu: sample.spar_imu,
            analog_age_us: sample.analog_age_us,
            emergency_stop: sample.emergency_stop,
            break_input: sample.break_input,
            bridge_break: sample.bridge_break,
            board_blockers: sample.board_blockers,
        }
    }
}

/// SI units of one count of an IMU.
#[derive(Debug, Clone, Copy, PartialEq)]
struct ImuUnits {
    rad_s_per_lsb: f32,
    m_s2_per_lsb: f32,
}

impl ImuUnits {
    fn rate_rad_s(self, raw: &ImuRaw, axis: usize) -> f32 {
        f32::from(raw.gyro[axis]) * self.rad_s_per_lsb
    }

    fn force_m_s2(self, raw: &ImuRaw, axis: usize) -> f32 {
        f32::from(raw.accel[axis]) * self.m_s2_per_lsb
    }

    /// The in-plane part of an IMU reading. A forward swing is a rotation about -y.
    fn tilt(self, raw: &ImuRaw) -> TiltReading {
        TiltReading {
            rate_rad_s: -self.rate_rad_s(raw, 1),
            force_x_m_s2: self.force_m_s2(raw, 0),
            force_z_m_s2: self.force_m_s2(raw, 2),
        }
    }
}
