//! Bodies: radii, motors, pushes, payloads, and constraints of a wheel or the axle.

use model::vehicle::GRAVITY_M_S2;

use super::*;
use crate::body::{BALLAST, FORWARD, LEFT, PHI, Payload, Push, PushedBody, RIGHT, SIDE, SPAR, YAW};
use crate::imu::ImuErrors;
use crate::settings::DriveSettings;

#[test]
fn wheels_of_unequal_radius_turn_by_their_difference() {
    for factor in [0.98, 0.995, 1.01, 1.02] {
        let settings = PlantSettings {
            left: DriveSettings {
                wheel_radius_factor: factor,
                ..DriveSettings::default()
            },
            ..PlantSettings::default()
        };
        let mut plant = plant(&frictionless(&bare_vehicle()), &settings);
        let rate = 4.0;
        {
            let (_, u) = plant.body_mut().state_mut();
            (u[LEFT], u[RIGHT]) = (rate, rate);
            u[FORWARD] = 0.25 * rate;
        }
        run(&mut plant, 3000, OPEN);
        let truth = plant.truth();
        let [left, right] = [0, 1].map(|i| plant.body().position()[[LEFT, RIGHT][i]]);
        // Rolling: forward (r_l th_l + r_r th_r) / 2, heading (r_r th_r - r_l th_l) / (2 d).
        let (left_m, right_m) = (0.25 * factor * left, 0.25 * right);
        let heading = (right_m - left_m) / 0.5;
        assert!(
            (truth.heading_rad - heading).abs() < 2e-4,
            "{} against {heading}",
            truth.heading_rad
        );
        // The chord of an arc of this length and turn.
        let arc = 0.5 * (left_m + right_m);
        let chord = arc * (0.5 * heading).sin() / (0.5 * heading);
        let found = (truth.x_m * truth.x_m + truth.y_m * truth.y_m).sqrt();
        assert!((found / chord - 1.0).abs() < 1e-3, "{found} against {chord} m");
        assert!(
            heading * (1.0 - factor) > 0.0 && heading.abs() > 0.01,
            "the vehicle does not turn towards the smaller wheel"
        );
    }
}

#[test]
fn unequal_motors_stall_with_their_own_torques() {
    let settings = PlantSettings {
        left: DriveSettings {
            torque_constant_factor: 1.2,
            resistance_factor: 0.8,
            ..DriveSettings::default()
        },
        right: DriveSettings {
            back_emf_factor: 0.9,
            friction_factor: 3.0,
            ..DriveSettings::default()
        },
        ..PlantSettings::default()
    };
    let mut plant = plant(&bare_vehicle(), &settings);
    plant.set_jammed(0, true);
    plant.set_jammed(1, true);
    run(&mut plant, 50, [0.05, 0.05, 0.0].map(BridgeState::Duty));
    let truth = plant.truth();
    let volts = 0.05 * truth.battery_v;
    let [left, right, _] = truth.torque_n_m;
    assert!(
        (left / (0.0302 * 43.0 * 1.2 * volts / (0.316 * 0.8)) - 1.0).abs() < 1e-6,
        "{left}"
    );
    assert!((right / (0.0302 * 43.0 * volts / 0.316) - 1.0).abs() < 1e-6, "{right}");
    // On a stand each wheel runs at its own no-load rate less the effect of its friction.
    let mut plant = self::plant(&bare_vehicle(), &settings);
    plant.set_on_stand(true);
    run(&mut plant, 4000, [0.3, 0.3, 0.0].map(BridgeState::Duty));
    let truth = plant.truth();
    let free = |torque: f64, emf: f64, ohm: f64, friction: f64| {
        let (k, e) = (0.0302 * 43.0 * torque, 0.030124 * 43.0 * emf);
        (k * 0.3 * truth.battery_v / ohm - friction) / (k * e / ohm + 0.5 * 1.065)
    };
    let expected = [free(1.2, 1.0, 0.316 * 0.8, 0.2), free(1.0, 0.9, 0.316, 0.6)];
    for (i, expected) in expected.into_iter().enumerate() {
        let found = plant.body().joint_rate(i);
        assert!(
            (found / expected - 1.0).abs() < 5e-3,
            "{found} against {expected} rad/s"
        );
    }
}

#[test]
fn on_the_stand_the_axle_stays_and_the_wheels_turn() {
    let mut plant = plant(&reference_vehicle(), &PlantSettings::default());
    plant.set_on_stand(true);
    run(&mut plant, 1000, [0.3, -0.2, 0.0].map(BridgeState::Duty));
    let truth = plant.truth();
    assert!(truth.x_m.abs() < 1e-6 && truth.heading_rad.abs() < 1e-6, "{truth:?}");
    assert_eq!(truth.lifted, [true; 2]);
    assert!((truth.height_m - 0.05).abs() < 1e-6);
    assert!(truth.wheel_rate_rad_s[0] > 3.0 && truth.wheel_rate_rad_s[1] < -2.0);
    plant.set_on_stand(false);
    run(&mut plant, 200, OPEN);
    let truth = plant.truth();
    assert!(truth.lifted == [false; 2] && truth.height_m.abs() < 1e-9, "{truth:?}");
    assert!(
        truth.x_m.abs() > 1e-3 || truth.heading_rad.abs() > 1e-3,
        "the vehicle stays where the stand was"
    );
}

