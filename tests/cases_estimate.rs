//! What the vehicle estimates about its own motion where comparable machines have been wrong: scenarios on the virtual board,
//! each kind at several values and seeds.

use model::supervise::arming::Mode;
use model::supervise::codes::{Fault, FaultSet, Limit};
use virtual_board::ages;
use virtual_board::scenario::Scenario;
use virtual_board::scenario::trace::TraceRow;

mod support;
use support::flights::{at_speed, drive, first, fly, last, recorded};

fn heading_error_deg(row: &TraceRow) -> f64 {
    (f64::from(row.status.estimate.heading_rad) - row.truth.heading_rad).to_degrees()
}

/// The age of every sample in every tick is the age that the design states, whatever the order in which tasks are polled.
#[test]
fn the_samples_of_every_tick_are_as_old_as_the_design_says() {
    for (name, seed) in [("slope-drive", 1), ("figure-of-eight", 2), ("kerb", 3)] {
        let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../tests/scenarios");
        let path = std::path::Path::new(folder).join(format!("{name}.toml"));
        let mut scenario = Scenario::read(&path).expect("a good file");
        scenario.seed = seed;
        let records = recorded(&scenario);
        assert!(records.len() > 20_000);
        // The IMUs take 60 ms to start.
        for record in records.iter().filter(|record| record.sample.time_us > 100_000) {
            if let Err(wrong) = ages::check(record, true) {
                panic!("{name}: {wrong}");
            }
            // On the virtual board no computation takes time.
            let sample = &record.sample;
            assert_eq!(sample.time_us % 1000, 0);
            assert_eq!(
                (
                    sample.encoder_age_us,
                    sample.arm_imu.age_us,
                    sample.spar_imu.age_us,
                    sample.analog_age_us
                ),
                (0, 0, 0, 500),
                "{name}, tick {}",
                record.tick
            );
        }
    }
}

#[test]
fn half_a_minute_of_spinning_leaves_the_heading_within_half_a_degree() {
    for (yaw_rate, straight_on_s, seeds) in [
        (1.9, 20.0, [1, 9]),
        (-1.9, 0.0, [3, 20]),
        (1.0, 0.0, [4, 8]),
        (-0.5, 0.0, [5, 17]),
    ] {
        for seed in seeds {
            let mut steps = format!("{{ at_s = 4.0, action = \"drive\", yaw_rate_rad_s = {yaw_rate:?} }}");
            if straight_on_s > 0.0 {
                steps += ", { at_s = 34.0, action = \"drive\", speed_m_s = 1.0 }";
            }
            // The seed draws a bias; this is the data sheet's largest bias on top, against the sense of the turn.
            let bias_deg_s = -0.5 * f64::signum(yaw_rate);
            let tables = format!("plant.arm_imu.gyro_bias_z_deg_s = {bias_deg_s:?}");
            let outcome = fly(34.0 + straight_on_s, seed, &tables, &steps);
            let worst = outcome
                .trace
                .rows
                .iter()
                .map(|row| heading_error_deg(row).abs())
                .fold(0.0, f64::max);
            let turned = last(&outcome).truth.heading_rad / yaw_rate;
            assert!((29.0..31.0).contains(&turned), "{yaw_rate}: {turned} s of turning");
            println!("{yaw_rate} rad/s, seed {seed}: {worst:.3} deg");
            assert!(worst < 0.5, "{yaw_rate} rad/s, seed {seed}: {worst} deg");
        }
    }
}

/// Averaging a gyro with 2.8 mdps/sqrt(Hz) of noise for half a second gives its bias to 0.0028 deg/s, however large the bias is.
#[test]
fn at_rest_the_gyros_are_calibrated_to_their_noise_and_the_heading_stays() {
    for bias_deg_s in [0.5, -0.5, 2.0] {
        for seed in [8, 18] {
            let tables = format!("plant.arm_imu.gyro_bias_z_deg_s = {bias_deg_s:?}");
            let outcome = fly(2.0, seed, &tables, "");
            let at = |s: f64| {
                let row = outcome.trace.rows.iter().find(|row| row.time_s() >= s);
                heading_error_deg(row.expect("a row"))
            };
            let (calibrated_deg, drift_deg_s) = (at(0.55), at(1.9) - at(0.9));
            let story =
                format!("{bias_deg_s} deg/s, seed {seed}: {calibrated_deg:.4} deg, then {drift_deg_s:.4} deg/s");
            println!("{story}");
            // Half a second of such a bias, uncalibrated, would turn the heading by 0.25 deg or more.
            assert!(calibrated_deg.abs() < 0.02, "{story}");
            assert!(drift_deg_s.abs() < 4.0 * 0.0028, "{story}");
        }
    }
}

