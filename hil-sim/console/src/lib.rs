//! The console's WebAssembly: what its page calls.
//!
//! The page loads the module twice. One instance, in a worker, is a board with its simulated vehicle
//! ([`simulation::Simulation`]); the other is the host's end of the link ([`operator_link::OperatorLink`]), whatever board
//! its bytes come from. The page itself moves bytes and draws. [`exports`] are the functions that it calls.
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
