//! The speed laws on the full plant.

use model::control::equilibrium::Equilibrium;
use model::supervise::arming::Mode;
use model::supervise::codes::{FaultSet, Limit};
use model::vehicle::GRAVITY_M_S2;
use virtual_board::scenario::trace::TraceRow;

mod support;
use support::generated::shown;
use support::reference;
use support::slopes::{changed, drive, from, most};

/// In a steady ramp the commanded, the estimated and the true angle of the arm agree, under both laws: the arm stands where the
/// equilibrium puts it, and the vehicle knows that.
#[test]
fn in_a_steady_ramp_the_arm_is_where_it_is_commanded_to_be() {
    let mut worst_deg = [0.0_f64; 2];
    for (law, limit_m_s2, ends_s) in [(0.0, 0.8, 23.3), (1.0, 2.0, 20.0)] {
        let vehicle = changed(|p| {
            p.control.law = law;
            p.control.acceleration_max_m_s2 = limit_m_s2;
        });
        let planar = vehicle.planar(0.0);
        let equilibrium = Equilibrium {
            alpha_l: planar.alpha * planar.l,
            mass: 1.0 + vehicle.spar_mass_ratio(),
            mu: planar.mu,
        };
        for slope_deg in [0.0_f64, 5.0, -5.0] {
            let steps = "{ at_s = 10.0, action = 'drive', speed_m_s = -2.4 },
                         { at_s = 18.0, action = 'drive', speed_m_s = 2.4 }";
            let outcome = drive(&vehicle, ends_s, slope_deg, "", steps);
            // Means, because the sensors are noisy: over the last part of the ramp, and over a second at rest before it, which
            // gives the error of this IMU's accelerometer.
            let rows = &outcome.trace.rows;
            let (rest, ramp) = (&rows[850..950], from(&outcome, ends_s - 0.8));
            let mean = |rows: &[TraceRow], value: &dyn Fn(&TraceRow) -> f64| {
                rows.iter().map(value).sum::<f64>() / rows.len() as f64
            };
            let error_deg = |row: &TraceRow| (f64::from(row.status.estimate.phi_rad) - row.truth.phi_rad).to_degrees();
            let offset_deg = mean(rest, &error_deg);
            let (first, last) = (ramp[0].status, ramp[ramp.len() - 1].status);
            let acceleration_m_s2 = f64::from(last.speed_reference_m_s - first.speed_reference_m_s)
                / ((last.time_us - first.time_us) as f64 * 1e-6);
            assert!(
                (acceleration_m_s2 - limit_m_s2).abs() < 0.015 * limit_m_s2,
                "{law} {slope_deg}: {acceleration_m_s2}"
            );
            let commanded_deg = mean(ramp, &|row| {
                let sin = f64::from(row.status.estimate.slope_rad).sin();
                let arm = equilibrium.arm(acceleration_m_s2 / GRAVITY_M_S2, sin, (1.0 - sin * sin).sqrt());
                arm.sin.asin().to_degrees()
            });
            let estimated_deg = mean(ramp, &|row| f64::from(row.status.estimate.phi_rad).to_degrees());
            let true_deg = mean(ramp, &|row| row.truth.phi_rad.to_degrees()) + offset_deg;
            println!(
                "law {law}, {slope_deg} deg: offset {offset_deg:.3}, commanded {commanded_deg:.3}, estimated {estimated_deg:.3}, true {true_deg:.3} deg"
            );
            for other in [estimated_deg, true_deg] {
                worst_deg[usize::from(law > 0.5)] =
                    worst_deg[usize::from(law > 0.5)].max((commanded_deg - other).abs());
                assert!(
                    (commanded_deg - other).abs() < 0.05,
                    "{law} {slope_deg}: {commanded_deg} {estimated_deg} {true_deg}"
                );
            }
        }
    }
    let [eq_3_25_deg, landing_deg] = worst_deg;
    shown(
        "steady ramps",
        &format!(
            "the arm's angles commanded, estimated and true agree to {landing_deg:.3} deg (Eq. 3.25: {eq_3_25_deg:.3} deg)"
        ),
    );
}

