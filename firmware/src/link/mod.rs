//! The link to the host: typed messages in checked frames, the same code on both ends.
//!
//! A frame is `COBS(postcard(message) ++ CRC-16) ++ 0`. Anything else on the wire is counted and
//! forgotten: it moves no motor and changes no state.

pub mod frame;
pub mod message;
pub mod receive;
pub mod send;
