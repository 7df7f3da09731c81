//! A virtual drive board: the firmware's own tasks in virtual time, in a closed loop with the plant.
//!
//! The tasks run until all of them wait. The clock then jumps to the next alarm, and the plant follows when a task
//! next accesses the hardware. A run does not depend on the host's time or threads, so repeated runs are equal bit for
//! bit.

use std::cell::RefCell;
use std::rc::Rc;
use std::sync::atomic::{AtomicU32, Ordering};

use embassy_futures::block_on;
use embassy_sync::blocking_mutex::raw::NoopRawMutex;
use firmware::drive::DriveHardware;
use firmware::drive_board::SCALES;
use firmware::fault_history::FaultStore;
use firmware::hardware::{ClockSource, NoLoader, Place, ResetCause};
use firmware::parameters::{self, ParameterStore};
use firmware::topics::{DisarmBy, Topics};
use firmware::update::{self, UpdateStore};
use firmware::{analog, drive, fault_history, imu, link, log_task, watchdog};
use model::status::Status;
use model::supervise::codes::BlockerSet;
use model::tick::VehicleCore;
use model::vehicle::{ParameterError, Vehicle};
use thiserror::Error;

use plant::Plant;

mod executor;
pub mod flash;
pub mod hardware;
pub mod log;
pub mod pipe;
pub mod time;

use executor::Executor;
use flash::VirtualFlash;
use hardware::{Hardware, NoCycles, VirtualImu, World};
use pipe::Pipe;
use time::{ClockTaken, VirtualTime};

/// Why a virtual board cannot boot.
#[derive(Debug, Error)]
pub enum VirtualBoardError {
    /// The thread runs a virtual board already.
    #[error(transparent)]
    Clock(#[from] ClockTaken),
    /// The vehicle is invalid in single precision, or has limits that the board's sensors cannot measure.
    #[error("this board cannot drive the vehicle: {0}")]
    Vehicle(ParameterError),
    /// The flash cannot hold a store.
    #[error("the parameter flash is too small")]
    Flash,
    /// A task could not be started.
    #[error("the executor takes no task")]
    Executor,
}

/// Number of the next boot of a virtual board in this process.
static BOOTS: AtomicU32 = AtomicU32::new(1);

/// A number that differs from boot to boot, as on every board. No decision of the vehicle depends on this number.
fn boot_number() -> u32 {
    BOOTS.fetch_add(1, Ordering::Relaxed)
}

/// Checksum of the image that runs: the virtual board's firmware is no image.
pub const RUNNING_IMAGE: u32 = 0;

/// What the task of the updates finds at a start.
#[derive(Debug, Clone)]
pub struct UpdatePart {
    /// Area for an image that arrives over the link; `None` for a board without room. Nothing installs the image, because
    /// this board has no boot loader.
    pub place: Option<VirtualFlash>,
    /// Whether the part's self-test has passed.
    pub self_test_passed: bool,
}

/// A drive board in virtual time.
pub struct VirtualBoard {
    // Declared before `time`, so that the tasks are dropped before the clock is returned.
    executor: Executor,
    topics: Rc<Topics<NoopRawMutex>>,
    hardware: Hardware,
    to_board: Pipe,
    from_board: Pipe,
    watchdog_bitten: bool,
    /// Place of the first task that the drive board runs on its thread executor.
    first_thread_task: usize,
    /// State that survives a reset: the flashes, and the vehicle for which the firmware was built.
    flash: VirtualFlash,
    history: VirtualFlash,
    update: UpdatePart,
    built_in: Vehicle<f32>,
    /// Time of the last boot, us since the start.
    booted_us: u64,
    time: VirtualTime,
}

/// Time between two checks of a supply that is too low, us.
const SUPPLY_PERIOD_US: u64 = 1000;

impl VirtualBoard {
    /// Boots a board that was built for `vehicle` and is wired to `plant`, with empty flashes.
    ///
    /// # Errors
    /// [`VirtualBoardError`]: the thread already runs a board, or the vehicle is invalid in f32.
    pub fn boot(vehicle: &Vehicle<f64>, plant: Plant) -> Result<Self, VirtualBoardError> {
        Self::boot_with(vehicle, plant, VirtualFlash::erased())
    }

