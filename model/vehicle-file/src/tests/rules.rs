//! Fields that follow from others.

use super::{REFERENCE, message, parse, vehicle};

/// Calculated by hand for the small vehicle: a free rotor's time constant is 14.27 ms, and 0.49 divided by it is 34.35
/// rad/s. The inertia of the turn is 0.03458 kg m^2 and the moment 0.7477 N m/V, which gives 1.589 V s/rad; times 0.24
/// times 34.35 rad/s that is 13.2 V/rad with the rounded gain. 94 % of 12 V is 11.28 V.
#[test]
fn gains_that_are_left_out_follow_from_the_vehicle() {
    let small = include_str!("../../../../vehicles/small.toml");
    for name in ["yaw_kp", "yaw_ki", "heading_kp", "ballast_voltage"] {
        assert!(!small.contains(name) && !REFERENCE.contains(name), "{name}");
    }
    let control = |text: &str| vehicle(text).parameters().control;
    let found = control(small);
    assert_eq!(
        [found.yaw_kp_v_s_per_rad, found.yaw_ki_v_per_rad, found.heading_kp_per_s],
        [1.6, 13.0, 1.3]
    );
    assert_eq!(found.ballast_voltage_max_v, 11.0);
    // A given value is kept, whatever the rule gives: also 0, which means no gain.
    let given = control(&small.replace("[control]", "[control]\nyaw_ki_v_per_rad = 0\nheading_kp_per_s = 0.7"));
    assert_eq!((given.yaw_ki_v_per_rad, given.heading_kp_per_s), (0.0, 0.7));
    assert_eq!(given.yaw_kp_v_s_per_rad, 1.6);
    // For a file with invalid values the message names these values, not the gains that follow from them.
    for (from, to, culprit) in [
        (
            "wheel_radius_m = 0.10",
            "wheel_radius_m = nan",
            "body.wheel_radius_m = NaN",
        ),
        (
            "resistance_ohm = 1.3",
            "resistance_ohm = 0",
            "drive_motor.resistance_ohm = 0",
        ),
        ("arm_mass_kg = 2.4", "arm_mass_kg = 900.0", "body.arm_mass_kg = 900"),
    ] {
        assert!(small.contains(from));
        let message = parse("small.toml", &small.replace(from, to))
            .expect_err("refused")
            .to_string();
        assert!(message.contains(culprit), "{message}");
    }
}

/// A field that only a spar needs may be left out without a spar. If it is given, it must be in its range and changes
/// nothing.
#[test]
fn a_vehicle_without_a_spar_needs_nothing_of_a_spar() {
    let (head, tail) = REFERENCE.split_once("[spar]").expect("table");
    let (_, tail) = tail.split_once("[imu]").expect("table");
    let with = format!("{head}[imu]{tail}");
    let mut without = with.clone();
    for line in ["spar_radius_m", "spar_max_rad"] {
        let given = with.lines().find(|text| text.starts_with(line)).expect(line);
        without = without.replace(&format!("{given}\n"), "");
        let (field, value) = given.split_once(" = ").expect("a value");
        let wrong = with.replace(given, &format!("{field} = 100.0"));
        assert!(
            parse("v.toml", &wrong).expect_err(&wrong).to_string().contains(field),
            "{value}"
        );
        // With the spar the field is required.
        let message = message(&format!("{given}\n"), "");
        assert!(message.contains(&format!("{field} is missing")), "{message}");
    }
    assert_eq!(vehicle(&without).parameters().spar, None);
    let (mut given, taken) = (*vehicle(&with).parameters(), *vehicle(&without).parameters());
    given.imu.spar_radius_m = taken.imu.spar_radius_m;
    given.safety.spar_max_rad = taken.safety.spar_max_rad;
    assert_eq!(given, taken);
}
