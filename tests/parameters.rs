//! Stored parameters over the link of the virtual board.

use firmware::protocol::message::{Answer, Order, ParameterAnswer, ParameterRequest};
use model::supervise::arming::Mode;
use model::vehicle::VehicleParameters;
use virtual_board::board::flash::VirtualFlash;
use virtual_board::board::log;

mod support;
use support::{Bench, reference};

fn ask(bench: &mut Bench, request: ParameterRequest) -> ParameterAnswer {
    match bench.ask(Order::Parameters(request)) {
        Some(Answer::Parameters(answer)) => answer,
        other => panic!("{request:?}: {other:?}"),
    }
}

/// The number of a parameter, as host and board count them.
fn number(parameters: &VehicleParameters<f64>, table: &str, name: &str) -> u16 {
    parameters.number_of(table, name).expect("known")
}

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
        bench.request(model::command::Request::Arm);
        bench.run(20);
        bench.drive = Some([2.0, 0.0]);
        bench.run(6000);
        let speed = bench.board.world(|world| world.plant.truth().speed_m_s);
        assert!((speed - 0.5).abs() < 0.1, "{speed}");
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
    // In range on its own, and contradicting the total mass.
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
        ask(&mut bench, ParameterRequest::Defaults),
        ParameterAnswer::DefaultsReady
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
        ask(&mut bench, ParameterRequest::Defaults),
        ParameterAnswer::DefaultsReady
    );
    assert_eq!(ask(&mut bench, ParameterRequest::Store), ParameterAnswer::Stored);
}

#[test]
fn nothing_is_stored_while_armed() {
    let mut bench = Bench::armed(4);
    assert_eq!(ask(&mut bench, ParameterRequest::Store), ParameterAnswer::Armed);
    assert_eq!(bench.mode(), Mode::Armed, "and the vehicle drives on");
}

#[test]
fn random_flash_boots_to_the_built_in_set() {
    for seed in 0..8_u64 {
        let flash = VirtualFlash::erased();
        let mut noise = plant::noise::Noise::new(seed, 1);
        let bytes: Vec<u8> = (0..256 * 1024).map(|_| noise.bits() as u8).collect();
        flash.overwrite(&bytes);
        let mut bench = Bench::with(seed, flash);
        bench.run(1500);
        let lines = log::take();
        assert!(lines.iter().any(|line| line.contains("built-in set")), "{lines:?}");
        bench.request(model::command::Request::Arm);
        bench.run(20);
        assert_eq!(bench.mode(), Mode::Armed);
    }
}
