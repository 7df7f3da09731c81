//! A virtual drive board: the firmware's own tasks in lockstep virtual time, closed around the plant.

pub mod pipe;
pub mod time;
