//! Scenarios driven by the flashed code, compared with the virtual board's drive.

use std::path::Path;

use board_emulator::board::gaps;
use board_emulator::run::{EmulatedBackend, EmulationSettings};
use board_emulator::vehicle::stored;
use firmware::built_in;
use model::vehicle::{Vehicle, VehicleParameters};
use plant::Plant;
use virtual_board::scenario::trace::TraceRow;
use virtual_board::scenario::{self, DriveOutcome, Scenario, VirtualBackend};

use crate::support::firmware;

/// Largest differences between the two boards' trajectories. Both boards run the same code on different readings:
/// the emulated board's clock starts at another instant, so that its ticks meet commands and the sensors' noise at
/// another phase, and its readings pass converters and registers that round.
const SPEED_PEAK_M_S: f64 = 0.03;
const SPEED_RMS_M_S: f64 = 0.003;
const PHI_PEAK_RAD: f64 = 0.01;
const PHI_RMS_RAD: f64 = 0.001;
const POSITION_PEAK_M: f64 = 0.05;

fn scenario(name: &str) -> Scenario {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/scenarios");
    Scenario::read(&folder.join(format!("{name}.toml"))).expect("the scenario is valid")
}

fn world(scenario: &Scenario) -> (Vehicle<f64>, Plant) {
    let vehicle = Vehicle::new(built_in::PARAMETERS.cast::<f64>()).expect("the built-in vehicle");
    let plant = scenario.plant(&vehicle).expect("the terrain is drivable");
    (vehicle, plant)
}

fn drive_virtual(scenario: &Scenario) -> DriveOutcome {
    let (vehicle, plant) = world(scenario);
    let mut backend = VirtualBackend::boot(&vehicle, plant).expect("the virtual board boots");
    scenario::run(scenario, &mut backend, |_| {}).expect("a valid plant")
}

/// Drives with a vehicle that is stored in the emulated board's flash.
fn drive_stored(scenario: &Scenario, parameters: &VehicleParameters<f64>) -> DriveOutcome {
    let vehicle = Vehicle::new(*parameters).expect("a consistent vehicle");
    let plant = scenario.plant(&vehicle).expect("the terrain is drivable");
    let contents = [stored::set(&vehicle).expect("consistent in single precision")];
    let mut backend = EmulatedBackend::power_on_with(firmware(), plant, EmulationSettings::default(), &contents)
        .expect("the board powers up");
    scenario::run(scenario, &mut backend, |_| {}).expect("a valid plant")
}

fn check(scenario: &Scenario, outcome: &DriveOutcome, board: &str) {
    for check in scenario::evaluate(scenario, outcome) {
        assert!(check.ok, "{board}: {check:?}");
    }
}

#[test]
fn the_slope_drive_is_the_virtual_boards() {
    let scenario = scenario("slope-drive");
    let (_, plant) = world(&scenario);
    let mut backend =
        EmulatedBackend::power_on(firmware(), plant, EmulationSettings::default()).expect("the board powers up");
    let emulated = scenario::run(&scenario, &mut backend, |_| {}).expect("a valid plant");
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
    assert_eq!(emulated.counts.host_unreadable_frames, 0);
    assert_eq!(emulated.counts.unarmed_drive_ms, 0);
    let last = emulated.trace.rows.last().expect("a trace");
    assert_eq!(last.status.late_ticks, 0, "over {} s", scenario.duration_s);

    let rows = &virtual_one.trace.rows;
    let (mut speed, mut phi, mut position) = (Vec::new(), Vec::new(), Vec::new());
    for row in &emulated.trace.rows {
        // Between the virtual board's rows before and after: the two boards send their status at different phases.
        let after = rows.partition_point(|other| other.time_s() < row.time_s());
        let Some([before, after]) = after.checked_sub(1).and_then(|before| rows.get(before..=after)) else {
            continue;
        };
        let share = (row.time_s() - before.time_s()) / (after.time_s() - before.time_s());
        let difference =
            |value: fn(&TraceRow) -> f64| value(row) - (value(before) + share * (value(after) - value(before)));
        speed.push(difference(|row| row.truth.speed_m_s));
        phi.push(difference(|row| row.truth.phi_rad));
        position.push(difference(|row| row.truth.x_m).hypot(difference(|row| row.truth.y_m)));
    }
    println!(
        "{} states compared: speed {:.4} m/s (rms {:.4}), phi {:.4} rad (rms {:.4}), position {:.3} m",
        speed.len(),
        peak(&speed),
        rms(&speed),
        peak(&phi),
        rms(&phi),
        peak(&position)
    );
    assert!(speed.len() * 10 >= emulated.trace.rows.len() * 9);
    assert!(peak(&speed) < SPEED_PEAK_M_S && rms(&speed) < SPEED_RMS_M_S);
    assert!(peak(&phi) < PHI_PEAK_RAD && rms(&phi) < PHI_RMS_RAD);
    assert!(peak(&position) < POSITION_PEAK_M);
}

/// A vehicle with larger wheels is stored in the flash: the firmware's odometry agrees with the plant.
#[test]
fn a_vehicle_laid_into_the_flash_is_the_one_flown() {
    let mut scenario = scenario("emergency-stop");
    // Up to driving at speed.
    scenario.duration_s = 7.0;
    scenario.steps.retain(|step| step.at_s < scenario.duration_s);
    let mut parameters = built_in::PARAMETERS.cast::<f64>();
    parameters.body.wheel_radius_m *= 1.08;
    let outcome = drive_stored(&scenario, &parameters);
    stored::was_taken(&outcome.log).expect("it is flown");
    let last = outcome.trace.rows.last().expect("a trace");
    let (reported, truth) = (f64::from(last.status.estimate.speed_m_s), last.truth.speed_m_s);
    println!("{reported:.4} m/s reported, {truth:.4} m/s driven");
    assert!((0.8..1.2).contains(&truth), "{truth}");
    assert!(
        (reported / truth - 1.0).abs() < 0.01,
        "{reported} reported, {truth} driven"
    );
}

#[test]
fn a_vehicle_of_another_kind_is_not_taken() {
    let mut scenario = scenario("emergency-stop");
    scenario.duration_s = 0.2;
    scenario.steps.clear();
    let mut parameters = built_in::PARAMETERS.cast::<f64>();
    parameters.spar = None;
    let outcome = drive_stored(&scenario, &parameters);
    let refused = stored::was_taken(&outcome.log).expect_err("the firmware has a spar");
    assert!(refused.to_string().contains("camera spar"), "{refused}");
    assert!(
        outcome
            .log
            .iter()
            .any(|line| line.contains("set of another firmware, read by name: 24 new ones as built in")),
        "{:#?}",
        outcome.log
    );
}

fn peak(values: &[f64]) -> f64 {
    values.iter().fold(0.0, |peak: f64, value| peak.max(value.abs()))
}

fn rms(values: &[f64]) -> f64 {
    (values.iter().map(|value| value * value).sum::<f64>() / values.len() as f64).sqrt()
}