/// Steps of 0.3 to 2.5 m/s on slopes of up to 20 deg, forward and backward, settle into 2 % within 1.5 s median and 4 s worst, and
/// overshoot by 5 % at most. At 2 m/s^2 a step takes at least speed / 2 m/s^2: settling sooner would be a mistake.
#[test]
fn steps_on_slopes_land_without_overshoot() {
    let mut settling = Vec::new();
    let mut worst_over = 0.0_f64;
    for (speed_m_s, slope_deg) in [
        (0.3, -20.0),
        (0.3, 0.0),
        (0.3, 20.0),
        (-0.3, 10.0),
        (0.8, 5.0),
        (-0.8, 20.0),
        (1.5, -10.0),
        (1.5, 10.0),
        (2.5, -20.0),
        (2.5, 0.0),
        (-2.5, 10.0),
        (2.5, 20.0),
    ] {
        let steps = format!("{{ at_s = 8.0, action = 'drive', speed_m_s = {speed_m_s:?} }}");
        let outcome = drive(&reference(), 16.0, slope_deg, "", &steps);
        let rows = from(&outcome, 8.0);
        let error = |row: &TraceRow| row.truth.speed_m_s / speed_m_s - 1.0;
        let last = rows
            .iter()
            .rposition(|row| error(row).abs() > 0.02)
            .expect("a start at rest");
        assert!(last + 1 < rows.len(), "{speed_m_s} {slope_deg}: never settles");
        let settles_s = rows[last + 1].time_s() - 8.0;
        let (over, under) = (most(rows, error), most(rows, |row| -1.0 - error(row)));
        println!("{speed_m_s} m/s on {slope_deg} deg: {settles_s:.2} s, over {over:.4}, under {under:.3}");
        assert!(
            settles_s > speed_m_s.abs() / 2.0 && settles_s <= 4.0,
            "{speed_m_s} {slope_deg}: {settles_s} s"
        );
        assert!(over <= 0.05 && under <= 0.20, "{speed_m_s} {slope_deg}: {over} {under}");
        assert_eq!(rows[rows.len() - 1].status.faults, FaultSet::EMPTY);
        settling.push(settles_s);
        worst_over = worst_over.max(over);
    }
    settling.sort_by(f64::total_cmp);
    let median_s = settling[settling.len() / 2];
    assert!(median_s <= 1.5, "{median_s} s");
    shown(
        "steps of 0.3 to 2.5 m/s",
        &format!(
            "settling {median_s:.2} s median and {:.2} s worst, overshoot {:.1} % worst",
            settling[settling.len() - 1],
            100.0 * worst_over
        ),
    );
}

/// Released with its arm hanging, the vehicle rolls back until its arm is up: with a grip of 0.6 by at least 0.018, 0.050 and
/// 0.149 m on 5, 10 and 20 deg. Then it returns to where it was released.
#[test]
fn let_go_on_a_slope_it_rolls_back_little_and_returns() {
    let mut found = Vec::new();
    for (slope_deg, least_m, allowed_m) in [
        (5.0, 0.018, 0.10),
        (10.0, 0.050, 0.20),
        (20.0, 0.149, 0.60),
        (-10.0, 0.050, 0.20),
    ] {
        let outcome = drive(&reference(), 14.0, slope_deg, "", "");
        let back_m = most(&outcome.trace.rows, |row| -f64::signum(slope_deg) * row.truth.x_m);
        let last = &outcome.trace.rows[outcome.trace.rows.len() - 1];
        found.push(format!("{back_m:.2}"));
        println!(
            "{slope_deg} deg: rolls back {back_m:.3} m, ends at {:.3} m",
            last.truth.x_m
        );
        assert!(back_m > least_m && back_m <= allowed_m, "{slope_deg} deg: {back_m} m");
        assert!(
            last.truth.speed_m_s.abs() < 0.005,
            "{slope_deg}: {} m/s",
            last.truth.speed_m_s
        );
        assert!(
            last.truth.x_m.abs() < 0.1 * allowed_m,
            "{slope_deg}: {} m",
            last.truth.x_m
        );
        assert_eq!((last.status.mode, last.status.faults), (Mode::Armed, FaultSet::EMPTY));
    }
    shown(
        "let go with the arm hanging",
        &format!(
            "rolls back {}, {}, {}, {} m, and returns to where it was let go",
            found[0], found[1], found[2], found[3]
        ),
    );
}

