//! Scenarios on the emulated board: the same files, operator, trace and metrics as on the virtual one.

use std::sync::mpsc::channel;

use plant::Plant;
use virtual_board::scenario::{Backend, Observation};

use crate::vehicle::VehicleAtPins;
use crate::{Emulation, Error, Firmware, Settings};

/// The emulated board with hil-sim's plant around it.
pub struct EmulatedBackend<'a> {
    firmware: &'a Firmware,
    emulation: Emulation,
    vehicle: VehicleAtPins,
    log_lines: usize,
    /// Why the run could not go on; it stands still from then on.
    failure: Option<Error>,
}

impl<'a> EmulatedBackend<'a> {
    /// Powers the board up.
    ///
    /// # Errors
    /// As [`Emulation::power_on`].
    pub fn power_on(firmware: &'a Firmware, plant: Plant, settings: Settings) -> Result<Self, Error> {
        Self::power_on_with(firmware, plant, settings, &[])
    }

    /// Powers the board up with more in its flash: addresses and bytes, as an earlier run left them.
    ///
    /// # Errors
    /// As [`Emulation::power_on`].
    pub fn power_on_with(
        firmware: &'a Firmware,
        plant: Plant,
        settings: Settings,
        contents: &[(u64, Vec<u8>)],
    ) -> Result<Self, Error> {
        let vehicle = VehicleAtPins::new(plant);
        let emulation = Emulation::power_on_with(firmware, Box::new(vehicle.clone()), settings, contents)?;
        Ok(Self {
            firmware,
            emulation,
            vehicle,
            log_lines: 0,
            failure: None,
        })
    }

    /// The run itself, for what a scenario does not ask.
    ///
    /// # Errors
    /// Why it could not go on, where it could not.
    pub fn emulation(&mut self) -> Result<&mut Emulation, Error> {
        match self.failure.take() {
            Some(failure) => Err(failure),
            None => Ok(&mut self.emulation),
        }
    }

    /// Keeps the first failure: the trait's calls have no way to tell.
    fn told<T: Default>(&mut self, result: Result<T, Error>) -> T {
        result.unwrap_or_else(|error| {
            self.failure.get_or_insert(error);
            T::default()
        })
    }
}

impl Backend for EmulatedBackend<'_> {
    fn now_us(&self) -> u64 {
        self.emulation.now() / 1000
    }

    fn run_through(&mut self, instants_us: &[u64], observe: &mut dyn FnMut(Observation)) {
        // What had come up before the run begins is seen first.
        let mut before = self.emulation.receive();
        let vehicle = self.vehicle.clone();
        let (seen, observations) = channel();
        let instants = instants_us.iter().map(|instant_us| instant_us * 1000);
        let result = self.emulation.run_through(instants, move |stopped| {
            let observation = Observation {
                now_us: stopped.now() / 1000,
                booted_us: stopped.started_at() / 1000,
                truth: vehicle.plant().truth(),
                bridges_on: stopped.bridges().iter().any(|bridge| bridge.duty().is_some()),
                received: stopped.receive(),
            };
            // Taken up below, as long as there is someone to.
            let _ = seen.send(observation);
        });
        self.told(result);
        for mut observation in observations.try_iter() {
            before.append(&mut observation.received);
            observation.received = std::mem::take(&mut before);
            observe(observation);
        }
    }

    fn send(&mut self, bytes: &[u8]) {
        let result = self.emulation.send(bytes);
        self.told(result);
    }

    fn plant(&mut self, act: &mut dyn FnMut(&mut Plant)) {
        act(&mut self.vehicle.plant());
    }

    fn set_emergency_stop(&mut self, pressed: bool) {
        let result = self.emulation.at(move |stopped| {
            let now = crate::Instant(stopped.now());
            stopped.board().set_stop(now, pressed);
        });
        self.told(result);
    }

    fn log(&mut self) -> Vec<String> {
        let bytes = self.emulation.at(|stopped| stopped.log_bytes()).and_then(|bytes| bytes);
        let lines = bytes.and_then(|bytes| self.firmware.decode(&bytes));
        let lines = self.told(lines);
        let new = lines.get(self.log_lines..).unwrap_or_default().to_vec();
        self.log_lines = lines.len();
        new
    }
}
