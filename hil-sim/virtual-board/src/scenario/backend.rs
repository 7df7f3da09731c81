//! The boards that can run a scenario: the virtual board, or any other board around the same plant.

use firmware::flight_record::FlightRecord;
use model::vehicle::Vehicle;

use crate::board::{VirtualBoard, VirtualBoardError};
use plant::{Glance, Plant};

/// A board and its vehicle at one instant, as seen from outside.
#[derive(Debug, Clone, Default)]
pub struct Observation {
    /// Time since the start, us.
    pub now_us: u64,
    /// Time at which the board's clock last started, with its last boot, us since the start.
    pub booted_us: u64,
    /// The true state of the vehicle.
    pub glance: Box<Glance>,
    /// Whether any bridge drives its motor.
    pub bridges_on: bool,
    /// Bytes that the board has sent since the previous observation.
    pub received: Vec<u8>,
}

/// A board with its vehicle in virtual time.
pub trait Backend {
    /// Time since the start, us.
    fn now_us(&self) -> u64;
    /// Time at which the board was last switched on, us since the start.
    fn booted_us(&self) -> u64;
    /// Runs through instants since the start, in us and in order, and calls `observe` at each instant.
    fn run_through(&mut self, instants_us: &[u64], observe: &mut dyn FnMut(&mut Observation));
    /// Keeps the records of the ticks from now on, for [`Backend::take_records`].
    fn keep_records(&mut self);
    /// Takes the records of the ticks since the last call, if they are kept.
    fn take_records(&mut self) -> Vec<FlightRecord>;
    /// States that nobody will read the records of the ticks over the link, so that a board may save the cost of
    /// making them.
    fn make_no_records(&mut self) {}
    /// Sends bytes to the board's link.
    fn send(&mut self, bytes: &[u8]);
    /// Calls `act` with the plant at the present time.
    fn plant(&mut self, act: &mut dyn FnMut(&mut Plant));
    /// Presses or releases the emergency stop.
    fn set_emergency_stop(&mut self, pressed: bool);
    /// Takes the log lines since the last call.
    fn log(&mut self) -> Vec<String>;
}

/// The virtual board as a backend.
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

    fn booted_us(&self) -> u64 {
        self.board.booted_us()
    }

    fn run_through(&mut self, instants_us: &[u64], observe: &mut dyn FnMut(&mut Observation)) {
        let mut observation = Observation::default();
        for &instant_us in instants_us {
            self.board.run_until(instant_us);
            observation.now_us = instant_us;
            observation.booted_us = self.board.booted_us();
            observation.received = self.board.receive();
            self.board.world(|world| {
                *observation.glance = world.plant.glance();
                observation.bridges_on = world.bridges_on();
            });
            observe(&mut observation);
        }
    }

    fn keep_records(&mut self) {
        self.board.world(|world| world.records = Some(Vec::new()));
    }

    fn take_records(&mut self) -> Vec<FlightRecord> {
        let kept = self.board.world(|world| world.records.as_mut().map(std::mem::take));
        kept.unwrap_or_default()
    }

    fn make_no_records(&mut self) {
        self.board.world(|world| world.records_for_host = false);
    }

    fn send(&mut self, bytes: &[u8]) {
        self.board.send(bytes);
    }

    fn plant(&mut self, act: &mut dyn FnMut(&mut Plant)) {
        self.board.world(|world| act(&mut world.plant));
    }

    fn set_emergency_stop(&mut self, pressed: bool) {
        self.board.world(|world| world.press_stop(pressed));
    }

    fn log(&mut self) -> Vec<String> {
        crate::board::log::take()
    }
}
