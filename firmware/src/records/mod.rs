//! Compact records of every tick, for the stream over the link and for the last seconds before a fault.

pub mod channels;
pub mod codec;
pub mod recorder;
pub mod ring;
