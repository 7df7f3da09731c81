//! Gravity.

/// Acceleration of gravity, m/s^2.
pub const GRAVITY_M_S2: f64 = 9.81;
/// The same for the vehicle's own code, which computes in single precision.
pub(crate) const G: f32 = GRAVITY_M_S2 as f32;
