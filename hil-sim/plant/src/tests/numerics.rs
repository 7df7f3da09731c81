//! The plant's numerics: results are reproducible, hardly change with shorter steps, and are finite for any vehicle.

use super::*;

#[test]
fn one_seed_one_run() {
    let run = |seed| {
        let mut plant = Plant::new(&reference_vehicle(), &SCALES, slope(0.05), seed).unwrap();
        start_imu(plant.arm_imu());
        let mut log = Vec::new();
        for k in 0..300 {
            let duty = 0.2 * f64::from(k) / 300.0;
            plant.advance(1e-3, &drive(duty, 0.9 * duty, 0.01));
            log.push((plant.counters(), plant.analog(), read_imu(plant.arm_imu())));
        }
        (log, plant.truth().x_m.to_bits())
    };
    let (a, b, c) = (run(1), run(1), run(2));
    assert_eq!(a, b);
    assert_eq!(a.1, c.1, "the world does not depend on the sensors' noise");
    assert_ne!(a.0, c.0);
}

#[test]
fn steps_ten_times_shorter_change_little() {
    // All effects together: spar, turning, a ramp, slippery patches, jumping duties.
    let text = r#"
        [friction]
        left = 0.8
        right = 0.8
        [[patch]]
        from_m = 1.0
        to_m = 1.6
        left = 0.3
        right = 0.05
        [[profile]]
        kind = "ramp"
        from_m = 0.4
        length_m = 4.0
        slope_rad = 0.06
        transition_m = 0.5
    "#;
    let run = |substep: f64| {
        let mut plant = Plant::new(&reference_vehicle(), &SCALES, terrain(text), 1).unwrap();
        plant.substep_s = substep;
        let mut log = Vec::new();
        let mut slid = false;
        for k in 0..4000 {
            let duty = if k % 1000 < 500 { 0.22 } else { 0.16 };
            plant.advance(1e-3, &drive(duty, duty * 1.02, 0.02));
            let truth = plant.truth();
            slid |= truth.sliding.iter().any(|s| *s);
            log.push(truth);
        }
        assert!(slid);
        log
    };
    let (coarse, fine) = (run(SUBSTEP_S), run(SUBSTEP_S / 10.0));
    let worst = |of: fn(&Truth) -> f64| {
        let difference = |(a, b): (&Truth, &Truth)| (of(a) - of(b)).abs();
        coarse.iter().zip(&fine).map(difference).fold(0.0, f64::max)
    };
    let errors = [
        worst(|t| t.x_m),
        worst(|t| t.heading_rad),
        worst(|t| t.phi_rad),
        worst(|t| t.spar_rad),
        worst(|t| t.speed_m_s),
    ];
    let bounds = [2e-3, 4e-3, 2e-3, 2e-3, 1e-2];
    for (error, bound) in errors.iter().zip(bounds) {
        assert!(*error < bound, "{errors:?}");
        assert!(*error > 1e-9, "shorter steps change nothing: {errors:?}");
    }
    assert!(fine.last().unwrap().x_m > 2.0, "{:?}", fine.last());
}

#[test]
fn a_look_ahead_finds_what_half_a_step_finds() {
    let mut plant = Plant::new(&reference_vehicle(), &SCALES, slope(0.05), 1).unwrap();
    let mut differences = Vec::new();
    for k in 0..3000 {
        // Duties that ramp, like those of a law, and jump, as at a limit.
        let duty = 0.1 + 0.1 * f64::from(k % 500) / 500.0;
        let bridges = drive(duty, 0.9 * duty, -0.3 * duty);
        let (mut ahead, mut half) = (plant.clone(), plant.clone());
        half.advance(5e-4, &bridges);
        // The same noise in both.
        let expected = half.analog();
        if let Some(found) = ahead.analog_after(5e-4, &bridges) {
            let pairs = found.values().into_iter().zip(expected.values());
            differences.extend(pairs.map(|(a, b)| f64::from(a.abs_diff(b))));
            assert_eq!(ahead.truth(), plant.truth(), "looking ahead moves the plant");
        }
        plant.advance(1e-3, &bridges);
    }
    assert!(differences.len() > 4 * 2000, "{}", differences.len());
    let mean_square = differences.iter().map(|d| d * d).sum::<f64>() / differences.len() as f64;
    // The converter's noise has 2 counts.
    assert!(mean_square.sqrt() < 2.0, "{} counts", mean_square.sqrt());
}