#[test]
fn a_seized_wheel_turns_with_the_arm_and_the_other_one_drives_round_it() {
    let mut plant = plant(&bare_vehicle(), &PlantSettings::default());
    plant.set_jammed(0, true);
    run(&mut plant, 2000, [0.15, 0.15, 0.0].map(BridgeState::Duty));
    let left = plant.body().joint_angle(0);
    assert!(left.abs() < 1e-5, "{left}");
    assert!(plant.body().joint_angle(1) > 0.5, "the right wheel turns");
    assert!(
        plant.truth().heading_rad > 0.2,
        "the vehicle does not turn about the left wheel"
    );
    plant.set_jammed(0, false);
    run(&mut plant, 500, [0.15, 0.15, 0.0].map(BridgeState::Duty));
    assert!(plant.body().joint_angle(0) > 0.1);
}

#[test]
fn a_push_gives_its_impulse_to_everything_that_moves() {
    // On ice no other force acts along the ground.
    let ice = Terrain::slope(0.0, 0.0).expect("ice");
    let mass = 13.6 + 0.51 + 1.53 + 2.04;
    for on in [PushedBody::Axle, PushedBody::Arm, PushedBody::Spar] {
        let vehicle = frictionless(&reference_vehicle());
        let mut plant =
            Plant::with_settings(&vehicle, &SCALES, ice.clone(), 1, &PlantSettings::default()).expect("a plant");
        let push = Push {
            on,
            forward_n: 20.0,
            left_n: 6.0,
            up_n: 0.0,
        };
        let start = plant.body().energy(plant.ground());
        plant.push(push, 0.1);
        run(&mut plant, 101, OPEN);
        assert_eq!(plant.body().push(), None, "the push does not end");
        // Momentum along the ground: that of the axle, the arm, the spar and the ballast.
        let (q, u) = (plant.body().position(), plant.body().speed());
        let i = plant.body().inertia();
        let swung = i.arm_first * q[PHI].cos() * u[PHI]
            + i.spar_first * q[SPAR].cos() * u[SPAR]
            + i.ballast_first * q[BALLAST].cos() * u[BALLAST];
        let ahead = i.arm_first * q[PHI].sin() + i.spar_first * q[SPAR].sin() + i.ballast_first * q[BALLAST].sin();
        let (along, across) = (mass * u[FORWARD] + swung, mass * u[SIDE] + u[YAW] * ahead);
        // Converted from the heading's axes, which a push off the middle turns a little.
        let (sin, cos) = q[YAW].sin_cos();
        let (forward, left) = (along * cos - across * sin, along * sin + across * cos);
        assert!((forward - 2.0).abs() < 0.01, "{on:?}: {forward} N s");
        assert!((left - 0.6).abs() < 0.01, "{on:?}: {left} N s");
        let work = plant.body().energy(plant.ground()) - start;
        assert!(work > 0.0);
        if on == PushedBody::Axle {
            // The arm lags behind, so the axle moves faster than a rigid vehicle would.
            assert!(u[FORWARD] > 2.0 / mass && u[PHI] < 0.0);
        }
        if on == PushedBody::Arm {
            assert!(u[PHI] > 0.0 || q[PHI] > 0.0, "the arm is pushed forward");
        }
        if on == PushedBody::Spar {
            assert!(
                q[SPAR] < 0.0,
                "its upper end goes forward, so its lower end back: {}",
                q[SPAR]
            );
        }
    }
}

#[test]
fn a_push_up_unloads_the_wheels_and_one_from_the_side_shifts_the_load() {
    let mut plant = plant(&bare_vehicle(), &PlantSettings::default());
    plant.set_chocked(true);
    let weight = 13.6 * GRAVITY_M_S2;
    let push = |on, left_n, up_n| Push {
        on,
        forward_n: 0.0,
        left_n,
        up_n,
    };
    plant.push(push(PushedBody::Axle, 0.0, 50.0), 1.0);
    run(&mut plant, 300, OPEN);
    let normal: f64 = plant.truth().normal_n.iter().sum();
    assert!((normal - (weight - 50.0)).abs() < 0.1, "{normal} N");
    // From the right at the arm's centre of mass, 0.2 m below the axle and 0.05 m above the ground.
    plant.push(push(PushedBody::Arm, 30.0, 0.0), 1.0);
    run(&mut plant, 300, OPEN);
    let [left, right] = plant.truth().normal_n;
    // About the contacts' middle: 30 N at 0.05 m, carried by wheels 0.25 m either side.
    let expected = 30.0 * 0.05 / 0.25;
    assert!(
        (left - right - expected).abs() < 0.05,
        "{} against {expected} N",
        left - right
    );
}

