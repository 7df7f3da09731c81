//! The bring-up procedure against the virtual board, with a scripted person whose hands act on the simulated vehicle.
//! The step that looks for an error of the board must report the error, before anything is armed.

use std::fmt::Write as _;

use hil_sim::cli::bring_up::judge;
use hil_sim::cli::bring_up::steps::STEPS;
use hil_sim::cli::bring_up::verdict::StepVerdict;
use model::sample::Motor;
use model::vehicle::{Vehicle, VehicleParameters};
use plant::analog::{AnalogFault, Following};
use plant::fault::SensorFault;
use plant::settings::{ImuSettings, PlantSettings};
use plant::wiring::Leads;
use virtual_board::board::flash::VirtualFlash;
use virtual_board::scenario::Sensor;

#[path = "support/hands.rs"]
mod hands;
#[path = "support/procedure.rs"]
mod procedure;
mod support;
#[path = "support/wires.rs"]
mod wires;
use hands::Shared;
use procedure::{Done, SIMULATED, bring_up, bring_up_on, good, verdict};
use support::generated;
use support::{Bench, reference};

#[test]
fn a_good_board_passes_every_step_that_it_can_show() {
    let done = bring_up(|_, _| {}, good, SIMULATED);
    let report = done.report.expect("carried out");
    for (line, step) in report.steps.iter().zip(STEPS) {
        let expected = if step.bench_only {
            StepVerdict::NotShown
        } else {
            StepVerdict::Passed
        };
        assert_eq!(line.finding.verdict, expected, "{}\n{}", report.text(), done.console);
    }
    assert!(done.last_is_disarm);
    judge(&report).expect("nothing failed");
}

/// A board without the bridges' supply refuses an image as it refuses one on an empty battery.
#[test]
fn an_image_is_sent_once_the_supply_is_on() {
    let at = |title: &str| STEPS.iter().position(|step| step.title == title).expect(title);
    assert!(at("supply on") < at("update") && STEPS[at("update")].powered);
}

/// The mounting of an IMU that faces backward.
fn backward() -> ImuSettings {
    ImuSettings {
        misalignment_z_deg: 180.0,
        ..ImuSettings::default()
    }
}

fn exchange_leads(bench: &mut Bench, motor: Motor) {
    bench
        .board
        .world(|world| world.plant.set_leads(motor as usize, Leads::Exchanged));
}

/// The board of the reference vehicle without its spar.
fn bench_without_spar() -> Bench {
    bench_of(|parameters| parameters.spar = None)
}

/// The board of the reference vehicle with gains that hardly level its spar.
fn bench_of_weak_gains() -> Bench {
    bench_of(|parameters| {
        let (spar, _) = parameters.spar.as_mut().expect("a spar");
        spar.spar_gain *= 0.01;
        spar.ballast_gain *= 0.01;
        spar.spar_rate_gain *= 0.01;
        spar.ballast_rate_gain *= 0.01;
    })
}

/// The board of the reference vehicle with other parameters.
fn bench_of(change: impl FnOnce(&mut VehicleParameters<f64>)) -> Bench {
    let mut parameters = *reference().parameters();
    change(&mut parameters);
    let vehicle = Vehicle::new(parameters).expect("a vehicle");
    let erased = VirtualFlash::erased;
    let mut bench = Bench::of(&vehicle, 31, erased(), erased(), &PlantSettings::default());
    bench.run(1000);
    bench
}

/// What is wrong with a board, the step that reports it, and whether that is before anything is armed.
#[test]
fn what_is_wrong_is_told_by_its_step() {
    type Wrong = fn(&mut Bench, &mut Shared);
    let cases: [(&str, bool, Wrong); 17] = [
        ("contacts", true, |_, shared| shared.welded = true),
        ("current zeros", true, |_, shared| {
            shared.current_offset_a = [0.0, 1.0, 0.0];
        }),
        ("current gain", true, |_, shared| shared.current_gain = [1.0, 0.8, 1.0]),
        ("current gain", true, |_, shared| shared.current_gain = [-1.0, 1.0, 1.0]),
        ("current gain", true, |_, shared| shared.current_gain = [1.0, 1.0, -1.0]),
        ("arm IMU", true, |bench, _| {
            bench
                .board
                .world(|world| world.plant.arm_imu().sensor_mut().set_fault(SensorFault::WrongSign));
        }),
        ("arm forward", true, |bench, _| {
            bench.board.world(|world| world.plant.arm_imu().mount(&backward()));
        }),
        ("spar IMU", true, |bench, _| {
            bench.set_fault(Sensor::SparImu, SensorFault::Stuck);
        }),
        ("spar IMU", true, |bench, _| {
            bench.set_fault(Sensor::SparImu, SensorFault::WrongSign);
        }),
        ("spar forward", true, |bench, _| {
            bench
                .board
                .world(|world| world.plant.spar_imu().expect("a spar").mount(&backward()));
        }),
        ("ballast", true, |bench, _| {
            bench.set_fault(Sensor::BallastEncoder, SensorFault::WrongSign);
        }),
        ("armed", false, |bench, _| exchange_leads(bench, Motor::Ballast)),
        ("armed", false, |bench, _| exchange_leads(bench, Motor::Left)),
        ("levelling", false, |bench, _| {
            bench
                .board
                .world(|world| world.plant.set_leads(Motor::Ballast as usize, Leads::Open));
        }),
        ("wheels", true, |bench, _| {
            bench
                .board
                .world(|world| world.plant.encoder_mut(Motor::Left).set_fault(SensorFault::WrongSign));
        }),
        ("supply on", true, |bench, _| {
            let fault = AnalogFault {
                following: Following::Dead,
                ..AnalogFault::default()
            };
            bench
                .board
                .world(|world| world.plant.set_analog_fault("battery_voltage", fault));
        }),
        ("armed", false, |bench, _| {
            bench
                .board
                .world(|world| world.plant.set_leads(Motor::Right as usize, Leads::Open));
        }),
    ];
    for (title, unarmed, wrong) in cases {
        is_told_by(title, unarmed, bring_up(wrong, good, SIMULATED));
    }
    let exchanged: Wrong = |bench, _| exchange_leads(bench, Motor::Left);
    is_told_by(
        "armed",
        false,
        bring_up_on(bench_without_spar(), exchanged, good, SIMULATED),
    );
    is_told_by(
        "levelling",
        false,
        bring_up_on(bench_of_weak_gains(), |_, _| {}, good, SIMULATED),
    );
}

