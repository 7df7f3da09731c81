//! Stored parameters over the link of the virtual board.

use firmware::protocol::message::{Answer, Order, ParameterAnswer, ParameterRequest};
use model::command::Request;
use model::sample::Motor;
use model::supervise::arming::Mode;
use model::supervise::codes::{Blocker, Fault};
use plant::fault::SensorFault;
use virtual_board::board::flash::VirtualFlash;
use virtual_board::board::hardware::World;
use virtual_board::board::log;

#[path = "support/questions.rs"]
mod questions;
mod support;
use questions::{ask, number};
use support::{Bench, reference};

#[test]
fn a_stored_parameter_is_in_force_after_the_next_boot_and_before() {
    let vehicle = reference();
    let speed_max = number(vehicle.parameters(), "control", "speed_max_m_s");
    let flash = VirtualFlash::erased();
    {
        let mut bench = Bench::with(1, flash.clone());
        bench.run(1000);
        assert!(
            log::take()
                .iter()
                .any(|line| line.contains("nothing stored, built-in set"))
        );
        let answer = ask(&mut bench, ParameterRequest::Read { number: speed_max });
        assert!(
            matches!(answer, ParameterAnswer::Value { value: 2.5, .. }),
            "{answer:?}"
        );
        let answer = ask(
            &mut bench,
            ParameterRequest::Write {
                number: speed_max,
                value: 0.5,
            },
        );
        assert!(
            matches!(answer, ParameterAnswer::Value { value: 0.5, .. }),
            "{answer:?}"
        );
        assert_eq!(ask(&mut bench, ParameterRequest::Store), ParameterAnswer::Stored);
    }
    for round in 0..2 {
        let mut bench = Bench::with(2, flash.clone());
        bench.run(1500);
        assert!(
            log::take().iter().any(|line| line.contains("parameters: stored set")),
            "boot {round}"
        );
        bench.request(Request::Arm);
        bench.run(20);
        bench.drive = Some([2.0, 0.0]);
        bench.run(6000);
        let speed = bench.board.world(|world| world.plant.truth().speed_m_s);
        // A speed on the level settles within 2 %; 10 mm/s is also what the wheels' ripple may add.
        assert!((speed - 0.5).abs() < 0.02, "{speed}");
    }
}

#[test]
fn bad_values_are_refused_with_their_range_and_nothing_changes() {
    let vehicle = reference();
    let radius = number(vehicle.parameters(), "body", "wheel_radius_m");
    let arm = number(vehicle.parameters(), "body", "arm_mass_kg");
    let mut bench = Bench::new(3);
    bench.run(1000);
    for value in [f32::NAN, f32::INFINITY, -1.0, 0.0, 1e6] {
        let answer = ask(&mut bench, ParameterRequest::Write { number: radius, value });
        assert_eq!(answer, ParameterAnswer::OutOfRange { min: 0.01, max: 2.0 }, "{value}");
    }
    let answer = ask(
        &mut bench,
        ParameterRequest::Write {
            number: 9999,
            value: 1.0,
        },
    );
    assert_eq!(answer, ParameterAnswer::NoSuchNumber);
    // In its own range, but in contradiction to the total mass.
    ask(
        &mut bench,
        ParameterRequest::Write {
            number: arm,
            value: 100.0,
        },
    );
    assert_eq!(
        ask(&mut bench, ParameterRequest::Store),
        ParameterAnswer::Inconsistent { number: arm }
    );
    assert_eq!(
        ask(&mut bench, ParameterRequest::BuiltIn),
        ParameterAnswer::BuiltInReady
    );
    assert_eq!(ask(&mut bench, ParameterRequest::Store), ParameterAnswer::Stored);
}

#[test]
fn every_documented_bound_is_accepted_as_printed_over_the_link() {
    let vehicle = reference();
    let parameters = vehicle.parameters();
    let mut bench = Bench::new(7);
    bench.run(500);
    for number in 0..parameters.count() {
        let (table, field) = parameters.field(number).expect("a field");
        for bound in [field.min, field.max] {
            // As an operator types it, and as the tool sends it.
            let value: f32 = format!("{bound}").parse().expect("a number");
            let answer = ask(&mut bench, ParameterRequest::Write { number, value });
            assert!(
                matches!(answer, ParameterAnswer::Value { value: kept, .. } if kept == value),
                "{table}.{} = {bound}: {answer:?}",
                field.name
            );
        }
    }
}

