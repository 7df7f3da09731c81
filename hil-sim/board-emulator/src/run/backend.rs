//! Scenarios on the emulated board, with the same files, operator, trace and metrics as on the virtual board.

use std::sync::mpsc::channel;

use firmware::flight_record::FlightRecord;
use plant::Plant;
use virtual_board::scenario::{Backend, Observation};

use super::emulation::Emulation;
use super::settings::EmulationSettings;
use super::stopped::Stopped;
use crate::elf::{Firmware, LogReader, flight};
use crate::error::Error;
use crate::time::US;
use crate::vehicle::VehicleAtPins;

/// The emulated board with hil-sim's plant around it.
pub struct EmulatedBackend<'a> {
    firmware: &'a Firmware,
    emulation: Emulation,
    vehicle: VehicleAtPins,
    /// Reader of the log. `None` before the log was first read.
    log_reader: Option<LogReader<'a>>,
    /// Bytes of the log that the reader has received.
    log_bytes: usize,
    /// Instant of the board's last start, us since the run's start, as last observed.
    booted_us: u64,
    /// The tick of the last record that [`Backend::take_records`] has returned.
    recorded_tick: u32,
    /// Why the run ended early. From then on time does not advance.
    failure: Option<Error>,
}

impl<'a> EmulatedBackend<'a> {
    /// Powers the board up.
    ///
    /// # Errors
    /// As [`Emulation::power_on`].
    pub fn power_on(firmware: &'a Firmware, plant: Plant, settings: EmulationSettings) -> Result<Self, Error> {
        Self::power_on_with(firmware, plant, settings, &[])
    }

    /// [`EmulatedBackend::power_on`] with additional flash contents, as addresses and bytes.
    ///
    /// # Errors
    /// As [`Emulation::power_on`].
    pub fn power_on_with(
        firmware: &'a Firmware,
        plant: Plant,
        settings: EmulationSettings,
        contents: &[(u64, Vec<u8>)],
    ) -> Result<Self, Error> {
        let vehicle = VehicleAtPins::new(plant);
        let emulation = Emulation::power_on_with(firmware, Box::new(vehicle.clone()), settings, contents)?;
        Ok(Self {
            firmware,
            emulation,
            vehicle,
            log_reader: None,
            log_bytes: 0,
            booted_us: 0,
            recorded_tick: 0,
            failure: None,
        })
    }

    /// The run itself, for uses beyond a scenario.
    ///
    /// # Errors
    /// The error with which the run ended early, if it did.
    pub fn emulation(&mut self) -> Result<&mut Emulation, Error> {
        match self.failure.take() {
            Some(failure) => Err(failure),
            None => Ok(&mut self.emulation),
        }
    }

    /// The lines of the log that have arrived since the last call.
    fn new_lines(&mut self) -> Result<Vec<String>, Error> {
        let from = self.log_bytes;
        let bytes = self.emulation.at(move |stopped| stopped.log_bytes(from))??;
        self.log_bytes += bytes.len();
        let reader = match &mut self.log_reader {
            Some(reader) => reader,
            none => none.insert(self.firmware.log_reader()?),
        };
        Ok(reader.lines(&bytes))
    }

    /// Keeps the first failure, because the trait's calls return no errors.
    fn note<T: Default>(&mut self, result: Result<T, Error>) -> T {
        result.unwrap_or_else(|error| {
            self.failure.get_or_insert(error);
            T::default()
        })
    }
}

impl Backend for EmulatedBackend<'_> {
    fn now_us(&self) -> u64 {
        self.emulation.now() / US
    }

    fn booted_us(&self) -> u64 {
        self.booted_us
    }

    fn run_through(&mut self, instants_us: &[u64], observe: &mut dyn FnMut(&mut Observation)) {
        // Bytes that came up before this call belong to the first observation.
        let mut before = self.emulation.receive();
        let vehicle = self.vehicle.clone();
        let (seen, observations) = channel();
        let instants = instants_us.iter().map(|instant_us| instant_us * US);
        let result = self.emulation.run_through(instants, move |stopped| {
            let observation = Observation {
                now_us: stopped.now() / US,
                booted_us: stopped.clock_start() / US,
                glance: Box::new(vehicle.plant().glance()),
                bridges_on: stopped.bridges().iter().any(|bridge| bridge.duty().is_some()),
                received: stopped.receive(),
            };
            // The receiver exists until the run arrives.
            let _ = seen.send(observation);
        });
        self.note(result);
        for mut observation in observations.try_iter() {
            self.booted_us = observation.booted_us;
            before.append(&mut observation.received);
            observation.received = std::mem::take(&mut before);
            observe(&mut observation);
        }
    }

    fn keep_records(&mut self) {
        let probed = flight::address(self.firmware).and_then(|record| {
            let probe = move |stopped: &mut Stopped<'_>| stopped.probe(record, flight::WORDS as u64);
            self.emulation.at(probe)
        });
        self.note(probed);
    }

    fn take_records(&mut self) -> Vec<FlightRecord> {
        let words = self.emulation.at(|stopped| stopped.take_probe());
        let words = self.note(words);
        let mut records = Vec::new();
        for words in words.chunks(flight::WORDS) {
            let Some(record) = self.note(flight::decode(words).map(Some)) else {
                break;
            };
            // No tick has passed since the previous step: the firmware is starting, or ticks are further apart than
            // steps.
            if record.tick != self.recorded_tick {
                self.recorded_tick = record.tick;
                // A board that has just started has no record before its first tick.
                records.extend((record.tick > 0).then_some(record));
            }
        }
        records
    }

    fn send(&mut self, bytes: &[u8]) {
        let result = self.emulation.send(bytes);
        self.note(result);
    }

    fn plant(&mut self, act: &mut dyn FnMut(&mut Plant)) {
        act(&mut self.vehicle.plant());
    }

    fn set_emergency_stop(&mut self, pressed: bool) {
        let result = self.emulation.at(move |stopped| {
            let (board, now) = stopped.board_now();
            board.set_stop(now, pressed);
        });
        self.note(result);
    }

    fn log(&mut self) -> Vec<String> {
        let lines = self.new_lines();
        self.note(lines)
    }
}
