//! The emulated STM32H743 as this board needs it: the emulator's models, some of them replaced and some
//! left out.

mod bridge_timer;
mod converter;
mod faulty_core;
mod mcu;
mod multiplexer;
mod setup;
mod timer;
mod watchdog;
mod waveform;

pub use converter::RippleSource;
pub use mcu::Part;
pub use setup::{BridgeBreak, MemoryFault, PartSetup};
