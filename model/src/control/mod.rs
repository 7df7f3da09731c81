//! The control laws: pure functions of what the vehicle senses and what it is asked for.

pub mod camera;
pub mod camera_law;
pub mod motor;
pub mod speed;
pub mod speed_law;
pub mod steering;
