//! The checks of a vehicle's design, against numbers computed by hand.

use core::f64::consts::TAU;

use model::vehicle::{Vehicle, VehicleParameters};

use super::design_check::*;

fn reference() -> Vehicle<f64> {
    vehicle_file::reference().expect("the reference vehicle")
}

fn changed(change: impl FnOnce(&mut VehicleParameters<f64>)) -> Vehicle<f64> {
    let mut parameters = *reference().parameters();
    change(&mut parameters);
    Vehicle::new(parameters).expect("within every range")
}

#[test]
fn the_reference_vehicle_is_sound_and_its_numbers_are_those_of_the_data_sheets() {
    let checked = check(&reference());
    assert_eq!(checked.findings, []);
    // By hand: 13.6 kg and 4.08 kg of spar; 13.6 g r / (2 n Kt / R); (M + m + spar) g r sin(10 deg) / (2 n Kt).
    for (name, expected, share) in [
        ("mass_kg", 17.68, 1e-12),
        (
            "voltage_unit_v",
            13.6 * 9.81 * 0.25 / (2.0 * 43.0 * 0.0302 / 0.316),
            1e-12,
        ),
        (
            "hold_current_10_deg_a",
            17.68 * 9.81 * 0.25 * 0.173_648 / (2.0 * 43.0 * 0.0302),
            1e-5,
        ),
        // sin(beta) = 2 n Kt x 5.8 A / ((M + m + spar) g r) = 15.064 / 43.360.
        ("continuous_slope_deg", 20.33, 1e-3),
        // 20 A give more torque than the whole weight would need on a vertical wall.
        ("bridge_slope_deg", 90.0, 1e-9),
        // 317 rpm/V over 43, at the rim.
        ("no_load_speed_m_s", 25.2 * 317.0 / 43.0 / 60.0 * TAU * 0.25, 1e-3),
        // sin(33.6 deg) = 0.72 / 1.3.
        ("static_limit_deg", 33.63, 1e-3),
        ("grip_limit_deg", 30.96, 1e-3),
        // 43.360 N m of both motors times the slope's sine, over 2 x 1.2986 N m/A, times 0.316 ohm.
        ("static_limit_v", 2.922, 1e-3),
        ("grip_limit_v", 2.714, 1e-3),
        ("encoder_count_mm", TAU * 250.0 / (1024.0 * 43.0), 1e-12),
        // 1.614 (erratum E26) over the time unit, but for the rotors; half of 25.2 V over 43 x 0.030124 V s and the bearings'
        // 0.1296 V s; 0.6 g at 2.5 m/s; 0.6 x 17.68 kg x g and 2 x 17 A x 1.2986 N m/A / 0.25 m at 0.25 m, on 0.12 + 0.085 +
        // 0.0561 + 0.04955 kg m^2.
        ("yaw_rate_by_spin_rad_s", 8.25, 0.02),
        ("yaw_rate_by_voltage_rad_s", 12.6 / (1.295_33 + 0.129_58), 1e-4),
        ("yaw_rate_by_grip_rad_s", 0.6 * 9.81 / 2.5, 1e-12),
        (
            "yaw_acceleration_by_grip_rad_s2",
            0.6 * 17.68 * 9.81 * 0.25 / 0.310_65,
            1e-3,
        ),
        ("yaw_acceleration_by_current_rad_s2", 34.0 * 1.2986 / 0.310_65, 1e-3),
        // The thesis's damping, to which bearings and back-EMF of the file add up.
        ("zeta", 2.2, 1e-3),
    ] {
        let found = checked.number(name).expect(name);
        assert!((found / expected - 1.0).abs() < share, "{name}: {found} for {expected}");
    }
    assert!(checked.number("whirl_step_v") > checked.number("slip_step_v"));
    assert!(
        checked.numbers.iter().all(|number| number.value.is_finite()),
        "{checked:?}"
    );
}

/// For whirl and slip it makes no difference whether a mass on the axle is a spar or a part of the wheels.
#[test]
fn a_spar_weighs_as_much_as_anything_else_on_the_axle() {
    let bare = changed(|p| {
        let (spar, _) = p.spar.take().expect("a spar");
        let own_kg = p.body.total_mass_kg;
        p.body.total_mass_kg += spar.camera_mass_kg + spar.motor_mass_kg + spar.ballast_mass_kg;
        // The same volts for the same motion.
        p.control.kp *= own_kg / p.body.total_mass_kg;
        p.control.kd *= own_kg / p.body.total_mass_kg;
    });
    let (spar, bare) = (check(&reference()), check(&bare));
    for name in [
        "whirl_step_v",
        "slip_step_v",
        "whirl_slope_deg",
        "whirl_slope_v",
        "static_limit_deg",
        "static_limit_v",
        "acceleration_by_arm_m_s2",
    ] {
        let (with, without) = (spar.number(name).expect(name), bare.number(name).expect(name));
        assert!((with / without - 1.0).abs() < 1e-6, "{name}: {with}, {without}");
    }
    assert_eq!(spar.poles_eq_3_25_per_s.len(), 3);
    for (with, without) in spar.poles_eq_3_25_per_s.iter().zip(&bare.poles_eq_3_25_per_s) {
        let apart = (with[0] - without[0]).hypot(with[1] - without[1]);
        assert!(apart < 1e-6 * with[0].hypot(with[1]), "{with:?}, {without:?}");
    }
}

