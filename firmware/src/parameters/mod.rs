//! Stored parameters: the vehicle's numbers in flash, checked, known by name, and changed over the link.
//!
//! A set is stored whole: after a power cut at any moment the flash holds either the old set or the new one, never a
//! mixture. A set of other firmware is read by the parameters' names. The firmware believes a set only if the
//! checksums hold, every value is in range, and the set is consistent. If the flash holds something but no set that
//! the firmware believes, the vehicle has the built-in set and must not arm before a set is stored.

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
