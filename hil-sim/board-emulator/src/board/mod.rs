//! What is wired to the part's pins.

mod bridges;
mod drive_board;
pub mod gaps;
mod imu;
mod pins;
mod wire;

pub use crate::part::{BridgeBreak, MemoryFault, Part, PartSetup};
pub use drive_board::{DriveBoard, INSTRUCTIONS_PER_SECOND};
pub use pins::{BridgeOutput, ImuSensed, MOTORS, SensedAtPins};
pub use wire::LinkLine;
