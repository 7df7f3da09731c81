//! On the emulated board, as on the virtual board, the samples of every tick have the age that the design states; a recorded drive
//! has every tick, and replays.

use std::path::Path;

use board_emulator::run::{EmulatedBackend, EmulationSettings};
use firmware::built_in;
use firmware::drive_board::SCALES;
use model::tick::VehicleCore;
use model::vehicle::Vehicle;
use virtual_board::ages;
use virtual_board::scenario::{self, Backend, Scenario};

use crate::support::firmware;

#[test]
fn the_samples_of_every_tick_are_as_old_as_the_design_says() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/scenarios");
    let scenario = Scenario::read(&folder.join("zero-radius-turn.toml")).expect("the scenario is valid");
    let vehicle = Vehicle::new(built_in::PARAMETERS.cast::<f64>()).expect("the built-in vehicle");
    let plant = scenario.plant(&vehicle).expect("the terrain is drivable");
    let mut backend =
        EmulatedBackend::power_on(firmware(), plant, EmulationSettings::default()).expect("the board powers up");
    // The records are taken during the drive, as for a file.
    backend.keep_records();
    let mut records = Vec::new();
    let take = |backend: &mut dyn Backend| records.extend(backend.take_records());
    scenario::run_watched(&scenario, &mut backend, |_| {}, |_| {}, take).expect("a valid plant");
    backend.emulation().expect("it ran to the end");
    let mut core = VehicleCore::new(&Vehicle::new(built_in::PARAMETERS).expect("valid"), &SCALES);
    let mut ticks = 0;
    for (n, record) in (1..).zip(&records) {
        assert_eq!(record.tick, n, "every tick is recorded once");
        let replayed = core.step(&record.sample, &record.command).actuation;
        assert_eq!(replayed, record.actuation, "tick {n} replays");
        // The self-test and the store take 60 ms, and the IMUs 60 ms more to start.
        if record.sample.time_us > 150_000 {
            ticks += 1;
            if let Err(wrong) = ages::check(record, true) {
                panic!("{wrong}");
            }
        }
    }
    println!("{ticks} ticks");
    assert!(ticks > 20_000, "{ticks}");
}