/// Parked after a drive on slopes of up to 28 deg, the motors take the current that carries the vehicle's weight, more or less by
/// the share that the gears' friction carries, and the vehicle does not move.
#[test]
fn parking_takes_no_more_current_than_the_slope() {
    /// Current of the sensors' noise, A.
    const RIPPLE_A: f64 = 0.05;
    let vehicle = reference();
    let (body, motor) = (vehicle.parameters().body, vehicle.parameters().drive_motor);
    let per_n_m = 1.0 / (2.0 * motor.torque_constant_n_m_per_a * motor.gear_ratio);
    let weight_n_m = body.total_mass_kg * (1.0 + vehicle.spar_mass_ratio()) * GRAVITY_M_S2 * body.wheel_radius_m;
    let friction_a = 2.0 * motor.coulomb_friction_n_m * per_n_m;
    let (mut worst_a, mut last_a) = (0.0_f64, 0.0);
    for slope_deg in [0.0_f64, 2.0, 5.0, 10.0, -15.0, 20.0, -25.0, 28.0] {
        let steps = "{ at_s = 5.0, action = 'drive', speed_m_s = 0.5 }, { at_s = 9.0, action = 'drive' }";
        let outcome = drive(&vehicle, 20.0, slope_deg, "", steps);
        let parked = from(&outcome, 15.0);
        let squares: f64 = parked
            .iter()
            .map(|row| 0.5 * (row.truth.current_a[0].powi(2) + row.truth.current_a[1].powi(2)))
            .sum();
        let current_a = (squares / parked.len() as f64).sqrt();
        let slope_a = weight_n_m * slope_deg.to_radians().sin().abs() * per_n_m;
        println!("{slope_deg} deg: {current_a:.3} A, the slope takes {slope_a:.3} A, friction {friction_a:.3} A");
        let off_a = (current_a - slope_a).abs();
        assert!(
            off_a <= friction_a + RIPPLE_A,
            "{slope_deg} deg: {current_a} A, not {slope_a} A"
        );
        worst_a = worst_a.max(off_a);
        last_a = slope_a;
        let moved_m = most(parked, |row| (row.truth.x_m - parked[0].truth.x_m).abs());
        assert!(moved_m < 0.002, "{slope_deg} deg: {moved_m} m");
    }
    shown(
        "parks on slopes of up to 28 deg",
        &format!(
            "the motors draw the current that the vehicle's weight requires ({last_a:.1} A on 28 deg), within the {worst_a:.2} A that the gears' friction can hold"
        ),
    );
}

/// The vehicle is stuck at a wall of 75 mm for 4 to 20 s. While it pushes, its motors stay cool. Commanded to reverse, it reverses
/// within 1.5 s and is never more than 0.2 m/s too fast.
#[test]
fn stuck_at_a_wall_it_stays_cool_and_reverses_when_told() {
    let wall = "terrain.profile = [{ kind = 'step', at_m = 1.0, height_m = 0.075 }]";
    let mut worst = [0.0_f64; 3];
    for (speed_m_s, pushes_s) in [(0.3, 4.0), (0.3, 20.0), (1.0, 8.0)] {
        let told_s = 8.0 + pushes_s;
        let steps = format!(
            "{{ at_s = 4.0, action = 'drive', speed_m_s = {speed_m_s:?} }},
             {{ at_s = {told_s:?}, action = 'drive', speed_m_s = {:?} }}",
            -speed_m_s
        );
        let outcome = drive(&reference(), told_s + 6.0, 0.0, wall, &steps);
        let back = from(&outcome, told_s);
        let pushing = from(&outcome, told_s - 0.5 * pushes_s);
        let pushing = &pushing[..pushing.len() - back.len()];
        let current_a = most(pushing, |row| {
            row.truth.current_a[0].abs().max(row.truth.current_a[1].abs())
        });
        let reverses = back.iter().find(|row| row.truth.speed_m_s < -0.5 * speed_m_s);
        let reverses_s = reverses.expect("a reverse").time_s() - told_s;
        let fastest_m_s = most(back, |row| row.truth.speed_m_s.abs());
        println!("{speed_m_s} m/s for {pushes_s} s: {current_a:.2} A, {reverses_s:.2} s, {fastest_m_s:.2} m/s");
        assert!(
            pushing.iter().all(|row| row.truth.x_m > 0.7),
            "the vehicle does not push at the wall"
        );
        assert!(current_a > 1.0 && current_a < 4.0, "{current_a} A");
        assert!(reverses_s <= 1.5, "{reverses_s} s");
        assert!(fastest_m_s <= speed_m_s + 0.2, "{fastest_m_s} m/s");
        for (worst, found) in worst.iter_mut().zip([current_a, reverses_s, fastest_m_s - speed_m_s]) {
            *worst = worst.max(found);
        }
    }
    let [current_a, reverses_s, excess_m_s] = worst;
    shown(
        "pushes at a wall",
        &format!("{current_a:.1} A at most; reverses within {reverses_s:.2} s, at most {excess_m_s:.2} m/s too fast"),
    );
}

