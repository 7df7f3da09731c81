//! Start-up: takes the board, loads the vehicle, spawns the tasks.

use defmt_rtt as _;
use embassy_executor::Spawner;
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_time::{Duration, Ticker};
use firmware::drive::DriveHardware;
use firmware::drive_board::SCALES;
use firmware::events::Event;
use firmware::fault_history::FaultStore;
use firmware::hardware::{ClockSource, Place};
use firmware::parameters::{Booted, ParameterStore};
use firmware::protocol::message::About;
use firmware::topics::{self, DisarmBy};
use firmware::update::{self, UpdateStore};
use firmware::{analog, built_in, drive, fault_history, imu, link, log_task, parameters, watchdog};
use model::tick::VehicleCore;
use model::vehicle::Vehicle;
use static_cell::StaticCell;

use crate::board::AnalogSequence;
use crate::board::stm32::link::{LinkReceiver, LinkSender};
use crate::board::stm32::{
    self, Board, CoreCycles, FlightRecorder, ImuDevice, Lamps, MotorBridges, QuadratureCounters, Region,
    RunningWatchdog, StopContact, SystemReset, UserButton,
};

/// The data that the tasks share. The tasks of the control executor interrupt the thread's tasks.
type Topics = topics::Topics<CriticalSectionRawMutex>;
static TOPICS: Topics = Topics::new();

type BoardDrive = DriveHardware<QuadratureCounters, MotorBridges, StopContact, CoreCycles, FlightRecorder>;

#[embassy_executor::main]
async fn main(spawner: Spawner) {
    let board = Board::take();
    log_task::boot(&TOPICS, env!("CARGO_PKG_VERSION"), board.reset_cause, board.clock);
    if let Some(words) = &board.last_words {
        TOPICS.log.push(Event::Crashed);
        defmt::error!("the last run ended: {=str}", words.as_str());
    }
    // The build script has checked the vehicle file with the same rules.
    let Ok(built_in) = Vehicle::new(built_in::PARAMETERS) else {
        defmt::panic!("the built-in vehicle is out of range");
    };
    let Ok(mut store) = ParameterStore::new(board.regions.parameters) else {
        defmt::panic!("the parameter flash is too small");
    };
    let booted = parameters::boot(&mut store, &built_in).await;
    let drive_hardware = DriveHardware {
        encoders: board.encoders,
        bridges: board.bridges,
        emergency_stop: board.emergency_stop,
        cycles: board.cycles,
        recorder: board.flight_recorder,
        blockers: board.blockers,
    };

    // The thread's tasks are created first, because that needs the most stack and nothing interrupts it yet. They run
    // when this task ends.
    static CORE: StaticCell<VehicleCore> = StaticCell::new();
    let core = CORE.init_with(|| VehicleCore::new(&booted.vehicle, &SCALES));
    let about = link::about(built_in.parameters(), board.boot_number);
    spawner.spawn(started(receive_task(board.link_receiver, about)));
    spawner.spawn(started(send_task(board.link_sender, about.boot, board.clock)));
    spawner.spawn(started(parameter_task(store, booted, built_in)));
    let history = FaultStore::new(board.regions.fault_history).ok();
    spawner.spawn(started(fault_task(history, about.boot)));
    let update = board
        .regions
        .update
        .map(|place| UpdateStore::new(place, board.image_checksum));
    spawner.spawn(started(update_task(update, board.blockers.is_empty())));
    spawner.spawn(started(log_task(board.lamps)));
    spawner.spawn(started(button_task(board.user_button)));

    // A vehicle without a spar has no spar IMU, so no task looks for it.
    let with_spar = built_in::PARAMETERS.spar.is_some();
    // In the order in which the tasks run within a tick.
    let control = stm32::start_control_executor();
    control.spawn(started(imu_task(Place::Arm, board.arm_imu)));
    if with_spar {
        control.spawn(started(imu_task(Place::Spar, board.spar_imu)));
    }
    control.spawn(started(drive_task(core, drive_hardware)));
    control.spawn(started(watchdog_task(board.watchdog.start())));
    // Runs halfway between two ticks, however busy the thread's tasks are, so the age of its reading is known.
    control.spawn(started(analog_task(board.analog)));
}

/// The token of a task. Each task is spawned once, so its storage is free.
fn started<S>(
    token: Result<embassy_executor::SpawnToken<S>, embassy_executor::SpawnError>,
) -> embassy_executor::SpawnToken<S> {
    match token {
        Ok(token) => token,
        Err(error) => defmt::panic!("a task did not start: {}", error),
    }
}

#[embassy_executor::task(pool_size = 2)]
async fn imu_task(place: Place, device: ImuDevice) {
    imu::run(&TOPICS, place, device).await;
}

#[embassy_executor::task]
async fn drive_task(core: &'static mut VehicleCore, hardware: BoardDrive) {
    drive::run(&TOPICS, core, hardware).await;
}

#[embassy_executor::task]
async fn watchdog_task(watchdog: RunningWatchdog) {
    watchdog::run(&TOPICS, watchdog).await;
}

#[embassy_executor::task]
async fn analog_task(inputs: AnalogSequence) {
    analog::run(&TOPICS, inputs, stm32::supply::is_low).await;
}

#[embassy_executor::task]
async fn receive_task(uart: LinkReceiver, about: About) {
    link::receive::run(&TOPICS, uart, about).await;
}

#[embassy_executor::task]
async fn send_task(uart: LinkSender, boot: u32, clock: ClockSource) {
    link::send::run(&TOPICS, uart, boot, clock).await;
}

// The arguments move once, at start-up, into the task's own storage.
#[allow(clippy::large_types_passed_by_value)]
#[embassy_executor::task]
async fn parameter_task(store: ParameterStore<Region>, booted: Booted, built_in: Vehicle<f32>) {
    parameters::run(&TOPICS, store, booted, built_in).await;
}

#[embassy_executor::task]
async fn fault_task(history: Option<FaultStore<Region>>, boot: u32) {
    fault_history::run(&TOPICS, history, boot).await;
}

/// A board without a boot loader has no place for an image and never restarts into one.
#[embassy_executor::task]
async fn update_task(store: Option<UpdateStore<Region>>, self_test_passed: bool) {
    update::run(&TOPICS, store, Some(SystemReset), self_test_passed).await;
}

#[embassy_executor::task]
async fn log_task(lamps: Lamps) {
    firmware::log_task::run(&TOPICS, lamps).await;
}

/// The board's own button disarms the vehicle, for a person at the vehicle.
#[embassy_executor::task]
async fn button_task(button: UserButton) {
    let mut ticker = Ticker::every(Duration::from_millis(20));
    loop {
        ticker.next().await;
        if button.is_pressed() {
            TOPICS.ask_to_disarm(DisarmBy::Button);
        }
    }
}
