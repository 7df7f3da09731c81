//! Supervision decides whether a motor may move: sensor plausibility, faults and blockers, arming.
//!
//! The rule: no defined or undefined input moves a motor that is not armed, and any fault leads to the
//! safe state (every bridge open) in bounded time. Faults are numbered, latched, and cleared by the operator;
//! limits are not faults.

pub mod arming;
mod blocking;
pub mod codes;
mod debounce;
pub mod motor_watch;
pub mod plausibility;
pub mod supervisor;
mod whirl_watch;
