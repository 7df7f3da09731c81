//! The wire format, which both ends of the link share: typed messages in checked frames.
//!
//! A frame is `COBS(postcard(message) ++ CRC-16) ++ 0`. The receiver counts anything else on the wire and
//! drops it: such bytes move no motor and change no state.

mod board_status;
pub mod frame;
pub mod message;
mod stuffing;
mod update;
