//! The firmware's own tasks in lockstep virtual time, closed around the plant: a board, the scenarios it
//! drives, their metrics, and the host's end of the link.
//!
//! No terminal, no files but scenario and vehicle files, no plots, no serial port: this package also
//! compiles for `wasm32-unknown-unknown` and flies there bit for bit as natively.
// Not `forbid`: the time driver's two entry points are exported by name (board::time).
#![deny(unsafe_code)]

pub mod ages;
pub mod board;
pub mod campaign;
pub mod link_client;
pub mod records;
pub mod scenario;
pub mod words;