/// The procedure ends at this step, before anything is armed or afterwards, and says where to look.
fn is_told_by(title: &str, unarmed: bool, done: Done) {
    let report = done.report.expect("carried out");
    assert_eq!(
        verdict(&report, title),
        StepVerdict::Failed,
        "{title}: {}",
        report.text()
    );
    assert_eq!(report.count(StepVerdict::Failed), 1, "{}", report.text());
    assert_eq!(done.arms == 0, unarmed, "{title}: {} arms", done.arms);
    let look_at = STEPS.iter().find(|step| step.title == title).expect(title).look_at;
    assert!(done.console.contains(look_at), "{}", done.console);
    assert!(judge(&report).expect_err("failed").to_string().contains(title));
    assert!(done.last_is_disarm);
}

/// A vehicle without a spar needs no step of the spar, and is asked nothing about a spar.
#[test]
fn a_vehicle_without_a_spar_skips_the_steps_of_the_spar_by_name() {
    let done = bring_up_on(bench_without_spar(), |_, _| {}, good, SIMULATED);
    let report = done.report.expect("carried out");
    let told = format!("{}\n{}", report.text(), done.console);
    let mut skipped = Vec::new();
    for (line, step) in report.steps.iter().zip(STEPS) {
        let expected = match step {
            step if step.of_spar => StepVerdict::NotNeeded,
            step if step.bench_only => StepVerdict::NotShown,
            _ => StepVerdict::Passed,
        };
        assert_eq!(line.finding.verdict, expected, "{}: {told}", line.title);
        if step.of_spar {
            skipped.push(line.title);
            assert_eq!(line.finding.seen, "the vehicle has no spar");
        }
    }
    assert_eq!(skipped, ["spar IMU", "spar forward", "ballast", "levelling"]);
    assert!(report.summary().ends_with(", 4 not needed"), "{}", report.summary());
    judge(&report).expect("nothing failed");
    for (question, _) in &done.asked {
        assert!(
            !question.contains("spar") && !question.contains("ballast"),
            "{question}"
        );
    }
}

/// The page's table is the tool's.
#[test]
fn the_bring_up_page_has_every_step() {
    let mut text = String::from("| No. | Step | Do | Passes | Fails: look at |\n|---|---|---|---|---|\n");
    for (number, step) in (1..).zip(STEPS) {
        let mark = if step.bench_only { " (b)" } else { "" };
        let _ = writeln!(
            text,
            "| {number} | {}{mark} | {} | {} | {} |",
            step.title, step.does, step.passes, step.look_at
        );
    }
    generated::check("bring-up.md", "steps", &text);
    // Nothing is armed before every step without the bridges' supply is over.
    assert!(STEPS.is_sorted_by_key(|step| step.powered));
    let unpowered = STEPS.iter().filter(|step| !step.powered).count();
    let page = std::fs::read_to_string(generated::root().join("docs/bring-up.md")).expect("readable");
    let told = format!("Steps 1 to {unpowered} run with the bridges'");
    assert!(page.contains(&told), "docs/bring-up.md does not say: {told}");
}

/// What the emulated board cannot show has a step that shows it, or the reason why none can.
#[test]
fn what_no_emulator_shows_a_step_shows_or_a_reason_stands_there() {
    let page = std::fs::read_to_string(generated::root().join("docs/bring-up.md")).expect("readable");
    let (_, table) = page
        .split_once("| Item | Test | The emulator cannot show | Step |\n")
        .expect("the table");
    let rows: Vec<Vec<&str>> = table
        .lines()
        .skip(1)
        .take_while(|line| line.starts_with('|'))
        .map(|line| line.trim_matches('|').split('|').map(str::trim).collect())
        .collect();
    assert!(rows.len() > 30, "{}", rows.len());
    for row in rows {
        let [item, test, hidden, step] = row[..] else {
            panic!("{row:?}")
        };
        // That each of the commands runs a test, tests/docs.rs sees to.
        assert!(test.contains("`cargo hil-elf "), "{item}: {test}");
        if step.is_empty() {
            assert_eq!(hidden, "", "{item}: no step, and no reason");
        } else if step != "all" && !step.starts_with("none: ") {
            for title in step.split("; ") {
                assert!(STEPS.iter().any(|step| step.title == title), "{item}: no step {title}");
            }
        }
    }
}
