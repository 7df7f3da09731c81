//! The seam between the emulated board and the vehicle around it.

use crate::board::{BridgeState, MOTORS, Sensed};

/// A vehicle around the board.
pub trait ClosedPlant: Send + Sync {
    /// Advances the vehicle by `seconds` with the bridges in the given states; returns what its sensors then
    /// show.
    fn step(&mut self, seconds: f64, bridges: &[BridgeState; MOTORS]) -> Sensed;

    /// A copy for a second run from here on.
    fn fork(&self) -> Box<dyn ClosedPlant>;
}