#[test]
fn limits_that_the_sensors_cannot_measure_are_not_stored() {
    let vehicle = reference();
    for (table, name, beyond, within) in [
        ("battery", "maximum_v", 75.0, 60.0),
        ("safety", "overcurrent_a", 200.0, 55.0),
        ("safety", "overcurrent_a", 60.0, 58.0),
    ] {
        let limit = number(vehicle.parameters(), table, name);
        let mut bench = Bench::new(8);
        bench.run(1000);
        for (value, expected) in [
            (beyond, ParameterAnswer::Inconsistent { number: limit }),
            (within, ParameterAnswer::Stored),
        ] {
            ask(&mut bench, ParameterRequest::Write { number: limit, value });
            assert_eq!(ask(&mut bench, ParameterRequest::Store), expected, "{name} = {value}");
        }
    }
}

#[test]
fn gains_that_do_not_hold_the_spar_are_not_stored() {
    let vehicle = reference();
    let gain = number(vehicle.parameters(), "spar", "spar_gain");
    let mut bench = Bench::new(6);
    bench.run(1000);
    // As (7.21) prints it (erratum E28).
    let printed = ParameterRequest::Write {
        number: gain,
        value: 92.06,
    };
    assert!(matches!(
        ask(&mut bench, printed),
        ParameterAnswer::Value { value, .. } if value == 92.06
    ));
    assert_eq!(
        ask(&mut bench, ParameterRequest::Store),
        ParameterAnswer::Inconsistent { number: gain }
    );
    assert_eq!(
        ask(&mut bench, ParameterRequest::BuiltIn),
        ParameterAnswer::BuiltInReady
    );
    assert_eq!(ask(&mut bench, ParameterRequest::Store), ParameterAnswer::Stored);
}

#[test]
fn nothing_is_stored_while_armed() {
    let mut bench = Bench::armed(4);
    assert_eq!(ask(&mut bench, ParameterRequest::Store), ParameterAnswer::Armed);
    assert_eq!(bench.mode(), Mode::Armed, "a refused store ends the drive");
}

/// A parameter's value in force, and its staged value.
fn both(bench: &mut Bench, number: u16) -> [f32; 2] {
    [
        ParameterRequest::Read { number },
        ParameterRequest::ReadStaged { number },
    ]
    .map(|request| match ask(bench, request) {
        ParameterAnswer::Value { value, .. } => value,
        other => panic!("{other:?}"),
    })
}

#[test]
fn a_refused_set_leaves_no_trace() {
    let vehicle = reference();
    let arm = number(vehicle.parameters(), "body", "arm_mass_kg");
    let speed = number(vehicle.parameters(), "control", "speed_max_m_s");
    let ki = number(vehicle.parameters(), "control", "ki");
    let built_in_ki = vehicle.parameters().control.ki as f32;
    let mut bench = Bench::new(9);
    bench.run(1000);
    let write = |bench: &mut Bench, number, value| ask(bench, ParameterRequest::Write { number, value });

    // Refused because the set contradicts itself.
    write(&mut bench, arm, 100.0);
    write(&mut bench, speed, 9.0);
    assert_eq!(
        ask(&mut bench, ParameterRequest::Store),
        ParameterAnswer::Inconsistent { number: arm }
    );
    assert_eq!(both(&mut bench, speed), [2.5; 2]);
    // Refused because a value is out of its range.
    write(&mut bench, speed, 9.0);
    assert!(matches!(write(&mut bench, ki, 7.0), ParameterAnswer::OutOfRange { .. }));
    assert_eq!(both(&mut bench, speed), [2.5; 2]);
    // Refused because the vehicle is armed.
    bench.request(Request::Arm);
    bench.run(20);
    write(&mut bench, ki, 0.05);
    assert_eq!(both(&mut bench, ki), [built_in_ki, 0.05]);
    assert_eq!(ask(&mut bench, ParameterRequest::Store), ParameterAnswer::Armed);
    assert_eq!(both(&mut bench, ki), [built_in_ki; 2]);
    bench.request(Request::Disarm);
    bench.run(20);
    // Abandoned by the host that staged it.
    write(&mut bench, speed, 9.0);
    assert_eq!(ask(&mut bench, ParameterRequest::Discard), ParameterAnswer::Discarded);
    assert_eq!(both(&mut bench, speed), [2.5; 2]);

    // The next stored set contains none of these changes.
    write(&mut bench, arm, 12.0);
    assert_eq!(ask(&mut bench, ParameterRequest::Store), ParameterAnswer::Stored);
    assert_eq!(both(&mut bench, arm), [12.0; 2]);
    assert_eq!(both(&mut bench, speed), [2.5; 2]);
    assert_eq!(both(&mut bench, ki), [built_in_ki; 2]);
}

