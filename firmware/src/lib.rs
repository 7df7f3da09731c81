//! The vehicle application: the tasks that move data between the hardware and the `model`.
//!
//! This crate decides nothing: every decision is a pure step of `model`. It names no part and no pin: a
//! board (the board's own binary, or the host's virtual board) implements the traits of [`hardware`] and of
//! embedded-hal, makes one [`topics::Topics`], and spawns the tasks:
//!
//! | task | rate | executor |
//! |---|---|---|
//! | [`imu::run`], once for the arm and once for the spar | 1 kHz | control (interrupt) |
//! | [`drive::run`] | 1 kHz | control (interrupt) |
//! | [`watchdog::run`] | 200 Hz | control (interrupt) |
//! | [`analog::run`] | 1 kHz, halfway between the ticks | control (interrupt) |
//! | [`link::receive::run`], [`link::send::run`] | as bytes come; at the host's rate | thread |
//! | [`parameters::run`] | on request | thread |
//! | [`fault_history::run`] | on a fault | thread |
//! | [`update::run`] | on request | thread |
//! | [`log_task::run`] | 20 Hz; logs one line per second and one per change | thread |
//!
//! A board may add tasks of its own: the drive boards' start-up also spawns one for the button.
#![cfg_attr(not(test), no_std)]
#![forbid(unsafe_code)]

// First: every module below may use its macros.
#[macro_use]
mod logging;

pub mod analog;
mod blocking;
pub mod bridge_legs;
pub mod built_in;
pub mod checkins;
pub mod drive;
pub mod drive_board;
pub mod encoders;
pub mod events;
pub mod fault_history;
pub mod fault_list;
pub mod flash_region;
pub mod flight_record;
pub mod hardware;
pub mod image;
pub mod image_seal;
pub mod imu;
pub mod link;
pub mod log_task;
pub mod orders;
pub mod parameters;
pub mod protocol;
pub mod records;
#[cfg(test)]
mod test_flash;
mod ticks;
pub mod topics;
pub mod update;
pub mod watchdog;
