//! The samples of a tick are as old on the emulated board as on the virtual one: as the design says.

use std::path::Path;

use board_emulator::elf::flight;
use board_emulator::run::{EmulatedBackend, EmulationSettings};
use firmware::built_in;
use model::vehicle::Vehicle;
use virtual_board::ages;
use virtual_board::scenario::{self, Scenario};

use crate::support::firmware;

#[test]
fn the_samples_of_every_tick_are_as_old_as_the_design_says() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/scenarios");
    let scenario = Scenario::read(&folder.join("zero-radius-turn.toml")).expect("the scenario is valid");
    let vehicle = Vehicle::new(built_in::PARAMETERS.cast::<f64>()).expect("the built-in vehicle");
    let plant = scenario.plant(&vehicle).expect("the terrain is drivable");
    let mut backend =
        EmulatedBackend::power_on(firmware(), plant, EmulationSettings::default()).expect("the board powers up");
    let address = flight::address(firmware()).expect("the record is the host's");
    backend
        .emulation()
        .expect("it runs")
        .at(move |stopped| stopped.probe(address, flight::WORDS as u64))
        .expect("it runs");
    scenario::run(&scenario, &mut backend, |_| {}).expect("a valid plant");
    let emulation = backend.emulation().expect("it ran to the end");
    let words = emulation.at(|stopped| stopped.take_probe()).expect("it ran to the end");
    let mut ticks = 0;
    for words in words.chunks(flight::WORDS) {
        let record = flight::decode(words).expect("a record");
        // The self-test and the store take 60 ms, and the IMUs 60 ms more to start.
        if record.tick > 0 && record.sample.time_us > 150_000 {
            ticks += 1;
            if let Err(wrong) = ages::check(&record, true) {
                panic!("{wrong}");
            }
        }
    }
    println!("{ticks} ticks");
    assert!(ticks > 20_000, "{ticks}");
}
