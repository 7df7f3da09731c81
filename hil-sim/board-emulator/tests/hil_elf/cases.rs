//! The kinds of faults that users of comparable machines have reported, flown by the flashed code.

use board_emulator::run::{EmulatedBackend, EmulationSettings};
use firmware::built_in;
use model::supervise::arming::Mode;
use model::supervise::codes::Fault;
use model::vehicle::Vehicle;
use virtual_board::scenario::{self, DriveOutcome, Scenario};

use crate::support::firmware;

#[path = "../../../../tests/support/case_files.rs"]
mod case_files;
#[path = "../../../../tests/support/outcomes.rs"]
mod outcomes;
#[path = "../../../../tests/support/short_cases.rs"]
mod short_cases;
use case_files::CASE_FILES;
use short_cases::SHORT_CASES;

/// Another seed than the virtual board's.
const SEED: u64 = 5;

fn fly(kind: u32) {
    let case = SHORT_CASES.iter().find(|case| case.kind == kind).expect("a kind");
    let outcome = flown(&case.scenario(SEED));
    case.check(SEED, &outcome);
    assert_eq!(outcome.counts.unarmed_drive_ms, 0);
}

/// Drives an unchanged file of `tests/cases` until the event that the file tests has happened.
fn fly_file(name: &str) {
    let file = CASE_FILES.iter().find(|file| file.name == name).expect("a file");
    let as_it_stands = &file.values[0];
    let outcome = flown(&file.scenario(as_it_stands, SEED, file.shorter));
    file.check(as_it_stands, SEED, &outcome);
    assert_eq!(outcome.counts.unarmed_drive_ms, 0);
}

/// Lets the flashed code drive a scenario.
fn flown(scenario: &Scenario) -> DriveOutcome {
    let vehicle = Vehicle::new(built_in::PARAMETERS.cast::<f64>()).expect("the built-in vehicle");
    let plant = scenario.plant(&vehicle).expect("the terrain is drivable");
    let mut backend =
        EmulatedBackend::power_on(firmware(), plant, EmulationSettings::default()).expect("the board powers up");
    scenario::run(scenario, &mut backend, |_| {}).expect("a valid plant")
}

#[test]
fn a_turn_on_the_spot_leaves_the_heading_known() {
    fly(3);
}

#[test]
fn a_fall_over_a_ledge_is_no_fault() {
    fly(4);
}

#[test]
fn a_kerb_lets_the_vehicle_go_gently() {
    fly(5);
}

#[test]
fn a_vehicle_at_a_wall_backs_off_when_told() {
    fly(6);
}

#[test]
fn a_dead_current_sensor_stops_the_vehicle() {
    fly(7);
}

#[test]
fn a_mad_ballast_encoder_takes_the_levelling_only() {
    fly(9);
}

#[test]
fn a_link_3_s_late_is_a_silent_operator() {
    fly(10);
}

#[test]
fn an_encoder_stuck_at_a_crawl_is_found() {
    fly(18);
}

#[test]
fn ice_on_a_slope_is_told() {
    fly(19);
}

#[test]
fn motors_with_weak_magnets_are_held_to_their_heat() {
    fly(20);
}

#[test]
fn a_full_battery_is_not_charged_further() {
    fly(21);
}

#[test]
fn the_file_of_a_dying_ballast_encoder_drives_on() {
    fly_file("ballast-encoder-dies-downhill");
}

#[test]
fn the_file_of_a_battery_over_its_range_opens_the_bridges() {
    fly_file("battery-over-range");
}

#[test]
fn the_file_of_a_kerb_ends_gently() {
    fly_file("kerb-surge");
}

#[test]
fn the_file_of_a_ledge_drives_on() {
    fly_file("ledge-down");
}

#[test]
fn the_file_of_half_a_minute_of_turning_keeps_the_heading() {
    fly_file("spin-then-straight");
}

#[test]
fn the_file_of_a_long_line_stays_on_it() {
    fly_file("straight-120-m");
}

#[test]
fn the_file_of_a_wall_backs_off() {
    fly_file("wall-back-off");
}

/// The simulated bridges bear far less than the built-in vehicle says: a bridge shuts itself down on a slope, and its fault output
/// opens the others by the break.
#[test]
fn a_bridge_that_shuts_itself_down_opens_the_others() {
    let text = r#"title = "hot bridge"
        seed = 5
        duration_s = 6.0
        chocked_until_armed = true
        terrain.plane = { slope_x_rad = 0.35 }
        terrain.friction = { left = 1.0, right = 1.0 }
        plant.vehicle = { drive_motor.bridge_continuous_a = 2.5 }
        step = [{ at_s = 1.0, action = "arm" }]"#;
    let scenario = Scenario::parse("hot-bridge.toml", text).expect("a scenario");
    let outcome = flown(&scenario);
    let rows = &outcome.trace.rows;
    let told = rows
        .iter()
        .position(|row| row.status.faults.contains(Fault::BridgeBreak));
    let told = told.expect("fault BridgeBreak");
    assert!(
        rows[..told].iter().any(|row| row.status.mode == Mode::Armed),
        "the vehicle never held the slope"
    );
    assert!(
        rows[told..]
            .iter()
            .all(|row| row.status.mode == Mode::Disarmed && !row.bridges_on)
    );
}
