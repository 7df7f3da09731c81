//! The board's end of the link: one task receives the host's messages, one sends the board's.

mod about;
pub mod receive;
pub mod send;
pub mod session;

pub use about::{VERSION, about};
