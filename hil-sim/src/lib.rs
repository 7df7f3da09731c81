//! The biplanar bicycle on the host: the plant and its sensors, a virtual board that runs the
//! firmware's own tasks in lockstep virtual time, scenarios, and the analysis of the vehicle class.
// Not `forbid`: the time driver's two entry points are exported by name (virtual_board::time).
#![deny(unsafe_code)]

pub mod analysis;
pub mod cli;
pub mod error;
pub mod figures;
pub mod html;
pub mod link_client;
pub mod plant;
pub mod plot;
pub mod scenario;
pub mod virtual_board;
