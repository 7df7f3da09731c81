//! Leads, bridges, analogue sensors, battery.

use super::*;
use crate::analog::{AnalogFault, Following};
use crate::settings::BatterySettings;
use crate::wiring::{DeadHalf, Leads};

#[test]
fn a_sensor_of_exchanged_leads_reads_the_same_within_a_substep_and_after_it() {
    let drive = [0.1, 0.1, 0.0].map(BridgeState::Duty);
    let mut plant = plant(&bare_vehicle(), &PlantSettings::default());
    plant.set_leads(0, Leads::Exchanged);
    run(&mut plant, 5, drive);
    let counts = plant.analog().left_current;
    let within = plant.analog_after(1e-5, &drive).expect("it rolls").left_current;
    assert!(counts.abs_diff(within) < 500, "{counts}, {within}");
    assert!(plant.bridge_current_a()[0] > 1.0, "{:?}", plant.bridge_current_a());
}

#[test]
fn leads_and_half_bridges_fail_one_motor_each() {
    let drive = [0.1, 0.1, 0.0].map(BridgeState::Duty);
    let jammed = || {
        let mut plant = plant(&bare_vehicle(), &PlantSettings::default());
        plant.set_jammed(0, true);
        plant.set_jammed(1, true);
        plant
    };
    let mut sound = jammed();
    run(&mut sound, 20, drive);
    let current = sound.truth().current_a;
    let mut plant = jammed();
    plant.set_leads(0, Leads::Open);
    run(&mut plant, 20, drive);
    let found = plant.truth();
    assert_eq!((found.current_a[0], found.torque_n_m[0]), (0.0, 0.0));
    assert!((found.current_a[1] / current[1] - 1.0).abs() < 0.05, "{found:?}");
    plant.set_leads(0, Leads::Shorted);
    run(&mut plant, 20, drive);
    assert_eq!(plant.bridge_current_a()[0], 45.0, "the bridge chops into the short");
    assert!(
        plant.truth().current_a[0].abs() < 1e-6,
        "current flows through the armature"
    );
    plant.set_leads(0, Leads::Exchanged);
    run(&mut plant, 20, drive);
    let armature_a = plant.truth().current_a[0];
    assert!((armature_a / current[0] + 1.0).abs() < 0.05, "{armature_a} A");
    assert_eq!(plant.bridge_current_a()[0], -armature_a, "the bridge drives forward");
    // Of 65536 counts the other sign would be some 8000 away.
    let (counts, sound_counts) = (plant.analog().left_current, sound.analog().left_current);
    assert!(counts.abs_diff(sound_counts) < 500, "{counts}, {sound_counts}");
    plant.set_leads(0, Leads::Sound);
    for (dead, duty, works) in [
        (DeadHalf::Forward, 0.1, false),
        (DeadHalf::Forward, -0.1, true),
        (DeadHalf::Backward, 0.1, true),
        (DeadHalf::Backward, -0.1, false),
    ] {
        plant.set_dead_half(0, dead);
        run(&mut plant, 20, [duty, duty, 0.0].map(BridgeState::Duty));
        let [left, right, _] = plant.truth().current_a;
        assert!(right * duty > 0.0);
        assert_eq!(left * duty > 0.0, works, "{dead:?} at {duty}: {left} A");
    }
}

#[test]
fn analogue_sensors_fail_and_the_motors_do_not() {
    let mut plant = plant(&bare_vehicle(), &PlantSettings::default());
    plant.set_analog_fault(
        "left_current",
        AnalogFault {
            offset: 5.0,
            ..AnalogFault::default()
        },
    );
    plant.set_analog_fault(
        "battery_voltage",
        AnalogFault {
            following: Following::Dead,
            ..AnalogFault::default()
        },
    );
    run(&mut plant, 10, OPEN);
    let analog = plant.analog();
    let amperes = |count| SCALES.analog.left_current.value(count);
    assert!((amperes(analog.left_current) - 5.0).abs() < 0.03 && amperes(analog.right_current).abs() < 0.03);
    assert!(analog.battery_voltage < 20);
    assert_eq!(plant.truth().current_a, [0.0; MOTORS]);
}

#[test]
fn the_battery_gives_what_flows_and_sags_with_its_charge() {
    let settings = PlantSettings {
        battery: Some(BatterySettings {
            capacity_ah: 0.01,
            charge: 0.9,
            open_circuit_v: vec![[0.0, 20.0], [1.0, 26.0]],
        }),
        ..PlantSettings::default()
    };
    let mut plant = plant(&bare_vehicle(), &settings);
    assert!(
        (plant.truth().battery_v - (25.4 - 0.06 * 0.2)).abs() < 1e-9,
        "{}",
        plant.truth().battery_v
    );
    plant.set_jammed(0, true);
    plant.set_jammed(1, true);
    let mut charge = 0.0;
    for _ in 0..2000 {
        plant.advance(1e-3, &[0.2, 0.2, 0.0].map(BridgeState::Duty));
        charge += plant.truth().battery_a * 1e-3;
    }
    let left = plant.supply.charge().expect("it has one");
    assert!(
        (left - (0.9 - charge / 36.0)).abs() < 1e-9 && charge > 10.0,
        "{left}, {charge} A s"
    );
    let truth = plant.truth();
    let expected = 20.0 + 6.0 * left - 0.06 * truth.battery_a;
    assert!(
        (truth.battery_v - expected).abs() < 0.01,
        "{} against {expected} V",
        truth.battery_v
    );
    plant.set_open_circuit_v(22.0);
    run(&mut plant, 5, OPEN);
    assert!((plant.truth().battery_v - (22.0 - 0.012)).abs() < 1e-9);
}

#[test]
fn without_its_battery_the_vehicle_coasts_and_the_board_is_dead() {
    let mut plant = plant(&bare_vehicle(), &PlantSettings::default());
    run(&mut plant, 300, [0.2, 0.2, 0.0].map(BridgeState::Duty));
    assert!(plant.powers_board());
    plant.set_battery_connected(false);
    run(&mut plant, 10, [0.2, 0.2, 0.0].map(BridgeState::Duty));
    let truth = plant.truth();
    assert!(!plant.powers_board());
    assert_eq!(
        (truth.battery_v, truth.battery_a, truth.current_a),
        (0.0, 0.0, [0.0; MOTORS])
    );
    plant.set_battery_connected(true);
    assert!(plant.powers_board());
    run(&mut plant, 2, OPEN);
    assert!((plant.truth().battery_v - 25.188).abs() < 1e-9);
}
