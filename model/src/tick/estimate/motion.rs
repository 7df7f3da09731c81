//! The motion that the sensors show.

/// The motion that gyro and encoders show in one tick.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct MeasuredMotion {
    pub(super) phi_rate_rad_s: f32,
    pub(super) theta_rate_rad_s: f32,
    /// Speed and acceleration of the axle under the assumption that the wheels roll.
    pub(super) wheels_m_s: f32,
    pub(super) wheels_m_s2: f32,
    pub(super) yaw_rate_rad_s: f32,
    /// Yaw rate that the wheels show.
    pub(super) wheels_yaw_rad_s: f32,
    /// Sine of the axle's roll: positive with its left end up.
    pub(super) sin_roll: f32,
}