/// Edges that the vehicle nearly climbs, met at speed: it bounces off and tries again, but four seconds after it was first
/// held up (the time of a start, of a hard push and of the arm's coming down) it only leans on, however long it is commanded
/// to drive.
#[test]
fn an_edge_met_at_speed_is_not_tried_again_and_again() {
    let mut worst_a = 0.0_f64;
    for (speed_m_s, height_m) in [
        (1.5, 0.06),
        (1.8, 0.05),
        (2.0, 0.055),
        (2.0, 0.06),
        (2.2, 0.06),
        (2.5, 0.06),
        (2.5, 0.075),
    ] {
        let wall = format!("terrain.profile = [{{ kind = 'step', at_m = 1.2, height_m = {height_m:?} }}]");
        let steps = format!("{{ at_s = 4.0, action = 'drive', speed_m_s = {speed_m_s:?} }}");
        let outcome = drive(&reference(), 40.0, 0.0, &wall, &steps);
        let rows = from(&outcome, 4.0);
        let hits = rows.iter().find(|row| row.truth.x_m > 0.9).expect("it comes there");
        let pushing = from(&outcome, hits.time_s() + 4.0);
        let current_a = most(pushing, |row| {
            row.truth.current_a[0].abs().max(row.truth.current_a[1].abs())
        });
        let status = pushing[pushing.len() - 1].status;
        let story = format!("{speed_m_s} m/s, {height_m} m");
        println!("{story}: {current_a:.1} A");
        assert!(
            pushing.iter().all(|row| row.truth.x_m < 1.2),
            "{story}: it does not climb the edge"
        );
        assert!(current_a < 4.0, "{story}: {current_a} A");
        assert!(status.limits.contains(Limit::Stall), "{story}: it says so");
        assert_eq!((status.mode, status.faults), (Mode::Armed, FaultSet::EMPTY), "{story}");
        worst_a = worst_a.max(current_a);
    }
    shown(
        "edges of 50 to 75 mm, met at 1.5 to 2.5 m/s",
        &format!(
            "the vehicle tries for four seconds, then leans on the edge with at most {worst_a:.1} A while the command lasts; the status reports *Stall*"
        ),
    );
}

