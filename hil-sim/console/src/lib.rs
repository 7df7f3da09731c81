//! The console's WebAssembly module, which the page calls.
//!
//! The page loads the module twice. One instance, in a worker, is a board with its simulated vehicle
//! ([`simulation::Simulation`]). The other instance is the host's end of the link
//! ([`operator_link::OperatorLink`]) to any board. The page itself only moves bytes and draws. [`exports`]
//! has the functions that the page calls.
// Not `forbid`: the functions are exported by name (exports).
#![deny(unsafe_code)]

pub mod exports;
pub mod heard;
pub mod operator_link;
pub mod page_memory;
pub mod parameter_work;
pub mod recording;
pub mod replay;
pub mod simulation;
pub mod surface;
pub mod vocabulary;
