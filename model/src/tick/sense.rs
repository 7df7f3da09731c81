//! Stage 1: raw counts to SI units.

use crate::estimate::rate_filter::RateFilter;
use crate::estimate::tilt::TiltReading;
use crate::sample::{ImuRaw, MOTORS, Sample, analog_scale, imu_scale};
use crate::tick::TICK_S;
use crate::vehicle::{GRAVITY_M_S2, Vehicle};

/// One tick's sensors in SI units.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sensed {
    /// Rate of each encoder at the gearbox output: wheel relative to the arm, theta' + phi'; for the
    /// camera the ballast relative to the spar. rad/s.
    pub relative_rate_rad_s: [f32; MOTORS],
    /// Advance of each encoder since the last tick, rad at the output.
    pub relative_advance_rad: [f32; MOTORS],
    /// Angle of the ballast relative to the spar since boot, rad at the output.
    pub ballast_turned_rad: f32,
    /// Arm IMU in the plane of the wheels.
    pub arm: TiltReading,
    /// Specific force to the left, m/s^2.
    pub arm_force_y_m_s2: f32,
    /// Arm gyro about its x and z axes, rad/s.
    pub arm_gyro_xz_rad_s: [f32; 2],
    /// Spar IMU in the plane of the wheels.
    pub spar: TiltReading,
    /// Battery voltage, V.
    pub battery_v: f32,
    /// Motor currents, A.
    pub current_a: [f32; MOTORS],
}

/// Scales and counters of stage 1.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Sensing {
    filters: [RateFilter; MOTORS],
    rad_per_count: [f32; MOTORS],
    last_counts: Option<[i64; MOTORS]>,
    ballast_start: i64,
}

const GYRO_RAD_S: f32 = core::f32::consts::PI / 180.0 / imu_scale::GYRO_LSB_PER_DEG_S;
const ACCEL_M_S2: f32 = GRAVITY_M_S2 as f32 / imu_scale::ACCEL_LSB_PER_G;

impl Sensing {
    pub(super) fn new(vehicle: &Vehicle<f32>) -> Self {
        let p = vehicle.parameters();
        let tau = p.estimator.wheel_rate_time_constant_s;
        let scale = |counts: f32, ratio: f32| 2.0 * core::f32::consts::PI / (counts * ratio);
        let drive = scale(p.drive_motor.encoder_counts_per_rev, p.drive_motor.gear_ratio);
        let camera = p
            .camera
            .as_ref()
            .map_or(drive, |(_, m)| scale(m.encoder_counts_per_rev, m.gear_ratio));
        Self {
            filters: [RateFilter::new(TICK_S, tau); MOTORS],
            rad_per_count: [drive, drive, camera],
            last_counts: None,
            ballast_start: 0,
        }
    }

    /// This stage with the encoder counts of another one, from which the next tick's advance is taken.
    pub(super) fn with_counts_of(self, other: &Self) -> Self {
        Self {
            last_counts: other.last_counts,
            ballast_start: other.ballast_start,
            ..self
        }
    }

    pub(super) fn step(&mut self, sample: &Sample) -> Sensed {
        let counts = sample.encoder_counts;
        let last = self.last_counts.unwrap_or_else(|| {
            self.ballast_start = counts[2];
            counts
        });
        self.last_counts = Some(counts);
        let mut relative_rate_rad_s = [0.0; MOTORS];
        let mut relative_advance_rad = [0.0; MOTORS];
        for (i, filter) in self.filters.iter_mut().enumerate() {
            filter.update(counts[i]);
            relative_rate_rad_s[i] = filter.rate_per_s() * self.rad_per_count[i];
            relative_advance_rad[i] = counts[i].wrapping_sub(last[i]) as f32 * self.rad_per_count[i];
        }
        let gyro = |raw: &ImuRaw, axis: usize| f32::from(raw.gyro[axis]) * GYRO_RAD_S;
        let arm = &sample.chassis_imu.raw;
        Sensed {
            relative_rate_rad_s,
            relative_advance_rad,
            ballast_turned_rad: counts[2].wrapping_sub(self.ballast_start) as f32 * self.rad_per_count[2],
            arm: tilt_reading(arm),
            arm_force_y_m_s2: f32::from(arm.accel[1]) * ACCEL_M_S2,
            arm_gyro_xz_rad_s: [gyro(arm, 0), gyro(arm, 2)],
            spar: tilt_reading(&sample.spar_imu.raw),
            battery_v: f32::from(sample.battery) * analog_scale::BATTERY_V_PER_COUNT,
            current_a: sample.current.map(|raw| {
                (i32::from(raw) - i32::from(analog_scale::CURRENT_ZERO_COUNT)) as f32
                    * analog_scale::CURRENT_A_PER_COUNT
            }),
        }
    }
}

/// The in-plane part of an IMU reading. Swinging forward is turning about -y.
fn tilt_reading(raw: &ImuRaw) -> TiltReading {
    TiltReading {
        rate_rad_s: -f32::from(raw.gyro[1]) * GYRO_RAD_S,
        force_x_m_s2: f32::from(raw.accel[0]) * ACCEL_M_S2,
        force_z_m_s2: f32::from(raw.accel[2]) * ACCEL_M_S2,
    }
}
