//! A run: the emulated core on a thread of its own, told by the caller how far to go and what to do
//! where it stands.
//!
//! The two threads take turns, so a run is as deterministic as if there were one.

use std::sync::mpsc::{Receiver, Sender, channel};
use std::thread::JoinHandle;

use rigless::emulator::{self, Start};
use rigless::image;
use rigless::machine::Board;
use rigless::session::Session;
use rigless::snapshot::Snapshot;
use rigless::time::VirtualNanos;

use crate::board::{DriveBoard, INSTRUCTIONS_PER_SECOND};
use crate::conductor::{Arrival, Conductor, Nothing, Order, State, Stopped, Task};
use crate::elf::Firmware;
use crate::plant::ClosedPlant;
use crate::{Error, MS};

/// How a run is made.
#[derive(Debug, Clone, Copy)]
pub struct Settings {
    /// Virtual time between two steps of the plant in ns. A multiple or a fraction of the firmware's tick
    /// of 1 ms: the steps are laid just before ticks.
    pub plant_interval: u64,
    /// Instructions a second of virtual time.
    pub instructions_per_second: u64,
    /// Virtual time between two drains of the log in ns.
    pub log_interval: u64,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            plant_interval: MS,
            instructions_per_second: INSTRUCTIONS_PER_SECOND,
            log_interval: 5 * MS,
        }
    }
}

/// A firmware running on the board.
pub struct Emulation {
    orders: Sender<Order>,
    arrivals: Receiver<Arrival>,
    thread: Option<JoinHandle<Result<(), Error>>>,
    arrived: Arrival,
}

/// A run stood still, from which others go on.
pub struct Frozen {
    snapshot: Snapshot,
    state: State,
    /// What had come up the host link and not been taken.
    received: Vec<u8>,
}

impl Emulation {
    /// Powers the board up with `firmware` in its flash and stops at the first step of the plant.
    ///
    /// # Errors
    /// When the emulated part or core cannot be made, or ends at once.
    pub fn power_on(firmware: &Firmware, plant: Box<dyn ClosedPlant>, settings: Settings) -> Result<Self, Error> {
        Self::power_on_with(firmware, plant, settings, &[])
    }

    /// [`Emulation::power_on`] with more in its flash: addresses and bytes, as an earlier run left them.
    ///
    /// # Errors
    /// As [`Emulation::power_on`].
    pub fn power_on_with(
        firmware: &Firmware,
        plant: Box<dyn ClosedPlant>,
        settings: Settings,
        contents: &[(u64, Vec<u8>)],
    ) -> Result<Self, Error> {
        let mut images = vec![firmware.image().clone()];
        for (address, bytes) in contents {
            images.push(image::Image::new(firmware.path(), bytes.clone(), Some(*address))?);
        }
        let state = State::new(plant, settings, firmware.rtt_block());
        Self::start(images, state, None)
    }

    fn start(images: Vec<image::Image>, state: State, from: Option<&Snapshot>) -> Result<Self, Error> {
        let digest = image::digest(&images, None);
        let board = Box::new(DriveBoard::new(state.settings().instructions_per_second)?);
        let first = VirtualNanos(state.settings().plant_interval);
        let mut session = Session::new(board, 0, first).map_err(|error| Error::Core(error.to_string()))?;
        let resume = match from {
            Some(snapshot) => {
                let resume = snapshot.restore(&mut session, &digest, &mut Nothing {})?;
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

    /// Runs for a span of virtual time in ns.
    ///
    /// # Errors
    /// When the run ends before.
    pub fn run_for(&mut self, span: u64) -> Result<(), Error> {
        self.run_until(self.now() + span)
    }

    /// Runs until an instant in ns.
    ///
    /// # Errors
    /// When the run ends before.
    pub fn run_until(&mut self, instant: u64) -> Result<(), Error> {
        self.run_through([instant], |_| {})
    }

    /// Runs through instants in ns and in order, and does something at each. Cheaper than stopping there:
    /// to stop and to go on wakes a thread each, which costs a good part of a simulated millisecond.
    ///
    /// # Errors
    /// When the run ends before.
    pub fn run_through(
        &mut self,
        instants: impl IntoIterator<Item = u64>,
        watch: impl FnMut(&mut Stopped<'_>) + Send + 'static,
    ) -> Result<(), Error> {
        let order = Order::Run(instants.into_iter().collect(), Box::new(watch));
        if self.orders.send(order).is_err() {
            return Err(self.ended());
        }
        self.arrive()
    }

    /// Does something where the run stands.
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
        if self.orders.send(Order::Do(task)).is_err() {
            return Err(self.ended());
        }
        answered.recv().map_err(|_| self.ended())
    }

    /// Sends bytes down the host link.
    ///
    /// # Errors
    /// When the run has ended.
    pub fn send(&mut self, bytes: &[u8]) -> Result<(), Error> {
        let sent = self.orders.send(Order::Send(bytes.to_vec()));
        sent.map_err(|_| self.ended())
    }

    /// Takes what had come up the host link when the run came to stand where it does.
    pub fn receive(&mut self) -> Vec<u8> {
        std::mem::take(&mut self.arrived.received)
    }

    /// Keeps the run as it stands.
    ///
    /// # Errors
    /// When a reset is under way.
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
                // Bytes nobody has taken yet come before the new ones.
                let mut received = self.receive();
                received.append(&mut arrival.received);
                self.arrived = Arrival { received, ..arrival };
                Ok(())
            }
            Err(_) => Err(self.ended()),
        }
    }

    /// Why the emulator's thread is gone.
    fn ended(&mut self) -> Error {
        match self.thread.take().map(JoinHandle::join) {
            Some(Ok(Err(error))) => error,
            Some(Err(_)) => Error::Core("the emulator panicked".to_owned()),
            Some(Ok(Ok(()))) | None => Error::Core("the run has ended".to_owned()),
        }
    }
}

impl Frozen {
    /// Goes on from the frozen run; `firmware` must be the one it ran.
    ///
    /// # Errors
    /// When it is not.
    pub fn thaw(&self, firmware: &Firmware) -> Result<Emulation, Error> {
        let mut emulation = Emulation::start(vec![firmware.image().clone()], self.state.fork(), Some(&self.snapshot))?;
        // The run has gone on for an instruction to get here.
        emulation.arrived.received.splice(..0, self.received.iter().copied());
        Ok(emulation)
    }
}

impl Drop for Emulation {
    fn drop(&mut self) {
        // A run that ended on its own has nobody to hear this.
        let _ = self.orders.send(Order::End);
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

const _: fn(&DriveBoard) -> &'static str = <DriveBoard as Board>::name;
