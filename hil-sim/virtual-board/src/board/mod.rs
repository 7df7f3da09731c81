//! A virtual drive board: the firmware's own tasks in lockstep virtual time, closed around the plant.
//!
//! The tasks run until all of them wait; then the clock jumps to the next alarm, and the plant follows
//! when a task next touches the hardware. Nothing depends on the host's time or threads, so a run is
//! the same, bit for bit, every time.

use std::cell::RefCell;
use std::rc::Rc;

use embassy_sync::blocking_mutex::raw::NoopRawMutex;
use firmware::drive::DriveHardware;
use firmware::hardware::ResetCause;
use firmware::imu::Place;
use firmware::parameters::{self, ParameterStore};
use firmware::topics::Topics;
use firmware::{analog, drive, encoders, imu, link, log_task, watchdog};
use futures_executor::LocalPool;
use futures_util::task::LocalSpawnExt;
use model::tick::{Telemetry, VehicleCore};
use model::vehicle::{ParameterError, Vehicle};
use thiserror::Error;

use plant::Plant;

pub mod flash;
pub mod hardware;
pub mod log;
pub mod pipe;
pub mod time;

use flash::VirtualFlash;
use hardware::{Hardware, NoCycles, VirtualImu, World};
use pipe::Pipe;
use time::{ClockTaken, VirtualTime};

/// Why a virtual board cannot be had.
#[derive(Debug, Error)]
pub enum VirtualBoardError {
    /// The thread has one already.
    #[error(transparent)]
    Clock(#[from] ClockTaken),
    /// The vehicle is not valid in single precision.
    #[error("the vehicle is not valid in single precision: {0}")]
    Vehicle(ParameterError),
    /// The flash cannot hold a store.
    #[error("the parameter flash is too small")]
    Flash,
    /// A task could not be started.
    #[error("the executor takes no task")]
    Executor,
}

/// A drive board in virtual time.
pub struct VirtualBoard {
    // Before `time`: the tasks must be gone when the clock is given back.
    pool: LocalPool,
    topics: Rc<Topics<NoopRawMutex>>,
    hardware: Hardware,
    to_board: Pipe,
    from_board: Pipe,
    watchdog_bitten: bool,
    time: VirtualTime,
}

impl VirtualBoard {
    /// Boots a board that was built for `vehicle` and is wired to `plant`, with nothing stored.
    ///
    /// # Errors
    /// [`VirtualBoardError`]: the thread already runs one, or the vehicle is not valid in f32.
    pub fn boot(vehicle: &Vehicle<f64>, plant: Plant) -> Result<Self, VirtualBoardError> {
        Self::boot_with(vehicle, plant, VirtualFlash::erased())
    }

    /// Boots a board whose parameter flash holds what an earlier run left in it.
    ///
    /// # Errors
    /// As [`VirtualBoard::boot`].
    pub fn boot_with(vehicle: &Vehicle<f64>, plant: Plant, flash: VirtualFlash) -> Result<Self, VirtualBoardError> {
        let time = VirtualTime::take()?;
        log::start();
        let built_in = Vehicle::new(vehicle.parameters().cast::<f32>()).map_err(VirtualBoardError::Vehicle)?;
        let topics = Rc::new(Topics::new());
        let hardware = Hardware(Rc::new(RefCell::new(World::new(plant))));
        let (to_board, from_board) = (Pipe::default(), Pipe::default());
        let pool = LocalPool::new();
        let spawner = pool.spawner();
        // One macro instead of a generic function: each task has its own type.
        macro_rules! spawn {
            (|$topics:ident, $hardware:ident| $task:expr) => {{
                let ($topics, $hardware) = (topics.clone(), hardware.clone());
                spawner
                    .spawn_local(async move {
                        $task.await;
                    })
                    .map_err(|_| VirtualBoardError::Executor)?;
            }};
        }
        log_task::boot(env!("CARGO_PKG_VERSION"), ResetCause::PowerOn);
        // The virtual flash never waits, so this is over at once, as on the board before its tasks start.
        let mut store = ParameterStore::new(flash).map_err(|_| VirtualBoardError::Flash)?;
        let booted = futures_executor::block_on(parameters::boot(&mut store, &built_in));
        spawn!(|topics, hardware| encoders::run(&topics, hardware));
        spawn!(|topics, hardware| imu::run(&topics, Place::Arm, VirtualImu::new(hardware, Place::Arm)));
        spawn!(|topics, hardware| imu::run(&topics, Place::Spar, VirtualImu::new(hardware, Place::Spar)));
        let core = VehicleCore::new(&booted.vehicle);
        spawn!(|topics, hardware| drive::run(
            &topics,
            core,
            DriveHardware {
                bridges: hardware.clone(),
                emergency_stop: hardware.clone(),
                cycles: NoCycles,
                recorder: hardware,
            },
        ));
        spawn!(|topics, hardware| watchdog::run(&topics, hardware));
        spawn!(|topics, hardware| analog::run(&topics, hardware));
        let (rx, tx) = (to_board.clone(), from_board.clone());
        spawn!(|topics, _hardware| link::receive::run(&topics, rx));
        spawn!(|topics, _hardware| link::send::run(&topics, tx));
        spawn!(|topics, _hardware| parameters::run(&topics, store, booted, built_in));
        spawn!(|topics, hardware| log_task::run(&topics, hardware));
        Ok(Self {
            pool,
            topics,
            hardware,
            to_board,
            from_board,
            watchdog_bitten: false,
            time,
        })
    }

    /// The time since boot, us.
    pub fn now_us(&self) -> u64 {
        self.time.now_us()
    }

    /// Runs until `until_us` since boot.
    pub fn run_until(&mut self, until_us: u64) {
        loop {
            let next_us = self.time.next_alarm_us();
            self.pool.run_until_stalled();
            // Polling may have set an earlier alarm.
            let next_us = next_us.min(self.time.next_alarm_us());
            let now_us = self.time.now_us();
            if next_us <= now_us {
                continue;
            }
            if next_us > until_us {
                self.time.advance_to(until_us);
                self.world(|_| {});
                return;
            }
            self.time.advance_to(next_us);
            let mut world = self.hardware.0.borrow_mut();
            if world.watchdog_expired(next_us) && !self.watchdog_bitten {
                // The part would reset here: its bridges open and stay so.
                self.watchdog_bitten = true;
                world.trip();
            }
        }
    }

    /// Does something with the world as it is now.
    pub fn world<R>(&mut self, act: impl FnOnce(&mut World) -> R) -> R {
        self.hardware.now(act)
    }

    /// What the vehicle told in its last tick.
    pub fn telemetry(&self) -> Option<Telemetry> {
        self.topics.telemetry.latest().map(|telemetry| telemetry.value)
    }

    /// Sends bytes to the board's UART.
    pub fn send(&mut self, bytes: &[u8]) {
        self.to_board.put(bytes);
    }

    /// Takes the bytes that the board's UART has sent.
    pub fn receive(&mut self) -> Vec<u8> {
        self.from_board.take_all()
    }

    /// Whether the hardware watchdog has bitten.
    pub fn watchdog_bitten(&self) -> bool {
        self.watchdog_bitten
    }
}
