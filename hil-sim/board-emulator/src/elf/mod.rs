//! The firmware under test: how it is built and read, its log, its flight record.

pub mod build;
mod firmware;
pub mod flight;
pub(crate) mod log;

pub use firmware::Firmware;
pub use log::LogReader;