    /// Boots a board whose parameter flash has the contents of an earlier run.
    ///
    /// # Errors
    /// As [`VirtualBoard::boot`].
    pub fn boot_with(vehicle: &Vehicle<f64>, plant: Plant, flash: VirtualFlash) -> Result<Self, VirtualBoardError> {
        Self::boot_with_history(vehicle, plant, flash, VirtualFlash::erased())
    }

    /// Boots a board whose parameter flash and fault-history flash have the contents of an earlier run.
    ///
    /// # Errors
    /// As [`VirtualBoard::boot`].
    pub fn boot_with_history(
        vehicle: &Vehicle<f64>,
        plant: Plant,
        flash: VirtualFlash,
        history: VirtualFlash,
    ) -> Result<Self, VirtualBoardError> {
        let time = VirtualTime::take()?;
        log::start();
        let built_in = Vehicle::new(vehicle.parameters().cast::<f32>()).map_err(VirtualBoardError::Vehicle)?;
        built_in
            .check_on(&SCALES.sensor_ranges())
            .map_err(VirtualBoardError::Vehicle)?;
        let mut board = Self {
            executor: Executor::default(),
            topics: Rc::new(Topics::new()),
            hardware: Hardware(Rc::new(RefCell::new(World::new(plant)))),
            to_board: Pipe::default(),
            from_board: Pipe::default(),
            watchdog_bitten: false,
            first_thread_task: 0,
            flash,
            history,
            update: UpdatePart {
                place: Some(VirtualFlash::for_an_image()),
                self_test_passed: true,
            },
            built_in,
            booted_us: 0,
            time,
        };
        board.start(ResetCause::PowerOn)?;
        Ok(board)
    }

    /// Starts the firmware's tasks as a reset does.
    // Not inlined: the tasks and topics pass 100 KiB through this function's stack frame, whose pages would otherwise
    // be touched in every millisecond of a run.
    #[cold]
    #[inline(never)]
    fn start(&mut self, cause: ResetCause) -> Result<(), VirtualBoardError> {
        let (topics, hardware) = (self.topics.clone(), self.hardware.clone());
        let (to_board, from_board) = (self.to_board.clone(), self.from_board.clone());
        let (flash, built_in) = (self.flash.clone(), self.built_in);
        // A macro instead of a generic function, because each task has its own type.
        macro_rules! spawn {
            (|$topics:ident, $hardware:ident| $task:expr) => {{
                let ($topics, $hardware) = (topics.clone(), hardware.clone());
                self.executor
                    .spawn(async move {
                        $task.await;
                    })
                    .map_err(|_| VirtualBoardError::Executor)?;
            }};
        }
        log_task::boot(&topics, env!("CARGO_PKG_VERSION"), cause, ClockSource::External);
        // The virtual flash never waits, so this call ends at once, as on the board before its tasks start.
        let mut store = ParameterStore::new(flash).map_err(|_| VirtualBoardError::Flash)?;
        let booted = block_on(parameters::boot(&mut store, &built_in));
        spawn!(|topics, hardware| imu::run(&topics, Place::Arm, VirtualImu::new(hardware, Place::Arm)));
        if built_in.parameters().spar.is_some() {
            spawn!(|topics, hardware| imu::run(&topics, Place::Spar, VirtualImu::new(hardware, Place::Spar)));
        }
        let mut core = VehicleCore::new(&booted.vehicle, &SCALES);
        spawn!(|topics, hardware| drive::run(
            &topics,
            &mut core,
            DriveHardware {
                encoders: hardware.clone(),
                bridges: hardware.clone(),
                emergency_stop: hardware.clone(),
                cycles: NoCycles,
                recorder: hardware,
                // The virtual part meets the board's needs.
                blockers: BlockerSet::EMPTY,
            },
        ));
        spawn!(|topics, hardware| watchdog::run(&topics, hardware));
        spawn!(|topics, hardware| analog::run(&topics, hardware, || false));
        self.first_thread_task = self.executor.tasks();
        let (rx, tx) = (to_board.clone(), from_board.clone());
        let about = link::about(built_in.parameters(), boot_number());
        spawn!(|topics, _hardware| link::receive::run(&topics, rx, about));
        spawn!(|topics, _hardware| link::send::run(&topics, tx, about.boot, ClockSource::External));
        spawn!(|topics, _hardware| parameters::run(&topics, store, booted, built_in));
        let history = FaultStore::new(self.history.clone()).ok();
        spawn!(|topics, _hardware| fault_history::run(&topics, history, about.boot));
        let UpdatePart {
            place,
            self_test_passed,
        } = self.update.clone();
        let store = place.map(|place| UpdateStore::new(place, RUNNING_IMAGE));
        spawn!(|topics, _hardware| update::run(&topics, store, None::<NoLoader>, self_test_passed));
        spawn!(|topics, hardware| log_task::run(&topics, hardware));
        Ok(())
    }

