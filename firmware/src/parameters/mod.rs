//! Stored parameters: the vehicle's parameters in flash. They are checked, identified by name, and changed over the
//! link.
//!
//! A set is stored whole: after a power cut at any moment the flash contains either the old or the new set, never a
//! mixture. A set of other firmware is read by the parameters' names. The firmware believes a set only if the
//! checksums hold, every value is in range, and the set is consistent. If the flash is not empty but contains no
//! set that the firmware believes, the vehicle uses the built-in set and must not arm before a set is stored.

mod encoding;
mod numbered;
mod stage;
mod store;
mod task;
mod tolerant_flash;
mod version_1;

pub use numbered::schema;
pub use store::{BootOutcome, Booted, Disbelief, NotStored, ParameterStore};
pub use task::{boot, run};

#[cfg(test)]
mod tests;
