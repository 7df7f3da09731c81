//! What the vehicle estimates of itself: angles, rates, slope and pose from encoders, gyros and accelerometers.
//!
//! A gearbox encoder measures theta + phi (wheel relative to the arm), never theta; a gyro on the arm
//! gives phi'; the accelerometer gives phi only once the accelerations of the axle and of the arm are
//! taken out of it. No sensor measures the slope: it follows from the balance of forces.

pub mod alignment;
pub mod exchanged;
pub mod facing;
pub mod heading;
pub mod odometry;
pub mod rate_filter;
mod result;
pub mod slope;
pub mod spar_facing;
pub mod stall;
pub mod stillness;
pub mod tilt;
pub mod traction;
pub mod trust;

pub use result::Estimate;