#[test]
fn each_thing_that_is_wrong_is_told_at_its_field() {
    type Change = fn(&mut VehicleParameters<f64>);
    let wrong: [(&str, Severity, Change); 22] = [
        ("body.arm_length_m", Severity::Error, |p| p.body.arm_length_m = 0.25),
        ("body.arm_length_m", Severity::Warning, |p| p.body.arm_length_m = 0.24),
        ("body.wheels_inertia_kg_m2", Severity::Error, |p| {
            p.body.wheels_inertia_kg_m2 = 0.09;
        }),
        ("body.wheels_inertia_kg_m2", Severity::Warning, |p| {
            p.body.wheels_inertia_kg_m2 = 0.02;
        }),
        ("body.yaw_inertia_kg_m2", Severity::Warning, |p| {
            p.body.yaw_inertia_kg_m2 = 0.02;
        }),
        ("drive_motor.torque_constant_n_m_per_a", Severity::Error, |p| {
            p.drive_motor.torque_constant_n_m_per_a = 0.06;
        }),
        ("drive_motor.torque_constant_n_m_per_a", Severity::Warning, |p| {
            p.drive_motor.torque_constant_n_m_per_a = 0.025;
        }),
        ("ballast_motor.torque_constant_n_m_per_a", Severity::Error, |p| {
            if let Some((_, motor)) = &mut p.spar {
                motor.torque_constant_n_m_per_a = 0.0656;
            }
        }),
        ("body.arm_mass_kg", Severity::Error, |p| p.body.arm_mass_kg = 1.5),
        ("control.speed_max_m_s", Severity::Error, |p| {
            p.control.speed_max_m_s = 6.0;
        }),
        ("control.speed_max_m_s", Severity::Warning, |p| {
            p.battery.minimum_v = 12.0;
            p.control.speed_max_m_s = 3.0;
        }),
        ("drive_motor.inductance_h", Severity::Warning, |p| {
            p.drive_motor.inductance_h = 0.001;
        }),
        ("drive_motor.encoder_counts_per_rev", Severity::Warning, |p| {
            p.drive_motor.encoder_counts_per_rev = 16.0;
        }),
        ("drive_motor.current_limit_a", Severity::Error, |p| {
            p.drive_motor.current_limit_a = 2.0;
        }),
        ("control.grip_mu", Severity::Warning, |p| p.control.grip_mu = 1.2),
        ("control.speed_max_m_s", Severity::Warning, |p| {
            p.control.speed_max_m_s = 0.0;
        }),
        // Arm, grip and current allow 5.60, 5.89 and 9.51 m/s^2, of which the least counts; then a grip of 0.3 and a limit of 8 A.
        ("control.acceleration_max_m_s2", Severity::Warning, |p| {
            p.control.acceleration_max_m_s2 = 5.65;
        }),
        ("control.acceleration_max_m_s2", Severity::Warning, |p| {
            p.control.acceleration_max_m_s2 = 3.0;
            p.control.grip_mu = 0.3;
        }),
        ("control.acceleration_max_m_s2", Severity::Warning, |p| {
            p.control.acceleration_max_m_s2 = 4.6;
            p.drive_motor.current_limit_a = 8.0;
        }),
        // Half of the supply maintains 8.84 rad/s.
        ("control.yaw_rate_max_rad_s", Severity::Warning, |p| {
            p.control.yaw_rate_max_rad_s = 9.0;
        }),
        ("estimator.wheel_rate_time_constant_s", Severity::Error, |p| {
            p.estimator.wheel_rate_time_constant_s = 0.01;
            p.body.wheel_radius_m = 0.02;
            p.body.arm_length_m = 0.015;
        }),
        ("spar.ballast_distance_m", Severity::Error, |p| {
            if let Some((spar, _)) = &mut p.spar {
                spar.motor_distance_m = 0.15;
                spar.ballast_distance_m = 0.12;
                [
                    spar.spar_gain,
                    spar.ballast_gain,
                    spar.spar_rate_gain,
                    spar.ballast_rate_gain,
                ] = [0.0; 4];
            }
        }),
    ];
    for (field, severity, change) in wrong {
        let checked = check(&changed(change));
        assert!(
            checked
                .findings
                .iter()
                .any(|f| f.field == field && f.severity == severity),
            "{field}: {:?}",
            checked.findings
        );
        assert_eq!(
            checked.findings.iter().any(|f| f.severity == Severity::Error),
            severity == Severity::Error,
            "{field}: {:?}",
            checked.findings
        );
    }
}
