//! Stored parameters: the vehicle's numbers in flash, versioned, checked, and changed over the link.
//!
//! The whole set is one item of a power-fail-safe store: after a power cut at any moment the flash holds
//! either the old set or the new one, never a mixture. The firmware believes a set only if the store's
//! checksum holds, the set's schema (names and ranges of every field) is this firmware's, every value is in
//! range, and the set is consistent. Otherwise the vehicle drives by the built-in set, and the log says so.

mod numbered;
mod store;
mod task;
mod tolerant_flash;

pub use numbered::schema;
pub use store::{NoSet, ParameterStore};
pub use task::{boot, run};
pub(crate) use tolerant_flash::Tolerant;

#[cfg(test)]
mod tests;
