//! The vehicle application: the tasks that move data between the hardware and the `model`.
//!
//! Nothing here decides: every decision is a pure step of `model`. Nothing here names a part or a
//! pin: the board (a target-only binary, or the host's virtual board) implements [`hardware`] and the
//! embedded-hal traits.
#![cfg_attr(not(test), no_std)]
#![forbid(unsafe_code)]

pub mod hardware;