/// Steered by the gyro alone, the vehicle drives a straight line, whatever the wheels' radii.
#[test]
fn wheels_of_unequal_radius_do_not_turn_the_heading() {
    for (side, factor, speed_m_s, seeds) in [
        ("left", 1.01, 1.0, [1, 11]),
        ("right", 1.01, -2.0, [2, 12]),
        ("left", 0.995, 2.0, [3, 13]),
        ("right", 1.02, 2.5, [4, 14]),
    ] {
        for seed in seeds {
            let tables = format!("plant.{side}.wheel_radius_factor = {factor:?}");
            let ends_s = 4.0 + 120.0 / f64::abs(speed_m_s);
            let steps = format!("{}, {{ at_s = {ends_s:?}, action = \"drive\" }}", at_speed(speed_m_s));
            let outcome = fly(ends_s + 4.0, seed, &tables, &steps);
            let row = last(&outcome);
            let heading_deg = row.truth.heading_rad.to_degrees();
            let estimate = &row.status.estimate;
            let off_m = (f64::from(estimate.x_m) - row.truth.x_m).hypot(f64::from(estimate.y_m) - row.truth.y_m);
            let (story, driven_m) = (
                format!("{side} {factor}, {speed_m_s} m/s, seed {seed}"),
                row.truth.x_m.abs(),
            );
            println!("{story}: heading {heading_deg:.3} deg, position {off_m:.2} m off");
            assert!(driven_m > 110.0, "{story}: {driven_m}");
            assert!(heading_deg.abs() < 1.0, "{story}: {heading_deg} deg");
            assert!(heading_error_deg(row).abs() < 1.0, "{story}");
            assert!(off_m < 0.02 * driven_m, "{story}: {off_m} m");
        }
    }
}

#[test]
fn a_fall_over_a_ledge_is_no_fault() {
    for height_m in [0.01, 0.02, 0.04] {
        for (speed_m_s, seeds) in [(0.3, [1, 11]), (1.0, [2, 12]), (-2.0, [3, 13]), (2.5, [4, 14])] {
            for seed in seeds {
                // A vehicle that drives backward meets a step of the other sign as a ledge.
                let (at_m, rise_m) = (3.0 * f64::signum(speed_m_s), -height_m * f64::signum(speed_m_s));
                let tables =
                    format!("terrain.profile = [{{ kind = \"step\", at_m = {at_m:?}, height_m = {rise_m:?} }}]");
                let outcome = fly(8.0 + 3.6 / f64::abs(speed_m_s), seed, &tables, &at_speed(speed_m_s));
                let story = format!("{height_m} m at {speed_m_s} m/s, seed {seed}");
                assert!(
                    last(&outcome).truth.x_m.abs() > 3.2,
                    "{story}: the vehicle does not reach the ledge"
                );
                assert_eq!(last(&outcome).status.mode, Mode::Armed, "{story}: {:?}", outcome.log);
                assert_eq!(last(&outcome).status.faults, FaultSet::EMPTY, "{story}");
                let armed = outcome.trace.rows.iter().filter(|row| row.time_s() > 2.5);
                assert!(armed.clone().all(|row| row.bridges_on), "{story}: a bridge opened");
            }
        }
    }
}

#[test]
fn a_blocked_vehicle_tells_so_takes_the_wall_for_no_hill_and_lowers_its_arm_before_the_bridges_open() {
    for (speed_m_s, silent_at_s, seed) in [
        (0.3, 10.0, 1),
        (0.3, 10.0, 11),
        (0.3, 22.0, 3),
        (0.3, 22.0, 13),
        (0.5, 10.0, 4),
        (0.5, 10.0, 14),
        (1.0, 14.0, 5),
        (1.0, 14.0, 15),
    ] {
        let tables = "terrain.profile = [{ kind = \"step\", at_m = 1.0, height_m = 0.075 }]";
        let steps = format!(
            "{}, {{ at_s = {silent_at_s:?}, action = \"silence\" }}",
            at_speed(speed_m_s)
        );
        let outcome = fly(silent_at_s + 8.0, seed, tables, &steps);
        let story = format!("{speed_m_s} m/s until {silent_at_s} s, seed {seed}");
        let rows = &outcome.trace.rows;
        let pushing = || rows.iter().filter(|row| (9.0..silent_at_s).contains(&row.time_s()));
        assert!(pushing().count() > 50);
        assert!(
            pushing().all(|row| row.status.limits.contains(Limit::Stall)),
            "{story}: the status does not report the stall"
        );
        let steepest = pushing()
            .map(|row| row.status.estimate.slope_rad.to_degrees().abs())
            .fold(0.0, f32::max);
        assert!(steepest < 2.0, "{story}: {steepest} deg of slope");
        assert_eq!(last(&outcome).status.mode, Mode::Disarmed, "{story}");
        assert!(
            !last(&outcome).status.faults.contains(Fault::StopTimeout),
            "{story}: the stop ends only by its time-out"
        );
        let furthest = rows.iter().map(|row| row.truth.x_m).fold(0.0, f64::max);
        let recoil_m = furthest - last(&outcome).truth.x_m;
        println!("{story}: slope {steepest:.2} deg, recoil {recoil_m:.3} m");
        assert!(recoil_m < 0.1, "{story}: {recoil_m} m");
    }
    // A start, a hill and a stop are no stall.
    for (slope_rad, speed_m_s) in [(0.0, 0.3), (0.0873, 0.8), (-0.0873, 2.0)] {
        let tables = format!("chocked_until_armed = true\nterrain.plane = {{ slope_x_rad = {slope_rad:?} }}");
        let steps = format!("{}, {{ at_s = 10.0, action = \"drive\" }}", at_speed(speed_m_s));
        let outcome = fly(16.0, 5, &tables, &steps);
        let stalled = outcome
            .trace
            .rows
            .iter()
            .filter(|row| row.status.estimate.stalled)
            .count();
        assert_eq!(stalled, 0, "{slope_rad} {speed_m_s}");
    }
}

