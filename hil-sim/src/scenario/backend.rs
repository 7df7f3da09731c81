//! What runs a scenario: the virtual board, or any other board around the same plant.

use model::vehicle::Vehicle;

use crate::plant::Plant;
use crate::virtual_board::{VirtualBoard, VirtualBoardError};

/// A board with its vehicle in virtual time.
pub trait Backend {
    /// Time since boot, us.
    fn now_us(&self) -> u64;
    /// Runs until `until_us` since boot.
    fn run_until(&mut self, until_us: u64);
    /// Sends bytes to the board's link.
    fn send(&mut self, bytes: &[u8]);
    /// Takes the bytes that the board has sent.
    fn receive(&mut self) -> Vec<u8>;
    /// Does something with the plant as it is now.
    fn plant(&mut self, act: &mut dyn FnMut(&mut Plant));
    /// Presses or releases the emergency stop.
    fn set_emergency_stop(&mut self, pressed: bool);
    /// Whether any bridge drives its motor.
    fn bridges_on(&mut self) -> bool;
    /// Takes the log lines since the last call.
    fn log(&mut self) -> Vec<String>;
}

/// The virtual board as a back end.
pub struct VirtualBackend {
    /// The board.
    pub board: VirtualBoard,
}

impl VirtualBackend {
    /// Boots a virtual board.
    ///
    /// # Errors
    /// As [`VirtualBoard::boot`].
    pub fn boot(vehicle: &Vehicle<f64>, plant: Plant) -> Result<Self, VirtualBoardError> {
        VirtualBoard::boot(vehicle, plant).map(|board| Self { board })
    }
}

impl Backend for VirtualBackend {
    fn now_us(&self) -> u64 {
        self.board.now_us()
    }

    fn run_until(&mut self, until_us: u64) {
        self.board.run_until(until_us);
    }

    fn send(&mut self, bytes: &[u8]) {
        self.board.send(bytes);
    }

    fn receive(&mut self) -> Vec<u8> {
        self.board.receive()
    }

    fn plant(&mut self, act: &mut dyn FnMut(&mut Plant)) {
        self.board.world(|world| act(&mut world.plant));
    }

    fn set_emergency_stop(&mut self, pressed: bool) {
        self.board.world(|world| {
            world.emergency_stop = pressed;
            if pressed {
                world.trip();
            }
        });
    }

    fn bridges_on(&mut self) -> bool {
        self.board.world(|world| world.bridges_on())
    }

    fn log(&mut self) -> Vec<String> {
        crate::virtual_board::log::take()
    }
}
