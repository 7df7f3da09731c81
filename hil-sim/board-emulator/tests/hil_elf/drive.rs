//! The scenario that the virtual board drives, driven by the flashed code.

use std::path::Path;

use board_emulator::backend::EmulatedBackend;
use board_emulator::{Settings, gaps};
use firmware::built_in;
use hil_sim::plant::Plant;
use hil_sim::scenario::trace::Row;
use hil_sim::scenario::{self, Outcome, Scenario, VirtualBackend};
use model::vehicle::Vehicle;

use crate::support::firmware;

/// Largest difference between the two boards' trajectories: they differ in the instants of sensing and
/// switching within a tick and in the rounding of duties and voltages, not in what they decide.
const SPEED_TOLERANCE_M_S: f64 = 0.05;
const PHI_TOLERANCE_RAD: f64 = 0.05;
const POSITION_TOLERANCE_M: f64 = 0.25;
/// The boards' states are sent at different phases of the tick.
const ROW_TIME_TOLERANCE_S: f64 = 0.006;

fn scenario() -> Scenario {
    Scenario::read(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/scenarios/slope-drive.toml"))
        .expect("the scenario is valid")
}

fn world(scenario: &Scenario) -> (Vehicle<f64>, Plant) {
    let vehicle = Vehicle::new(built_in::PARAMETERS.cast::<f64>()).expect("the built-in vehicle");
    let plant = Plant::new(&vehicle, scenario.terrain.clone(), scenario.seed).expect("the terrain is drivable");
    (vehicle, plant)
}

fn drive_virtual(scenario: &Scenario) -> Outcome {
    let (vehicle, plant) = world(scenario);
    let mut backend = VirtualBackend::boot(&vehicle, plant).expect("the virtual board boots");
    scenario::run(scenario, &mut backend, |_| {})
}

fn check(scenario: &Scenario, outcome: &Outcome, board: &str) {
    for check in scenario::evaluate(scenario, outcome) {
        assert!(check.ok, "{board}: {check:?}");
    }
}

#[test]
fn the_slope_drive_is_the_virtual_boards() {
    let scenario = scenario();
    let (_, plant) = world(&scenario);
    let mut backend = EmulatedBackend::power_on(firmware(), plant, Settings::default()).expect("the board powers up");
    let emulated = scenario::run(&scenario, &mut backend, |_| {});
    let (found, resets) = backend
        .emulation()
        .expect("it ran to the end")
        .at(|stopped| (stopped.gaps(), stopped.resets()))
        .expect("it ran to the end");
    assert_eq!(gaps::unexpected(&found), []);
    assert_eq!(resets, []);
    let virtual_one = drive_virtual(&scenario);

    check(&scenario, &emulated, "emulated");
    check(&scenario, &virtual_one, "virtual");
    assert_eq!(emulated.bad_frames, 0);
    assert_eq!(emulated.unarmed_drive_ms, 0);
    let last = emulated.trace.rows.last().expect("a trace");
    assert_eq!(last.status.late_ticks, 0, "over {} s", scenario.duration_s);

    let mut rows = virtual_one.trace.rows.iter().peekable();
    let (mut compared, mut speed, mut phi, mut position) = (0, 0.0_f64, 0.0_f64, 0.0_f64);
    for row in &emulated.trace.rows {
        while rows.next_if(|other| other.time_s() < row.time_s() - ROW_TIME_TOLERANCE_S).is_some() {}
        let Some(other) = rows.peek().filter(|other| other.time_s() < row.time_s() + ROW_TIME_TOLERANCE_S) else {
            continue;
        };
        compared += 1;
        let difference = |value: fn(&Row) -> f64| (value(row) - value(other)).abs();
        speed = speed.max(difference(|row| row.truth.speed_m_s));
        phi = phi.max(difference(|row| row.truth.phi_rad));
        position = position.max(difference(|row| row.truth.x_m).hypot(difference(|row| row.truth.y_m)));
    }
    println!("{compared} states compared: speed {speed:.4} m/s, phi {phi:.4} rad, position {position:.3} m");
    assert!(compared * 10 >= emulated.trace.rows.len() * 9);
    assert!(speed < SPEED_TOLERANCE_M_S, "{speed}");
    assert!(phi < PHI_TOLERANCE_RAD, "{phi}");
    assert!(position < POSITION_TOLERANCE_M, "{position}");
}