#[test]
fn a_payload_swings_as_the_two_masses_do() {
    // On a stand the arm is a simple pendulum with a known equilibrium and period.
    let vehicle = frictionless(&bare_vehicle());
    for payload in [
        Payload {
            mass_kg: 2.0,
            ahead_m: 0.0,
            below_m: 0.3,
        },
        Payload {
            mass_kg: 1.5,
            ahead_m: 0.12,
            below_m: 0.1,
        },
        Payload {
            mass_kg: 3.0,
            ahead_m: -0.2,
            below_m: -0.05,
        },
    ] {
        let Payload {
            mass_kg,
            ahead_m,
            below_m,
        } = payload;
        let mut plant = plant(&vehicle, &PlantSettings::default());
        plant.set_payload(payload);
        plant.set_on_stand(true);
        plant.set_chocked(true);
        let (below, ahead) = (12.24 * 0.2 + mass_kg * below_m, mass_kg * ahead_m);
        let rest = -ahead.atan2(below);
        let rotors = 2.0 * 43.0 * 43.0 * 1.34e-5;
        let inertia = 12.24 * 0.04 + mass_kg * (ahead_m * ahead_m + below_m * below_m) + rotors;
        let omega = (GRAVITY_M_S2 * below.hypot(ahead) / inertia).sqrt();
        plant.body_mut().state_mut().0[PHI] = rest + 0.05;
        let mut phi = Vec::new();
        for _ in 0..4000 {
            plant.advance(1e-3, &OPEN);
            phi.push(plant.truth().phi_rad - rest);
        }
        let crossings: Vec<usize> = (1..phi.len()).filter(|&k| phi[k - 1] > 0.0 && phi[k] <= 0.0).collect();
        let (first, last) = (crossings[0], crossings[crossings.len() - 1]);
        let period = (last - first) as f64 * 1e-3 / (crossings.len() - 1) as f64;
        // The period of a swing of 0.05 rad is longer by a sixteenth of the amplitude's square.
        let expected = std::f64::consts::TAU / omega * (1.0 + 0.05 * 0.05 / 16.0);
        assert!(
            (period / expected - 1.0).abs() < 2e-3,
            "{payload:?}: {period} against {expected} s"
        );
        let (low, high) = phi.iter().fold((0.0_f64, 0.0_f64), |(l, h), x| (l.min(*x), h.max(*x)));
        assert!(
            (low + high).abs() < 1e-3 && high > 0.049,
            "about its equilibrium: {low} {high}"
        );
    }
}

#[test]
fn a_payload_that_is_taken_off_leaves_the_arm_as_it_was() {
    let mut plant = plant(&bare_vehicle(), &PlantSettings::default());
    let before = *plant.body().inertia();
    let load = |mass_kg, ahead_m, below_m| Payload {
        mass_kg,
        ahead_m,
        below_m,
    };
    plant.set_payload(load(4.0, 0.1, 0.2));
    let normal = |plant: &mut Plant| {
        plant.set_chocked(true);
        run(plant, 1, OPEN);
        plant.truth().normal_n.iter().sum::<f64>()
    };
    let loaded = normal(&mut plant);
    assert!((loaded - 17.6 * GRAVITY_M_S2).abs() < 8.0, "{loaded} N");
    plant.set_payload(load(4.0, -0.1, 0.3));
    plant.set_payload(load(0.0, 0.0, 0.0));
    let after = *plant.body().inertia();
    for (found, expected) in [
        (after.total_mass, before.total_mass),
        (after.arm_first, before.arm_first),
        (after.arm_second, before.arm_second),
        (after.arm_offset, 0.0),
    ] {
        assert!((found - expected).abs() < 1e-12, "{found} against {expected}");
    }
}

#[test]
fn the_arm_imu_turns_with_the_arm_not_with_its_centre_of_mass() {
    let vehicle = bare_vehicle();
    let mut plant = Plant::with_imu_errors(&vehicle, &SCALES, level(), 1, ImuErrors::NONE).expect("a plant");
    plant.set_payload(Payload {
        mass_kg: 3.0,
        ahead_m: 0.2,
        below_m: 0.2,
    });
    let chip = plant.arm_imu();
    chip.transfer(&mut [0x4f, 0x25, 0x25]);
    chip.transfer(&mut [0x52, 0x33]);
    chip.transfer(&mut [0x4e, 0x0f]);
    plant.set_chocked(true);
    run(&mut plant, 20_000, OPEN);
    let phi = plant.truth().phi_rad;
    let expected = -(0.6_f64).atan2(12.24 * 0.2 + 0.6);
    // Tolerance: the angle that the gears' friction can hold, 0.4 N m of the arm's 30 N m.
    assert!((phi - expected).abs() < 0.4 / 30.0, "{phi} against {expected}");
    let words = plant.arm_imu().data().expect("it answers");
    // With the arm back by phi, gravity shows on x as the sine of phi.
    let found = f64::from(words[1]) / 4096.0;
    assert!((found - phi.sin()).abs() < 2e-3, "{found} against {}", phi.sin());
}
