//! The firmware under test: its build, its ELF, its log and its flight record.

pub mod build;
mod firmware;
pub mod flight;
pub(crate) mod log;

pub use firmware::Firmware;
pub use log::LogReader;
