//! The vehicle's estimates of its own motion: angles, rates, slope and pose from encoders, gyros and
//! accelerometers.
//!
//! A gearbox encoder measures theta + phi (wheel relative to the arm), never theta. A gyro on the arm
//! measures phi'. The accelerometer gives phi only after the accelerations of the axle and of the arm
//! have been subtracted. No sensor measures the slope; the estimator derives the slope from the
//! balance of forces.

pub mod accelerometer_offset;
pub mod alignment;
pub mod exchanged;
pub mod facing;
pub mod ground_speed;
pub mod heading;
pub mod odometry;
pub mod rate_filter;
mod result;
pub mod roll;
pub mod rolling_yaw;
pub mod slope;
pub mod spar_facing;
pub mod stall;
pub mod stillness;
pub mod tilt;
pub mod traction;
pub mod trust;
pub mod weight;

pub use result::Estimate;