#[test]
fn changes_that_nobody_stores_are_dropped_after_10_s() {
    let ki = number(reference().parameters(), "control", "ki");
    let built_in = reference().parameters().control.ki as f32;
    let mut bench = Bench::new(10);
    bench.run(100);
    let write = |bench: &mut Bench, value| ask(bench, ParameterRequest::Write { number: ki, value });
    write(&mut bench, 0.04);
    bench.run(9000);
    assert_eq!(
        both(&mut bench, ki),
        [built_in, 0.04],
        "reading drops or renews a staged change"
    );
    // Each further change restarts the time.
    write(&mut bench, 0.05);
    bench.run(9000);
    assert_eq!(both(&mut bench, ki), [built_in, 0.05]);
    bench.run(900);
    assert_eq!(both(&mut bench, ki), [built_in; 2]);
}

/// A fault, and the switch for the failure that latches the fault and can end again.
type Failure = (Fault, fn(&mut World, bool));

const FAILURES: [Failure; 3] = [
    (Fault::EmergencyStop, |world, fails| world.press_stop(fails)),
    (Fault::BatteryHigh, |world, fails| {
        world.plant.battery_mut().open_circuit_v = if fails { 33.0 } else { 25.2 };
    }),
    (Fault::EncoderImplausible, |world, fails| {
        let fault = if fails { SensorFault::Off } else { SensorFault::None };
        world.plant.encoder_mut(Motor::Left).set_fault(fault);
    }),
];

#[test]
fn a_store_keeps_latched_faults_the_lamp_and_the_pose() {
    for (failure, drive, stored, seeds) in [
        (FAILURES[0], [1.0, 0.6], ("control", "ki", 0.05), [11, 21]),
        (
            FAILURES[1],
            [-0.8, -0.5],
            ("safety", "command_timeout_s", 0.4),
            [12, 22],
        ),
        (FAILURES[2], [0.5, 0.8], ("body", "half_track_m", 0.26), [13, 23]),
    ] {
        for seed in seeds {
            store_after(failure, drive, stored, seed);
        }
    }
}

fn store_after((fault, fail): Failure, drive: [f32; 2], (table, name, value): (&str, &str, f32), seed: u64) {
    let story = format!("{fault:?}, {table}.{name}, seed {seed}");
    let mut bench = Bench::armed(seed);
    bench.drive = Some(drive);
    bench.run(4000);
    bench.board.world(|world| fail(world, true));
    bench.run(700);
    bench.board.world(|world| fail(world, false));
    bench.drive = Some([0.0, 0.0]);
    // Until the arm hangs still.
    bench.run(20_000);
    bench.request(Request::Arm);
    bench.run(100);
    let before = bench.board.status().expect("it runs");
    assert_eq!(before.mode, Mode::Disarmed, "{story}");
    assert!(
        before.faults.contains(fault) && before.blockers.contains(Blocker::FaultLatched),
        "{story}: {}",
        before.faults
    );
    assert_eq!(before.refused_arms, 1, "{story}");
    let told = before.estimate;
    assert!(
        told.distance_m.abs() > 0.5 && told.y_m.abs() > 0.1 && told.heading_rad.abs() > 0.5,
        "{story}: {told:?}"
    );

    let number = number(reference().parameters(), table, name);
    ask(&mut bench, ParameterRequest::Write { number, value });
    let since = bench.board.status().expect("it runs");
    let mut recalibrated = false;
    let store = bench.order(Order::Parameters(ParameterRequest::Store));
    bench.run_watching(1500, |bench| {
        let now = bench.board.status().expect("it runs");
        recalibrated |= now.blockers.contains(Blocker::NotCalibrated);
        assert_eq!(now.faults, before.faults, "{story}");
        assert!(now.blockers.contains(Blocker::FaultLatched), "{story}");
        assert_eq!(now.refused_arms, 1, "{story}");
        assert!(bench.board.world(|world| world.lamps.1), "{story}: the lamp goes out");
        for (now, before) in [
            (now.estimate.x_m, since.estimate.x_m),
            (now.estimate.y_m, since.estimate.y_m),
            (now.estimate.distance_m, since.estimate.distance_m),
            (now.estimate.heading_rad, since.estimate.heading_rad),
        ] {
            assert!((now - before).abs() < 5e-3, "{story}: {before} became {now}");
        }
    });
    assert_eq!(
        bench.client.answer_to(store),
        Some(Answer::Parameters(ParameterAnswer::Stored)),
        "{story}"
    );
    assert!(
        recalibrated,
        "{story}: the gyros are not calibrated anew, so the new set is not in force"
    );
    let after = bench.board.status().expect("it runs");
    assert_eq!(
        after.tick - since.tick,
        1500,
        "{story}: the count of ticks does not go on"
    );

    // After a drive the vehicle rocks, and the calibration averages the gyros over 4 s.
    bench.run(3000);
    bench.request(Request::ClearFaults);
    bench.run(60);
    bench.request(Request::Arm);
    bench.run(20);
    let blockers = bench.status().vehicle.blockers;
    assert_eq!(bench.mode(), Mode::Armed, "{story}: blockers {blockers}");
}
