//! The last faults, kept over resets in a flash of their own.
//!
//! Each fault is one item of a power-fail-safe store, so a power cut loses at most the fault that was being written. The
//! task writes only while the vehicle is disarmed, and nobody waits for it.

mod store;
mod task;

pub use store::FaultStore;
pub use task::run;

#[cfg(test)]
mod tests;
