//! Virtual time: the unit of every span and instant of a run.

/// An instant of virtual time in ns since power-up.
pub use rigless::time::VirtualNanos as Instant;

/// One millisecond of virtual time in ns.
pub const MS: u64 = 1_000_000;
/// One microsecond of virtual time in ns.
pub const US: u64 = 1_000;