/// Driven onto a hill and there stuck at a wall, the vehicle reckons with the hill that it has learnt: it pushes without
/// bouncing, stays cool, and reverses on command, as on the level.
#[test]
fn stuck_at_a_wall_on_a_hill_it_does_not_bounce() {
    const WALL_M: f64 = 6.0;
    let mut worst = [0.0_f64; 4];
    for (speed_m_s, hill_deg) in [(1.0, 10.0_f64), (1.0, -10.0), (0.5, 5.0), (1.5, -5.0), (0.8, 15.0)] {
        let ground = format!(
            "terrain.profile = [
               {{ kind = 'ramp', from_m = 1.0, length_m = 30.0, slope_rad = {:?}, transition_m = 0.5 }},
               {{ kind = 'step', at_m = {WALL_M:?}, height_m = 0.075 }}]",
            hill_deg.to_radians()
        );
        let pushes_s = 4.0 + 1.4 * WALL_M / speed_m_s + 3.0;
        let told_s = pushes_s + 12.0;
        let steps = format!(
            "{{ at_s = 4.0, action = 'drive', speed_m_s = {speed_m_s:?} }},
             {{ at_s = {told_s:?}, action = 'drive', speed_m_s = {:?} }}",
            -speed_m_s
        );
        let outcome = drive(&reference(), told_s + 3.0, 0.0, &ground, &steps);
        let back = from(&outcome, told_s);
        let pushing = from(&outcome, pushes_s);
        let pushing = &pushing[..pushing.len() - back.len()];
        let story = format!("{speed_m_s} m/s, {hill_deg} deg");
        let fastest_m_s = most(pushing, |row| row.truth.speed_m_s.abs());
        let cool = &pushing[pushing.len() / 2..];
        let current_a = most(cool, |row| {
            row.truth.current_a[0].abs().max(row.truth.current_a[1].abs())
        });
        let reverses = back.iter().find(|row| row.truth.speed_m_s < -0.5 * speed_m_s);
        let reverses_s = reverses.expect("it reverses").time_s() - told_s;
        let back_m_s = most(back, |row| -row.truth.speed_m_s);
        println!("{story}: {fastest_m_s:.2} m/s, {current_a:.1} A, {reverses_s:.2} s, {back_m_s:.2} m/s");
        assert!(fastest_m_s < 0.05, "{story}: the vehicle bounces at {fastest_m_s} m/s");
        // The current that holds the vehicle on the hill, and the push of a vehicle on the level.
        let (p, motor) = (reference().parameters().body, reference().parameters().drive_motor);
        let weight_n_m = p.total_mass_kg * (1.0 + reference().spar_mass_ratio()) * GRAVITY_M_S2 * p.wheel_radius_m;
        let hold_n_m = weight_n_m * hill_deg.max(0.0).to_radians().sin();
        let hold_a = hold_n_m / (2.0 * motor.torque_constant_n_m_per_a * motor.gear_ratio);
        assert!(
            current_a < hold_a + 4.0,
            "{story}: {current_a} A, of which the hill takes {hold_a}"
        );
        assert!(
            reverses_s <= 1.5 && back_m_s <= speed_m_s + 0.2,
            "{story}: {reverses_s} s, {back_m_s} m/s"
        );
        let found = [fastest_m_s, current_a - hold_a, reverses_s, back_m_s - speed_m_s];
        for (worst, found) in worst.iter_mut().zip(found) {
            *worst = worst.max(found);
        }
    }
    let [bounce_m_s, push_a, reverses_s, excess_m_s] = worst;
    shown(
        "driven onto hills of -10 to 15 deg",
        &format!(
            "once it has given up pushing hard, {push_a:.1} A at most beside what the hill takes; moves at {bounce_m_s:.2} m/s at most; reverses within \
             {reverses_s:.2} s, at most {excess_m_s:.2} m/s too fast"
        ),
    );
}

/// Commanded to reverse while it still bounces off a wall of 75 mm, or has just begun to push, the vehicle leaves the wall at most
/// 0.2 m/s faster than commanded: it assumes no obstacle behind itself.
#[test]
fn turned_back_at_a_wall_it_leaves_as_fast_as_commanded() {
    let wall = "terrain.profile = [{ kind = 'step', at_m = 1.0, height_m = 0.075 }]";
    for (speed_m_s, told_s) in [(1.0, 5.6), (1.0, 6.0), (2.0, 5.0), (2.0, 5.6), (2.0, 6.0), (2.0, 9.0)] {
        let steps = format!(
            "{{ at_s = 4.0, action = 'drive', speed_m_s = {speed_m_s:?} }},
             {{ at_s = {told_s:?}, action = 'drive', speed_m_s = {:?} }}",
            -speed_m_s
        );
        let outcome = drive(&reference(), told_s + 5.0, 0.0, wall, &steps);
        let fastest_m_s = most(from(&outcome, told_s), |row| -row.truth.speed_m_s);
        println!("{speed_m_s} m/s, told back at {told_s} s: {fastest_m_s:.2} m/s");
        assert!(
            fastest_m_s > 0.98 * speed_m_s && fastest_m_s <= speed_m_s + 0.2,
            "{speed_m_s} m/s at {told_s} s: {fastest_m_s} m/s"
        );
    }
}
