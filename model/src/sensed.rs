//! The readings of one tick in SI units.

use crate::analog::Analog;
use crate::estimate::tilt::TiltReading;
use crate::sample::{ImuSample, MOTORS};

/// One tick's readings: in SI units for the estimator and the laws, and as raw words where supervision judges them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sensed {
    /// Time of the sample, us since boot.
    pub time_us: u64,
    /// Rate of each encoder at the gearbox output, rad/s: wheel relative to the arm (theta' + phi'), ballast
    /// relative to the spar.
    pub relative_rate_rad_s: [f32; MOTORS],
    /// Advance of each encoder since the last tick, rad at the output.
    pub relative_advance_rad: [f32; MOTORS],
    /// Angle of the ballast relative to the spar since boot, rad at the output.
    pub ballast_turned_rad: f32,
    /// Arm IMU in the plane of the wheels.
    pub arm: TiltReading,
    /// Specific force at the arm IMU to the left, m/s^2.
    pub arm_force_y_m_s2: f32,
    /// Angular rate of the arm about its x and z axes, rad/s.
    pub arm_gyro_xz_rad_s: [f32; 2],
    /// Spar IMU in the plane of the wheels.
    pub spar: TiltReading,
    /// Specific force at the spar IMU to the left, m/s^2.
    pub spar_force_y_m_s2: f32,
    /// Angular rate of the spar about its x axis, rad/s.
    pub spar_gyro_x_rad_s: f32,
    /// Filtered battery voltage, V.
    pub battery_v: f32,
    /// Voltage of the supply that the bridges switch, V: the measured voltage, but at least the file's `minimum_v`. A
    /// supply below `minimum_v` is forbidden and leads to a stop, and a reading below `minimum_v` is as likely to be
    /// false. Duties that are computed for too low a supply voltage drive too hard, at most by the ratio of the true
    /// supply to `minimum_v`.
    pub supply_v: f32,
    /// Motor currents, A; 0 for a motor that the vehicle does not have.
    pub current_a: [f32; MOTORS],
    /// Every analogue input in this tick, in SI units, unfiltered.
    pub analog: Analog<f32>,
    /// Encoder counts, raw.
    pub encoder_counts: [i64; MOTORS],
    /// Age of the encoder counts, us.
    pub encoder_age_us: u32,
    /// Raw words and age of the arm IMU.
    pub arm_imu: ImuSample,
    /// Raw words and age of the spar IMU.
    pub spar_imu: ImuSample,
    /// Age of the analogue readings, us.
    pub analog_age_us: u32,
    /// The emergency stop is pressed.
    pub emergency_stop: bool,
    /// The break input's wire asks for a break: the stop's second contact is open, or a bridge driver reports a fault.
    pub break_input: bool,
    /// The bridges' hardware break has tripped.
    pub bridge_break: bool,
    /// Findings of the board's self-test at boot: bit n is the blocker of number n.
    pub board_blockers: u32,
}