    /// Holds the board in reset until the supply returns and then boots the board, or until `until_us`. Returns
    /// whether the board runs.
    #[cold]
    #[inline(never)]
    fn wait_for_supply(&mut self, until_us: u64) -> bool {
        // The tasks stop; the clock and the world continue.
        self.executor = Executor::default();
        self.topics = Rc::new(Topics::new());
        loop {
            // Bytes that were sent meanwhile are lost.
            self.to_board.take_all();
            let now_us = self.now_us();
            if self.world(World::power_up) {
                self.booted_us = now_us;
                self.time.restart();
                // The board has booted from this flash before, so this boot succeeds, too.
                return self.start(ResetCause::BrownOut).is_ok();
            }
            if now_us >= until_us {
                return false;
            }
            let next_us = (now_us + SUPPLY_PERIOD_US).min(until_us);
            self.time.advance_to(next_us - self.booted_us);
        }
    }

    /// Resets the board by `cause`, with its supply on: the tasks start again in the same world.
    ///
    /// # Errors
    /// As [`VirtualBoard::boot`].
    pub fn reset(&mut self, cause: ResetCause) -> Result<(), VirtualBoardError> {
        let now_us = self.now_us();
        self.executor = Executor::default();
        self.topics = Rc::new(Topics::new());
        self.world(World::reset);
        self.watchdog_bitten = false;
        self.booted_us = now_us;
        self.time.restart();
        self.start(cause)
    }

    /// What the task of the updates finds from the next start on. For tests.
    pub fn set_update(&mut self, update: UpdatePart) {
        self.update = update;
    }

    /// The time since the start, us.
    pub fn now_us(&self) -> u64 {
        self.booted_us + self.time.now_us()
    }

    /// Time of the last boot, us since the start: 0, the end of the last failure of the supply, or the last reset.
    pub fn booted_us(&self) -> u64 {
        self.booted_us
    }

    /// Runs until `until_us` since the start.
    pub fn run_until(&mut self, until_us: u64) {
        loop {
            if self.hardware.0.borrow().unpowered() && !self.wait_for_supply(until_us) {
                return;
            }
            let until_us = until_us - self.booted_us;
            let due = self.time.take_due();
            self.executor.run_until_stalled(due);
            let next_us = self.time.next_us();
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
                // A real board would reset here. The virtual board's bridges open and stay open.
                self.watchdog_bitten = true;
                world.trip();
            }
        }
    }

    /// Calls `act` with the world at the present time.
    pub fn world<R>(&mut self, act: impl FnOnce(&mut World) -> R) -> R {
        self.hardware.now(act)
    }

    /// The vehicle's status after its last tick.
    pub fn status(&self) -> Option<Status> {
        self.topics.status.latest().map(|status| status.value)
    }

    /// Makes the tasks hang that the drive board runs on its thread executor: link, parameters, fault history, log.
    /// For tests.
    pub fn hang_thread_executor(&mut self) {
        self.executor.hang_from(self.first_thread_task);
    }

    /// Lets the task of the arm IMU hang, which starts first. For tests.
    pub fn hang_arm_imu_task(&mut self) {
        self.executor.hang(0);
    }

    /// Lets the task of the analogue inputs hang, the last one that runs on the control executor. For tests.
    pub fn hang_analog_task(&mut self) {
        self.executor.hang(self.first_thread_task.saturating_sub(1));
    }

    /// Presses the board's own button once: disarm. For tests.
    pub fn press_button(&mut self) {
        self.topics.ask_to_disarm(DisarmBy::Button);
    }

    /// Sends bytes to the board's UART.
    pub fn send(&mut self, bytes: &[u8]) {
        self.to_board.put(bytes);
    }

    /// Takes the bytes that the board's UART has sent.
    pub fn receive(&mut self) -> Vec<u8> {
        self.from_board.take_all()
    }

    /// Whether the hardware watchdog has expired.
    pub fn watchdog_bitten(&self) -> bool {
        self.watchdog_bitten
    }
}
