//! The board's end of the link: one task receives the host's messages, one sends the board's.

pub mod receive;
pub mod send;