#[test]
fn nothing_is_foretold_where_the_motion_has_kinks() {
    let bridges = drive(0.1, 0.1, 0.0);
    let after = |plant: &mut Plant| {
        plant.advance(1e-3, &bridges);
        plant.analog_after(5e-4, &bridges).is_some()
    };
    let mut plant = Plant::new(&reference_vehicle(), &SCALES, slope(0.0), 1).unwrap();
    plant.advance(1e-3, &bridges);
    assert!(after(&mut plant));
    assert!(
        plant.analog_after(2e-3, &bridges).is_none(),
        "a look ahead of more than a substep"
    );
    plant.set_chocked(true);
    assert!(!after(&mut plant), "chocks");
    let ice = terrain("[friction]\nleft = 0.01\nright = 0.01");
    let mut plant = Plant::new(&reference_vehicle(), &SCALES, ice, 1).unwrap();
    for _ in 0..100 {
        plant.advance(1e-3, &drive(0.5, 0.5, 0.0));
    }
    assert!(plant.truth().sliding[0]);
    assert!(!after(&mut plant), "wheels that slide");
}

#[test]
fn any_vehicle_on_any_ground_stays_finite_and_within_its_means() {
    let mut dice = Noise::new(99, 0);
    let mut uniform = |low: f64, high: f64| low + (high - low) * (dice.bits() >> 11) as f64 / (1_u64 << 53) as f64;
    let mut ran = 0;
    for round in 0..400 {
        let mut parameters = *reference_vehicle().parameters();
        for number in 0..parameters.count() {
            let (table, field) = parameters.field(number).unwrap();
            let value = parameters.value(number).unwrap();
            if table == "control" || table == "safety" || table == "battery" {
                continue;
            }
            // The test controls nothing, so it sets no gains of the levelling.
            if field.name.ends_with("_gain") {
                parameters.set(number, 0.0).unwrap();
                continue;
            }
            let value = (value * 5.0_f64.powf(uniform(-1.0, 1.0))).clamp(field.min, field.max);
            let value = if field.whole { value.round() } else { value };
            parameters.set(number, value).unwrap();
        }
        parameters.control.kp = -10.0;
        if uniform(0.0, 1.0) < 0.2 {
            parameters.spar = None;
        }
        if uniform(0.0, 1.0) < 0.2 {
            parameters.drive_motor.inductance_h = 0.0;
            parameters.body.wheels_inertia_kg_m2 = 0.0;
            parameters.drive_motor.rotor_inertia_kg_m2 = 0.0;
        }
        // A few draws are contradictory: an arm heavier than the whole vehicle, or a current limit above
        // the fault limit.
        let Ok(vehicle) = Vehicle::new(parameters) else {
            continue;
        };
        let step = 0.2 * parameters.body.wheel_radius_m;
        let text = format!(
            "[plane]\nslope_x_rad = {}\nslope_y_rad = {}\n[friction]\nleft = {}\nright = {}\n\
             [[profile]]\nkind = \"step\"\nat_m = 0.3\nheight_m = {step}\n\
             [[profile]]\nkind = \"step\"\nat_m = -0.6\nheight_m = {step}\n",
            uniform(-0.5, 0.5),
            uniform(-0.5, 0.5),
            uniform(0.0, 1.5),
            uniform(0.0, 1.5),
        );
        let mut plant = Plant::new(&vehicle, &SCALES, terrain(&text), round).unwrap();
        ran += 1;
        let mut top = 0.0_f64;
        for _ in 0..20 {
            let bridges = [(); MOTORS].map(|()| match uniform(-1.2, 1.0) {
                duty if duty < -1.0 => BridgeState::Open,
                duty => BridgeState::Duty(duty),
            });
            for _ in 0..25 {
                plant.advance(1e-3, &bridges);
            }
            let t = plant.truth();
            let finite = [
                t.x_m,
                t.y_m,
                t.heading_rad,
                t.phi_rad,
                t.spar_rad,
                t.ballast_rate_rad_s,
                t.battery_v,
            ];
            assert!(
                finite.iter().all(|v| v.is_finite()),
                "round {round}: {t:?} {parameters:?}"
            );
            assert!(t.battery_v > 0.0 && t.battery_v < 60.0, "round {round}: {t:?}");
            assert!(t.normal_n.iter().all(|n| *n >= 0.0), "round {round}: {t:?}");
            top = top.max(plant.body().energy(plant.ground()));
        }
        // Upper bound of the energy: the battery's power at its chopping limit over half a second, and
        // gravity's work along the slopes.
        let t = plant.truth();
        let mass = plant.body().inertia().total_mass;
        let electric = 3.0 * 60.0 * 30.0 * 0.5;
        let fall = mass * 9.81 * 0.8 * (t.x_m.abs() + t.y_m.abs() + 1.0);
        assert!(
            top < electric + fall,
            "round {round}: {top} J of {electric} + {fall} {t:?}"
        );
    }
    assert!(ran > 100, "{ran} of 400 draws were vehicles");
}
