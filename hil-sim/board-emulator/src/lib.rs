//! The release firmware on an emulated drive board, with a vehicle closed around it.
//!
//! The ELF is the one that is flashed, unmodified: start-up code, clock tree, timers, DMA, interrupts,
//! memory layout and log are all under test. [`Emulation`] runs it in virtual time; a
//! [`plant::ClosedPlant`] answers the bridges' voltages with encoder edges, IMU registers and voltages
//! on analogue pins; [`gaps`] lists every place where the emulated part could not stand in for the
//! real one.
//!
//! Time is a fixed number of instructions a second, so the emulator counts work, not cycles: it shows
//! what the firmware does and when in its own time, not how long a cache miss takes.

pub mod backend;
pub mod board;
mod bridge_timer;
pub mod build;
mod conductor;
pub mod elf;
mod emulation;
mod error;
pub mod flight;
pub mod gaps;
mod imu;
pub mod link;
mod multiplexer;
mod part;
pub mod plant;
mod rtt;
pub mod stored;
mod timer;
pub mod vehicle;
mod watchdog;

pub use conductor::{Hit, Stopped, Work};
pub use elf::Firmware;
pub use emulation::{Emulation, Frozen, Settings};
pub use error::Error;
/// An instant of virtual time in ns.
pub use rigless::time::VirtualNanos as Instant;

/// One millisecond of virtual time in ns.
pub const MS: u64 = 1_000_000;
/// One microsecond of virtual time in ns.
pub const US: u64 = 1_000;
