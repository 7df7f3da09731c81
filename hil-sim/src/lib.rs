//! The biplanar bicycle on the host: the plant and its sensors, a virtual board that runs the
//! firmware's own tasks in lockstep virtual time, scenarios, and the analysis of the vehicle class.
#![forbid(unsafe_code)]

pub mod analysis;
pub mod cli;
pub mod error;
pub mod plot;
