//! The last faults, kept over resets in dedicated flash sectors.
//!
//! Each fault is one word of the flash, so a power cut loses at most the fault that was being written. The task writes
//! and erases only while the vehicle is disarmed, and no other task waits for it.

mod store;
mod task;

pub use store::{FaultNotStored, FaultStore};
pub use task::run;

#[cfg(test)]
mod tests;
