//! The release firmware on an emulated drive board, with a vehicle closed around it.
//!
//! The ELF is the unmodified file that is flashed onto the board. Start-up code, clock tree, timers, DMA,
//! interrupts, memory layout and log are all under test.
//!
//! | Module | Purpose | Uses |
//! |---|---|---|
//! | [`time`], [`error`](Error) | units of virtual time; why a run fails | |
//! | `part` | the emulated STM32H743, as this board needs it | |
//! | [`board`] | what is wired to the part's pins; [`board::gaps`], where the emulated part falls short | `part` |
//! | [`vehicle`] | what moves around the board: the plant, a test bench, stored parameters | `board` |
//! | [`elf`] | the firmware under test: how it is built and read, its log, its flight record | |
//! | [`run`] | a run in virtual time, and scenarios driven through it | all of the above |
//!
//! A second of virtual time is a fixed number of instructions. The emulator therefore shows what the firmware
//! does, and when in virtual time. The emulator does not show how long a cache miss takes.

pub mod board;
pub mod elf;
mod error;
mod part;
pub mod run;
pub mod time;
pub mod vehicle;

pub use error::Error;
