//! The caller's side of a run: orders to the emulated core, which runs on its own thread.
//!
//! The two threads run alternately, so a run is as deterministic as on a single thread.

use std::sync::mpsc::{Receiver, Sender, channel};
use std::thread::JoinHandle;

use rigless::emulator::{self, Start};
use rigless::image;
use rigless::session::Session;
use rigless::snapshot::Snapshot;
use rigless::time::VirtualNanos;

use super::conductor::Conductor;
use super::orders::{Arrival, Errand, Task};
use super::settings::EmulationSettings;
use super::state::EmulationState;
use super::stopped::{NoDriver, Stopped};
use crate::board::DriveBoard;
use crate::elf::Firmware;
use crate::error::Error;
use crate::vehicle::ClosedPlant;

/// A firmware running on the board.
pub struct Emulation {
    orders: Sender<Errand>,
    arrivals: Receiver<Arrival>,
    thread: Option<JoinHandle<Result<(), Error>>>,
    arrived: Arrival,
}

/// The state of a run, from which any number of runs can continue.
pub struct Frozen {
    snapshot: Snapshot,
    state: EmulationState,
    /// Bytes from the host link that the caller had not taken.
    received: Vec<u8>,
}

impl Emulation {
    /// Powers the board up with `firmware` in its flash and stops at the first step of the plant.
    ///
    /// # Errors
    /// When the emulated part or core cannot be built, or the run ends at once.
    pub fn power_on(
        firmware: &Firmware,
        plant: Box<dyn ClosedPlant>,
        settings: EmulationSettings,
    ) -> Result<Self, Error> {
        Self::power_on_with(firmware, plant, settings, &[])
    }

    /// [`Emulation::power_on`] with additional flash contents, as addresses and bytes.
    ///
    /// # Errors
    /// As [`Emulation::power_on`].
    pub fn power_on_with(
        firmware: &Firmware,
        plant: Box<dyn ClosedPlant>,
        settings: EmulationSettings,
        contents: &[(u64, Vec<u8>)],
    ) -> Result<Self, Error> {
        let images = with_contents(firmware.images(), firmware, contents)?;
        let state = EmulationState::new(plant, settings, firmware.rtt_block());
        Self::start(images, state, None)
    }

    /// Powers the board up with the boot loader and, instead of the firmware, with these flash contents, as
    /// addresses and bytes. For tests.
    ///
    /// # Errors
    /// As [`Emulation::power_on`].
    pub fn power_on_loader(
        firmware: &Firmware,
        plant: Box<dyn ClosedPlant>,
        settings: EmulationSettings,
        contents: &[(u64, Vec<u8>)],
    ) -> Result<Self, Error> {
        let images = with_contents(firmware.loader(), firmware, contents)?;
        Self::start(images, EmulationState::new(plant, settings, firmware.rtt_block()), None)
    }

    fn start(images: Vec<image::Image>, state: EmulationState, from: Option<&Snapshot>) -> Result<Self, Error> {
        let digest = image::digest(&images, None);
        let board = Box::new(DriveBoard::new(
            state.settings().instructions_per_second,
            state.settings().part,
        )?);
        let first = VirtualNanos(state.settings().plant_interval);
        let mut session = Session::new(board, 0, first).map_err(|error| Error::Core(error.to_string()))?;
        let resume = match from {
            Some(snapshot) => {
                let resume = snapshot.restore(&mut session, &digest, &mut NoDriver {})?;
                session.run_until(VirtualNanos(snapshot.stop().at.0 + 1));
                Some(resume)
            }
            None => None,
        };
        let (orders, orders_taken) = channel();
        let (arrivals, arrivals_taken) = channel();
        let conductor = Conductor::new(state, orders_taken, arrivals, digest);
        let thread = std::thread::spawn(move || {
            let mut start = Start::new(&images);
            start.resume = resume.as_ref();
            emulator::run(session, &start, conductor)?.driver.finish()
        });
        let mut emulation = Self {
            orders,
            arrivals: arrivals_taken,
            thread: Some(thread),
            arrived: Arrival::default(),
        };
        emulation.arrive()?;
        Ok(emulation)
    }

    /// Virtual time in ns.
    pub fn now(&self) -> u64 {
        self.arrived.now
    }

    /// Runs for a span of virtual time in ns. For tests.
    ///
    /// # Errors
    /// When the run ends earlier.
    pub fn run_for(&mut self, span: u64) -> Result<(), Error> {
        self.run_until(self.now() + span)
    }

    /// Runs until an instant in ns.
    ///
    /// # Errors
    /// When the run ends earlier.
    pub fn run_until(&mut self, instant: u64) -> Result<(), Error> {
        self.run_through([instant], |_| {})
    }

