//! The firmware's own tasks in virtual time, in a closed loop with the plant: a virtual board, its
//! scenarios and their metrics, and the host's end of the link.
//!
//! The package uses no terminal, no plots, no serial port, and no files except scenario and vehicle
//! files. It therefore also compiles for `wasm32-unknown-unknown`, where a drive equals the native
//! drive bit for bit.
// Not `forbid`: the time driver's two entry points are exported by name (board::time).
#![deny(unsafe_code)]

pub mod ages;
pub mod board;
pub mod campaign;
pub mod link_client;
pub mod records;
pub mod scenario;
pub mod words;