#[test]
fn sliding_wheels_are_told_and_rolling_ones_are_not() {
    for (slope_rad, friction, speed_m_s, seeds) in [
        (0.0873, 0.05, 0.8, [1, 11]),
        (0.0873, 0.04, 0.5, [2, 12]),
        (0.12, 0.06, 0.8, [3, 13]),
        (-0.0873, 0.04, 0.8, [4, 14]),
    ] {
        for seed in seeds {
            let tables = format!(
                "chocked_until_armed = true\nterrain.plane = {{ slope_x_rad = {slope_rad:?} }}\n\
                 terrain.patch = [{{ from_m = 2.0, to_m = 40.0, left = {friction:?}, right = {friction:?} }}]"
            );
            let outcome = fly(16.0, seed, &tables, &at_speed(speed_m_s));
            let rows = &outcome.trace.rows;
            let slides = |row: &&TraceRow| row.truth.sliding.contains(&true);
            let (sliding, told) = (
                rows.iter().filter(slides).count(),
                rows.iter()
                    .filter(slides)
                    .filter(|row| row.status.limits.contains(Limit::Slip))
                    .count(),
            );
            let story = format!("{friction} on {slope_rad} rad, seed {seed}");
            println!("{story}: {told} of {sliding} rows");
            assert!(sliding > 300, "{story}: the wheels hardly slide: {sliding} rows");
            assert!(told * 10 > sliding * 8, "{story}: {told} of {sliding}");
        }
    }
    for name in [
        "slope-drive",
        "figure-of-eight",
        "side-slope",
        "kerb",
        "rail-inspection",
    ] {
        let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../tests/scenarios");
        let path = std::path::Path::new(folder).join(format!("{name}.toml"));
        let outcome = drive(&Scenario::read(&path).expect("a good file"));
        let told = outcome
            .trace
            .rows
            .iter()
            .filter(|row| row.status.estimate.sliding)
            .count();
        assert_eq!(told, 0, "{name}");
    }
}

/// Time from the first slide of a vehicle that drives onto ground of this friction until the status reports the slide, s; and
/// the drive's description.
fn slide_told_after(friction: f64, slope_deg: f64, speed_m_s: f64, seed: u64) -> (Option<f64>, String) {
    let slope_rad = slope_deg.to_radians();
    // The ice begins beyond the distance that the start takes.
    let from_m = 1.0 + 2.0 * speed_m_s;
    let tables = format!(
        "chocked_until_armed = true\nterrain.plane = {{ slope_x_rad = {slope_rad:?} }}\n\
         terrain.patch = [{{ from_m = {from_m:?}, to_m = 60.0, left = {friction:?}, right = {friction:?} }}]"
    );
    let outcome = fly(8.0 + from_m / speed_m_s, seed, &tables, &at_speed(speed_m_s));
    let rows = &outcome.trace.rows;
    // A wheel that slips for a moment during the start is no slide.
    let slides = |rows: &[TraceRow]| rows.iter().all(|row| row.truth.sliding.contains(&true));
    let began = rows
        .windows(10)
        .position(slides)
        .map(|at| rows[at].time_s())
        .expect("a slide");
    let told = first(&outcome, began, |row| row.status.limits.contains(Limit::Slip));
    let story = format!("{friction:.3} on {slope_deg} deg at {speed_m_s} m/s, seed {seed}");
    println!("{story}: after {told:.2?} s");
    (told, story)
}