    /// Runs through ascending instants in ns and calls `watch` at each instant. This is cheaper than a stop at
    /// each instant: a stop and a start each wake a thread, which costs a good part of a simulated millisecond.
    ///
    /// # Errors
    /// When the run ends earlier.
    pub fn run_through(
        &mut self,
        instants: impl IntoIterator<Item = u64>,
        watch: impl FnMut(&mut Stopped<'_>) + Send + 'static,
    ) -> Result<(), Error> {
        let order = Errand::Run(instants.into_iter().collect(), Box::new(watch));
        if self.orders.send(order).is_err() {
            return Err(self.ended());
        }
        self.arrive()
    }

    /// Carries out `task` at the run's present instant; returns its result.
    ///
    /// # Errors
    /// When the run has ended.
    pub fn at<T: Send + 'static>(
        &mut self,
        task: impl FnOnce(&mut Stopped<'_>) -> T + Send + 'static,
    ) -> Result<T, Error> {
        let (answer, answered) = channel();
        let task: Task = Box::new(move |stopped| {
            // The caller waits for the answer below.
            let _ = answer.send(task(stopped));
        });
        if self.orders.send(Errand::Do(task)).is_err() {
            return Err(self.ended());
        }
        answered.recv().map_err(|_| self.ended())
    }

    /// Sends bytes down the host link.
    ///
    /// # Errors
    /// When the run has ended.
    pub fn send(&mut self, bytes: &[u8]) -> Result<(), Error> {
        let sent = self.orders.send(Errand::Send(bytes.to_vec()));
        sent.map_err(|_| self.ended())
    }

    /// Takes the bytes from the host link that arrived before the run's present instant.
    pub fn receive(&mut self) -> Vec<u8> {
        std::mem::take(&mut self.arrived.received)
    }

    /// Takes a snapshot of the run.
    ///
    /// # Errors
    /// When a reset is in progress or the snapshot's file cannot be written.
    pub fn freeze(&mut self) -> Result<Frozen, Error> {
        let received = self.arrived.received.clone();
        self.at(move |stopped| {
            let (taken, state) = stopped.freeze()?;
            // The emulator reads snapshots from files only.
            let name = format!(
                "board-emulator-{}-{:?}.snap",
                std::process::id(),
                std::thread::current().id()
            );
            let path = std::env::temp_dir().join(name);
            let read = |source| Error::Read {
                path: path.clone(),
                source,
            };
            std::fs::write(&path, &taken.file).map_err(read)?;
            let snapshot = Snapshot::read(&path)?;
            std::fs::remove_file(&path).map_err(read)?;
            Ok(Frozen {
                snapshot,
                state,
                received,
            })
        })?
    }

    fn arrive(&mut self) -> Result<(), Error> {
        match self.arrivals.recv() {
            Ok(mut arrival) => {
                // Bytes that the caller has not taken yet precede the new bytes.
                let mut received = self.receive();
                received.append(&mut arrival.received);
                self.arrived = Arrival { received, ..arrival };
                Ok(())
            }
            Err(_) => Err(self.ended()),
        }
    }

    /// The error with which the emulator's thread ended.
    fn ended(&mut self) -> Error {
        match self.thread.take().map(JoinHandle::join) {
            Some(Ok(Err(error))) => error,
            Some(Err(_)) => Error::Core("the emulator panicked".to_owned()),
            Some(Ok(Ok(()))) | None => Error::Core("the run has ended".to_owned()),
        }
    }
}

/// Adds flash contents to images.
fn with_contents(
    mut images: Vec<image::Image>,
    firmware: &Firmware,
    contents: &[(u64, Vec<u8>)],
) -> Result<Vec<image::Image>, Error> {
    for (address, bytes) in contents {
        images.push(image::Image::new(firmware.path(), bytes.clone(), Some(*address))?);
    }
    Ok(images)
}

impl Frozen {
    /// Starts a run that continues from the frozen state. `firmware` must be the frozen run's firmware. For tests.
    ///
    /// # Errors
    /// When it is another firmware.
    pub fn thaw(&self, firmware: &Firmware) -> Result<Emulation, Error> {
        let mut emulation = Emulation::start(firmware.images(), self.state.fork(), Some(&self.snapshot))?;
        // Before its first stop the new run executed an instruction and may have received bytes of its own.
        emulation.arrived.received.splice(..0, self.received.iter().copied());
        Ok(emulation)
    }
}

impl Drop for Emulation {
    fn drop(&mut self) {
        // If the run has already ended, nobody receives this order.
        let _ = self.orders.send(Errand::End);
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}
