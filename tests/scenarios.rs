//! Every scenario file is a test: the virtual board runs the scenario, and each of its metrics must lie within its bounds.

use std::path::Path;

use hil_sim::cli::drive::rows::{write_header, write_row};
use virtual_board::scenario::trace::Trace;
use virtual_board::scenario::{self, DriveOutcome, Scenario, VirtualBackend, evaluate};

use model::vehicle::{ParameterError, Vehicle};
use theory::analysis::lqr::{Weights, regulator};

mod support;
use support::reference;

const FOLDER: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../tests/scenarios");

fn run(name: &str) -> (Scenario, DriveOutcome) {
    let scenario = Scenario::read(&Path::new(FOLDER).join(format!("{name}.toml"))).expect("a good file");
    let outcome = drive(&scenario, &reference());
    (scenario, outcome)
}

fn drive(scenario: &Scenario, vehicle: &Vehicle<f64>) -> DriveOutcome {
    let plant = scenario.plant(vehicle).expect("drivable");
    let mut backend = VirtualBackend::boot(vehicle, plant).expect("boots");
    let outcome = scenario::run(scenario, &mut backend, |_| {}).expect("a valid plant");
    assert!(!backend.board.watchdog_bitten(), "nothing feeds the watchdog");
    outcome
}

fn check(name: &str) {
    let (scenario, outcome) = run(name);
    let checks = evaluate(&scenario, &outcome);
    assert!(checks.len() >= 5, "{name} has too few bounds");
    let failed: Vec<_> = checks.iter().filter(|check| !check.ok).collect();
    assert!(
        failed.is_empty(),
        "{name}, seed {}: {failed:#?}\n{}",
        scenario.seed,
        outcome.log.join("\n")
    );
}

macro_rules! scenarios {
    ($($function:ident = $file:literal,)*) => {
        $(#[test] fn $function() { check($file); })*

        const FILES: &[&str] = &[$($file),*];

        /// No scenario file is left out.
        #[test]
        fn every_scenario_file_is_a_test() {
            let mut files: Vec<String> = std::fs::read_dir(FOLDER)
                .expect("the folder")
                .map(|entry| entry.expect("an entry").path())
                .filter_map(|path| Some(path.file_stem()?.to_str()?.to_owned()))
                .collect();
            files.sort();
            let mut tested = vec![$($file.to_owned()),*];
            tested.sort();
            assert_eq!(files, tested);
        }
    };
}

scenarios! {
    slope_drive = "slope-drive",
    zero_radius_turn = "zero-radius-turn",
    side_slope = "side-slope",
    figure_of_eight = "figure-of-eight",
    rail_inspection = "rail-inspection",
    slippery_patch = "slippery-patch",
    kerb = "kerb",
    dead_man = "dead-man",
    emergency_stop = "emergency-stop",
}

/// With IMU clocks as wrong as the part's data sheet allows (1 % at room temperature), every scenario stays within its bounds.
#[test]
fn no_scenario_needs_exact_clocks_of_the_imus() {
    for (n, name) in FILES.iter().enumerate() {
        let mut scenario = Scenario::read(&Path::new(FOLDER).join(format!("{name}.toml"))).expect("a good file");
        let error = if n % 2 == 0 { 0.01 } else { -0.01 };
        scenario.plant.arm_imu.clock_error = error;
        scenario.plant.spar_imu.clock_error = -error;
        let outcome = drive(&scenario, &reference());
        let checks = evaluate(&scenario, &outcome);
        let failed: Vec<_> = checks.iter().filter(|check| !check.ok).collect();
        assert!(failed.is_empty(), "{name}, {error}: {failed:#?}");
    }
}

/// The trace as the tool writes it.
fn csv(trace: &Trace) -> String {
    let mut text = Vec::new();
    write_header(&mut text).expect("memory");
    for row in &trace.rows {
        write_row(&mut text, row).expect("memory");
    }
    String::from_utf8(text).expect("text")
}

/// Two runs with one seed give the same trace and the same log, byte for byte.
#[test]
fn a_run_is_reproducible_to_the_bit() {
    let trace = || {
        let (_, outcome) = run("slope-drive");
        (csv(&outcome.trace), outcome.log)
    };
    let (first, second) = (trace(), trace());
    assert_eq!(first, second);
    assert!(first.0.lines().count() > 5000 && first.1.len() > 50);
}

/// Two vehicles in two threads do not share their time.
#[test]
fn two_runs_in_two_threads_are_two_runs_in_one() {
    let fly = |name: &'static str| move || csv(&run(name).1.trace);
    let alone = (fly("kerb")(), fly("side-slope")());
    let (kerb, side) = (std::thread::spawn(fly("kerb")), std::thread::spawn(fly("side-slope")));
    assert_eq!((kerb.join().expect("runs"), side.join().expect("runs")), alone);
}

/// The reference vehicle with another spar and these gains.
fn with_spar(gains: [f64; 4]) -> Result<Vehicle<f64>, ParameterError> {
    let mut parameters = *reference().parameters();
    let (spar, _) = parameters.spar.as_mut().expect("the reference has a spar");
    spar.camera_mass_kg = 1.0;
    spar.ballast_mass_kg = 3.0;
    spar.motor_distance_m = 0.08;
    spar.ballast_distance_m = 0.06;
    [
        spar.spar_gain,
        spar.ballast_gain,
        spar.spar_rate_gain,
        spar.ballast_rate_gain,
    ] = gains;
    Vehicle::new(parameters)
}

#[test]
fn another_spar_is_levelled_by_its_own_gains() {
    let mut scenario = Scenario::read(&Path::new(FOLDER).join("slope-drive.toml")).expect("a good file");
    scenario.duration_s = 20.0;
    scenario.steps.retain(|step| step.at_s < scenario.duration_s);
    let off = with_spar([0.0; 4]).expect("four zeros are no levelling");
    let spar = off.camera().expect("a spar");
    let optimal = regulator(&spar, &Weights::THESIS).expect("a regulator").gains;
    let on = with_spar(optimal).expect("gains that hold the spar");

    let spar_peak_deg = |vehicle: &Vehicle<f64>| {
        let outcome = drive(&scenario, vehicle);
        let rows = &outcome.trace.rows;
        let last = rows.last().expect("a trace").status;
        assert!(last.faults.is_empty());
        let driving = rows.iter().filter(|row| row.commanded[0] != 0.0);
        driving.fold(0.0, |peak: f64, row| peak.max(row.truth.spar_rad.abs().to_degrees()))
    };
    let (levelled, swinging) = (spar_peak_deg(&on), spar_peak_deg(&off));
    println!("{levelled:.2} deg levelled, {swinging:.2} deg not");
    assert!((0.1..2.0).contains(&levelled), "{levelled}");
    assert!((4.0..45.0).contains(&swinging), "{swinging}");

    let refused = with_spar(optimal.map(|gain| -gain)).expect_err("the wrong sign");
    assert!(refused.to_string().contains("hold this spar"), "{refused}");
}
