//! Kinds of faults that users of comparable machines have reported, flown by the flashed code.

use board_emulator::run::{EmulatedBackend, EmulationSettings};
use firmware::built_in;
use model::vehicle::Vehicle;
use virtual_board::scenario;

use crate::support::firmware;

#[path = "../../../../tests/support/short_cases.rs"]
mod short_cases;
use short_cases::SHORT_CASES;

/// Another seed than the virtual board's.
const SEED: u64 = 5;

fn fly(kind: u32) {
    let case = SHORT_CASES.iter().find(|case| case.kind == kind).expect("a kind");
    let scenario = case.scenario(SEED);
    let vehicle = Vehicle::new(built_in::PARAMETERS.cast::<f64>()).expect("the built-in vehicle");
    let plant = scenario.plant(&vehicle).expect("the terrain is drivable");
    let mut backend =
        EmulatedBackend::power_on(firmware(), plant, EmulationSettings::default()).expect("the board powers up");
    let outcome = scenario::run(&scenario, &mut backend, |_| {}).expect("a valid plant");
    case.check(SEED, &outcome);
    assert_eq!(outcome.counts.unarmed_drive_ms, 0);
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
