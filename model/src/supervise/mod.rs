//! Who may move a motor, and when: sensor plausibility, arming, faults.
//!
//! The rule: no defined or undefined input moves a motor that is not armed, and any fault reaches the
//! safe state (every bridge open) in bounded time. Faults are numbered, latched and cleared by hand;
//! limits are not faults.

pub mod arming;
pub mod codes;
pub mod plausibility;
pub mod supervisor;