/// On ice that holds at most half of the vehicle's weight along the slope, the status reports the slide within a quarter of a
/// second: 0.15 s for which the sensors must disagree, and the delay of their filters.
#[test]
fn a_slide_is_told_within_a_quarter_of_a_second() {
    for slope_deg in [5.0_f64, -5.0, 10.0, -10.0, 15.0, -15.0, 20.0, -20.0] {
        for friction in [0.02, 0.5 * slope_deg.to_radians().abs().tan()] {
            for (speed_m_s, seeds) in [(0.3, [1, 11]), (0.8, [2, 12]), (2.5, [3, 13])] {
                for seed in seeds {
                    let (told, story) = slide_told_after(friction, slope_deg, speed_m_s, seed);
                    assert!(told.is_some_and(|s| s <= 0.25), "{story}: {told:?}");
                }
            }
        }
    }
}

/// Where the ground holds most of the vehicle's weight along the slope, the wheels hunt. The missing force slows the vehicle, or
/// speeds it up, by `g (sin(beta) - mu cos(beta))`: 0.59 m/s^2 with a friction of 0.3 on 20 deg.
#[test]
fn a_slide_near_the_limit_of_grip_is_told_within_a_second() {
    for (friction, slope_deg) in [(0.3, 20.0_f64), (0.3, -20.0), (0.2, 15.0), (0.2, -15.0)] {
        let slope_rad = slope_deg.to_radians();
        let lacks_m_s2 = 9.81 * (slope_rad.abs().sin() - friction * slope_rad.cos());
        assert!(lacks_m_s2 > 0.5, "{friction} on {slope_deg}: {lacks_m_s2}");
        for (speed_m_s, seeds) in [(0.3, [1, 11]), (0.8, [2, 12]), (1.5, [3, 13])] {
            for seed in seeds {
                let (told, story) = slide_told_after(friction, slope_deg, speed_m_s, seed);
                assert!(told.is_some_and(|s| s <= 1.0), "{story}: {told:?}");
            }
        }
    }
}

/// The vehicle learns 2 deg of mounting error in the first turn on the spot; once the error's effect has faded, the vehicle stays
/// in its place. Mistaken for a swing of the arm, the error would roll the wheels by 2 pi r sin 2 deg, 5.5 cm, per turn, on a
/// circle that ends where it began.
#[test]
fn an_imu_mounted_two_degrees_rolled_lets_the_vehicle_creep_less_than_5_cm_per_turn_once_it_has_turned() {
    for (misalignment_deg, yaw_rate, seed) in [
        (2.0, 1.9, 1),
        (2.0, 1.9, 11),
        (-2.0, -0.8, 2),
        (-2.0, -0.8, 12),
        (2.0, 1.2, 3),
        (2.0, 1.2, 13),
        (0.0, 1.9, 4),
        (0.0, 1.9, 14),
    ] {
        let tables = format!("plant.arm_imu.misalignment_x_deg = {misalignment_deg:?}");
        let steps = format!("{{ at_s = 4.0, action = \"drive\", yaw_rate_rad_s = {yaw_rate:?} }}");
        let outcome = fly(60.0, seed, &tables, &steps);
        let turn = |row: &TraceRow| (row.truth.heading_rad / (2.0 * std::f64::consts::PI)).abs();
        // Four turns to learn and to settle; then the displacement over each whole turn.
        let at = |turns: f64| {
            outcome
                .trace
                .rows
                .iter()
                .find(|row| turn(row) >= turns)
                .map(|row| row.truth)
        };
        let mut worst_m = 0.0_f64;
        let mut turns = 4.0;
        while let (Some(from), Some(to)) = (at(turns), at(turns + 1.0)) {
            worst_m = worst_m.max((to.x_m - from.x_m).hypot(to.y_m - from.y_m));
            turns += 1.0;
        }
        let settled: Vec<&TraceRow> = outcome.trace.rows.iter().filter(|row| turn(row) >= 4.0).collect();
        let rolled_m: f64 = settled
            .windows(2)
            .map(|pair| pair[0].truth.speed_m_s * (pair[1].time_s() - pair[0].time_s()))
            .sum();
        let rolled_m = rolled_m.abs() / (turns - 4.0);
        println!(
            "{misalignment_deg} deg, {yaw_rate} rad/s, seed {seed}: {worst_m:.3} m in the worst of {turns} turns, {rolled_m:.4} m rolled"
        );
        assert!(turns > 5.0, "{misalignment_deg} {yaw_rate}, seed {seed}: {turns}");
        assert!(
            worst_m < 0.05,
            "{misalignment_deg} {yaw_rate}, seed {seed}: {worst_m} m"
        );
        assert!(
            rolled_m < 0.05,
            "{misalignment_deg} {yaw_rate}, seed {seed}: {rolled_m} m rolled per turn"
        );
        assert_eq!(last(&outcome).status.faults, FaultSet::EMPTY);
    }
}
