//! Slopes near and beyond the steepest slope on which the vehicle can stand: held, driven, refused.

use model::supervise::arming::Mode;
use model::supervise::codes::{Fault, FaultSet, Limit};
use model::vehicle::Vehicle;
use virtual_board::scenario::trace::TraceRow;

#[path = "support/heat.rs"]
mod heat;
mod support;
use heat::heats;
use support::flights::{first, last};
use support::generated::shown;
use support::reference;
use support::slopes::{changed, drive, from, most};

/// Ground that grips with 0.9, in TOML.
const GRIPPY_GROUND: &str = "terrain.friction = { left = 0.9, right = 0.9 }";

/// The reference vehicle with that grip in its file.
fn grippy() -> Vehicle<f64> {
    changed(|p| p.control.grip_mu = 0.9)
}

fn told(row: &TraceRow) -> bool {
    row.status.limits.contains(Limit::SlopeLimit)
}

/// On 31 deg, facing uphill and downhill, the vehicle catches itself, holds, and drives up and down. To stop on the way down it has
/// 0.15 m/s^2: the difference between 31 deg and 33.6 deg, less the margin that the arm keeps.
#[test]
fn the_steepest_slopes_are_held_and_driven_up_and_down() {
    let [mut off_m_s, mut rest_m_s] = [0.0_f64; 2];
    for (slope_deg, speed_m_s) in [(31.0, 0.5), (31.0, -0.5), (-31.0, 0.5), (-31.0, -0.5)] {
        let steps = format!(
            "{{ at_s = 12.0, action = 'drive', speed_m_s = {speed_m_s:?} }}, {{ at_s = 17.0, action = 'drive' }}"
        );
        let outcome = drive(&grippy(), 24.0, slope_deg, GRIPPY_GROUND, &steps);
        let speed = |at_s: f64| from(&outcome, at_s)[0].truth.speed_m_s;
        let story = format!("{slope_deg} deg, told {speed_m_s} m/s");
        println!("{story}: {:.3} m/s, told 0: {:.3} m/s", speed(16.5), speed(23.5));
        let stands_m_s = most(from(&outcome, 23.0), |row| row.truth.speed_m_s.abs());
        off_m_s = off_m_s.max((speed(16.5) - speed_m_s).abs());
        rest_m_s = rest_m_s.max(stands_m_s);
        assert!((speed(16.5) - speed_m_s).abs() < 0.02, "{story}");
        assert!(stands_m_s < 0.02, "{story}");
        let status = last(&outcome).status;
        assert_eq!((status.mode, status.faults), (Mode::Armed, FaultSet::EMPTY), "{story}");
    }
    shown(
        "31 deg with mu 0.9",
        &format!("drives up and down to {off_m_s:.3} m/s of the commanded speed, and holds to {rest_m_s:.3} m/s"),
    );
}

/// How far raising the arm pushes the axle back relative to the common centre of mass, m: alpha L sin(phi) r / (1 + S + mu) at the
/// arm's largest standing angle, 1.28 rad.
const PUSHED_BACK_M: f64 = 0.126;

/// Armed on a slope on which it cannot stand, the vehicle reports this within a second of the release of its wheels and begins a
/// controlled stop, which ends with open bridges. Until then the vehicle has at no time rolled further than with its bridges open
/// from the start, apart from the distance by which raising the arm pushes it back, and in the end it has rolled much less far. The
/// arm stays below the fault's angle as long as the supply can hold the arm: up to 35 deg for the four seconds of the stop.
#[test]
fn armed_where_it_cannot_stand_the_vehicle_refuses() {
    let (mut latest_s, mut furthest_m, mut least_saved_m) = (0.0_f64, 0.0_f64, f64::INFINITY);
    for slope_deg in [33.0, 35.0, 38.0, -33.0, -35.0, -38.0] {
        let outcome = drive(&grippy(), 8.0, slope_deg, GRIPPY_GROUND, "");
        let open = drive(
            &grippy(),
            8.0,
            slope_deg,
            GRIPPY_GROUND,
            "{ at_s = 2.02, action = 'disarm' }",
        );
        let has = |row: &TraceRow, fault: Fault| row.status.faults.contains(fault);
        let refused_s = first(&outcome, 2.0, |row| has(row, Fault::SteepSlope)).expect("refused");
        let stops = |row: &TraceRow| row.status.mode == Mode::Stopping;
        let stops_s = first(&outcome, 2.0, stops).expect("a controlled stop");
        let opens_s = first(&outcome, 2.5, |row| row.status.mode == Mode::Disarmed).expect("opened") + 2.5;
        assert!(refused_s > 0.1 && refused_s <= 1.0, "{slope_deg} deg: {refused_s} s");
        assert!((stops_s - refused_s).abs() < 0.015, "{slope_deg} deg: {stops_s} s");

        let down = |row: &TraceRow| -f64::signum(slope_deg) * row.truth.x_m;
        let pairs = outcome.trace.rows.iter().zip(&open.trace.rows);
        let beyond_m = pairs
            .take_while(|(row, _)| row.time_s() <= opens_s)
            .map(|(row, open)| down(row) - down(open))
            .fold(f64::NEG_INFINITY, f64::max);
        let saved_m = down(&from(&open, opens_s)[0]) - down(&from(&outcome, opens_s)[0]);
        let before = &outcome.trace.rows[..outcome.trace.rows.partition_point(|row| row.time_s() < opens_s)];
        let arm_rad = most(before, |row| row.truth.phi_rad.abs());
        println!(
            "{slope_deg} deg: refused after {refused_s:.2} s, open after {:.2} s; at most {beyond_m:.3} m beyond open bridges, in the end {saved_m:.2} m less; arm {arm_rad:.2} rad",
            opens_s - 2.0
        );
        assert!(
            beyond_m < PUSHED_BACK_M && saved_m > 0.5,
            "{slope_deg} deg: {beyond_m} m, {saved_m} m"
        );
        assert!(arm_rad > 1.0 && arm_rad < 1.45, "{slope_deg} deg: {arm_rad} rad");
        let faults = last(&outcome).status.faults;
        let expected = if f64::abs(slope_deg) < 36.0 {
            Fault::StopTimeout
        } else {
            Fault::ArmAngle
        };
        assert!(
            faults.contains(Fault::SteepSlope) && faults.contains(expected),
            "{slope_deg} deg: {faults}"
        );
        latest_s = latest_s.max(refused_s);
        furthest_m = furthest_m.max(beyond_m);
        least_saved_m = least_saved_m.min(saved_m);
    }
    shown(
        "armed on 33, 35, 38 deg",
        &format!(
            "refuses within {latest_s:.2} s (*SteepSlope*); comes at most {furthest_m:.2} m further than with open bridges from the start, which is the arm's rise, and by the time they open at least {least_saved_m:.1} m less far"
        ),
    );
}

/// On 35 deg with the arm at 1.28 rad, the balance of forces leaves 0.68 m/s^2 downhill: the vehicle accelerates no more than that.
#[test]
fn where_it_cannot_stand_it_slides_as_slowly_as_the_arm_s_weight_allows() {
    let outcome = drive(&grippy(), 6.0, 35.0, GRIPPY_GROUND, "");
    let rows = from(&outcome, 3.5);
    let lost_m_s2 = (rows[0].truth.speed_m_s - rows[rows.len() - 1].truth.speed_m_s) / 2.5;
    println!("{lost_m_s2:.2} m/s^2 downhill");
    assert!(rows.iter().all(told), "the status stops reporting the limit");
    assert!(lost_m_s2 > 0.3 && lost_m_s2 < 0.75, "{lost_m_s2} m/s^2");
}

/// Driven onto a slope on which it cannot stand, the vehicle reports this and drives no further up. It stays where the ramp becomes
/// too steep, without rolling back, and drives back on command; forward and backward.
#[test]
fn driven_onto_a_slope_beyond_its_own_it_stays_at_its_foot_and_drives_back() {
    let mut furthest_m = 0.0_f64;
    for (slope_deg, speed_m_s) in [(33.0_f64, 1.0), (35.0, -1.0), (38.0, 1.0), (38.0, -1.0)] {
        let way = f64::signum(speed_m_s);
        // The ramp begins 2 m ahead and bends upwards over the first half metre.
        let from_m = if way > 0.0 { 2.0 } else { -8.0 };
        let ground = format!(
            "{GRIPPY_GROUND}\nterrain.profile = [{{ kind = 'ramp', from_m = {from_m:?}, length_m = 6.0, slope_rad = {:?}, transition_m = 0.5 }}]",
            way * slope_deg.to_radians()
        );
        let steps = format!(
            "{{ at_s = 4.0, action = 'drive', speed_m_s = {speed_m_s:?} }}, {{ at_s = 12.0, action = 'drive', speed_m_s = {:?} }}",
            -speed_m_s
        );
        let outcome = drive(&grippy(), 16.0, 0.0, &ground, &steps);
        let place = |row: &TraceRow| way * row.truth.x_m;
        let story = format!("{slope_deg} deg, {speed_m_s} m/s");
        let up = &from(&outcome, 8.0)[..400];
        let (least_m, most_m) = (-most(up, |row| -place(row)), most(up, place));
        let told_s = first(&outcome, 6.0, told).expect("told") + 6.0;
        println!("{story}: told at {told_s:.1} s, stays at {least_m:.2} to {most_m:.2} m");
        assert!(least_m > 2.0 && most_m < 2.5, "{story}: {least_m} {most_m}");
        assert!(
            most(from(&outcome, 4.0), |row| row.truth.speed_m_s.abs()) < 1.5,
            "{story}"
        );
        let end = last(&outcome);
        assert!(
            place(end) < 1.0 && (way * end.truth.speed_m_s + 1.0).abs() < 0.05,
            "{story}: back"
        );
        assert_eq!(
            (end.status.mode, end.status.faults),
            (Mode::Armed, FaultSet::EMPTY),
            "{story}"
        );
        furthest_m = furthest_m.max(most_m - 2.0);
    }
    shown(
        "driven onto 33, 35, 38 deg",
        &format!("stays within {furthest_m:.2} m of the slope's foot (*SlopeLimit*), drives back when told"),
    );
}

/// Hills whose foot bends upwards within 0.15 m, less than the wheel's radius. The vehicle drives up hills of up to 15 deg at every
/// speed. A foot of 20 deg may stop it at 0.5 m/s and less, as a kerb does, and the vehicle reports that.
#[test]
fn the_sharp_foot_of_a_hill_is_climbed_or_told() {
    for slope_deg in [10.0_f64, 15.0, 20.0] {
        for speed_m_s in [0.3, 0.5, 0.8, 1.2] {
            let ground = format!(
                "terrain.profile = [{{ kind = 'ramp', from_m = 1.0, length_m = 40.0, slope_rad = {:?}, transition_m = 0.15 }}]",
                slope_deg.to_radians()
            );
            let steps = format!("{{ at_s = 4.0, action = 'drive', speed_m_s = {speed_m_s:?} }}");
            let outcome = drive(&reference(), 24.0, 0.0, &ground, &steps);
            let end = last(&outcome);
            let stopped = end.status.limits.contains(Limit::Stall) && (0.8..1.3).contains(&end.truth.x_m);
            let drives = (end.truth.speed_m_s - speed_m_s).abs() < 0.1 * speed_m_s && end.truth.x_m > 3.0;
            let story = format!(
                "{slope_deg} deg, {speed_m_s} m/s: {:.2} m/s at {:.2} m",
                end.truth.speed_m_s, end.truth.x_m
            );
            println!("{story}, {}", end.status.limits);
            assert!(drives || (slope_deg > 15.0 && speed_m_s <= 0.5 && stopped), "{story}");
            assert_eq!(
                (end.status.mode, end.status.faults),
                (Mode::Armed, FaultSet::EMPTY),
                "{story}"
            );
        }
    }
}

/// The limit SlopeLimit lies at 0.95 of the slope that grip or the arm's weight holds. With `grip_mu` 0.6 that is 29.4 deg of 30.96:
/// above, the vehicle reports that it accepts no command uphill.
#[test]
fn a_slope_beyond_the_grip_is_told() {
    for (slope_deg, expected) in [
        (20.0, false),
        (28.8, false),
        (30.1, true),
        (-28.8, false),
        (-30.1, true),
    ] {
        let outcome = drive(&reference(), 7.0, slope_deg, GRIPPY_GROUND, "");
        let rows = from(&outcome, 5.5);
        assert!(rows.iter().all(|row| told(row) == expected), "{slope_deg} deg");
    }
}

/// Barely beyond 30.96 deg, which `grip_mu` holds, the refusal waits until the vehicle has learnt the slope, and comes by itself: the
/// vehicle does not keep rolling at a speed that it cannot reduce.
#[test]
fn armed_hardly_beyond_the_limit_the_vehicle_refuses_too() {
    for slope_deg in [31.0, -31.0, 31.5] {
        for seed in [1, 2, 3] {
            let outcome = drive(
                &reference(),
                8.0,
                slope_deg,
                &format!("seed = {seed}\n{GRIPPY_GROUND}"),
                "",
            );
            let refused_s = first(&outcome, 2.0, |row| row.status.faults.contains(Fault::SteepSlope));
            assert!(
                refused_s.is_some_and(|s| s < 4.0),
                "{slope_deg} deg, seed {seed}: {refused_s:?}"
            );
        }
    }
}

/// Beyond 20 deg (`continuous_slope_deg` of `check`) holding takes more than the motors' continuous current. When the motors are hot,
/// the vehicle can no longer stand there facing up or down. It reports *MotorHeat*, turns across the slope until the motors hold the
/// slope that remains along its heading, drives back towards its place as far as the current allows, and comes to rest without a
/// fault. The weight that the current no longer holds, at most 3 m/s^2, turns the vehicle within a second: a user would still call
/// 1 m/s and a metre and a half gentle.
#[test]
fn held_until_the_motors_are_hot_the_vehicle_turns_across_the_slope_and_stands() {
    let [mut fastest_m_s, mut furthest_m, mut hottest] = [0.0_f64; 3];
    for (vehicle, slope_deg, seconds) in [
        (grippy(), 24.0, 80.0),
        (grippy(), 28.0, 60.0),
        (grippy(), -28.0, 60.0),
        (grippy(), 31.0, 90.0),
        (grippy(), -31.0, 90.0),
        (reference(), 30.0, 200.0),
    ] {
        for seed in [1, 2] {
            let outcome = drive(
                &vehicle,
                seconds,
                slope_deg,
                &format!("seed = {seed}\n{GRIPPY_GROUND}"),
                "",
            );
            let story = format!("{slope_deg} deg, seed {seed}");
            let motor = &vehicle.parameters().drive_motor;
            let [left, right] = [0, 1].map(|side| {
                let rows = &outcome.trace.rows;
                heats(rows, side, motor.continuous_current_a, motor.winding_time_constant_s)
            });
            let hotter = |((at_s, left), (_, right)): (&(f64, f64), &(f64, f64))| (*at_s, left.max(*right));
            let heats: Vec<(f64, f64)> = left.iter().zip(&right).map(hotter).collect();
            let hot_s = first(&outcome, 0.0, |row| row.status.limits.contains(Limit::MotorHeat)).expect("told");
            let at_hot = heats.iter().find(|(time_s, _)| *time_s >= hot_s).expect("a row").1;
            // From heat 0.9 to 1 the limit falls from its full value to the continuous current; on the way it meets the hold's current.
            let hold_a = from(&outcome, hot_s)[0].truth.current_a[0].abs();
            let above = (hold_a - motor.continuous_current_a) / (motor.current_limit_a - motor.continuous_current_a);
            let expected = 1.0 - 0.1 * above;
            assert!(
                (at_hot - expected).abs() < 0.02,
                "{story}: reported at a heat of {at_hot}, not {expected}"
            );
            let faults = first(&outcome, 0.0, |row| row.status.faults != FaultSet::EMPTY);
            assert_eq!(faults, None, "{story}");
            let rows = from(&outcome, hot_s);
            let speed_m_s = most(rows, |row| row.truth.speed_m_s.abs());
            let down_m = most(rows, |row| (rows[0].truth.x_m - row.truth.x_m) * slope_deg.signum());
            let hot = heats.iter().map(|(_, heat)| *heat).fold(0.0, f64::max);
            println!("{story}: hot after {hot_s:.1} s; {speed_m_s:.2} m/s at most, {down_m:.2} m down; heat {hot:.3}");
            assert!(speed_m_s < 1.0, "{story}: {speed_m_s} m/s");
            assert!(down_m < 1.5, "{story}: {down_m} m down the slope");
            assert!(hot < 1.1, "{story}: heat {hot}");
            let rests = from(&outcome, seconds - 5.0);
            assert!(most(rests, |row| row.truth.speed_m_s.abs()) < 0.02, "{story}: stands");
            fastest_m_s = fastest_m_s.max(speed_m_s);
            furthest_m = furthest_m.max(down_m);
            hottest = hottest.max(hot);
        }
    }
    shown(
        "held on slopes of 24 to 31 deg until the motors are hot",
        &format!(
            "turns across the slope at {fastest_m_s:.2} m/s at most, {furthest_m:.2} m down at most, and stands there; \
             the winding's heat is {hottest:.2} of the heat of its continuous current"
        ),
    );
}

/// On these slopes holding takes more current than such bridges bear for ever, and less than the windings bear. Within seconds the
/// status reports the limit, and the vehicle turns across the slope, as it does with hot windings, and comes to rest. No bridge gets
/// so hot that it shuts itself down, which would let the vehicle roll away.
#[test]
fn bridges_that_bear_less_than_the_hold_do_not_shut_down() {
    let vehicle = changed(|p| p.drive_motor.bridge_continuous_a = 4.0);
    let motor = &vehicle.parameters().drive_motor;
    for (slope_deg, seed) in [(18.0, 1), (-18.0, 2), (20.0, 3), (-20.0, 4)] {
        let outcome = drive(
            &vehicle,
            60.0,
            slope_deg,
            &format!("seed = {seed}\n{GRIPPY_GROUND}"),
            "",
        );
        let story = format!("{slope_deg} deg, seed {seed}");
        let told_s = first(&outcome, 0.0, |row| row.status.limits.contains(Limit::MotorHeat)).expect("told");
        assert!(told_s < 12.0, "{story}: told after {told_s} s");
        let opened = first(&outcome, 0.0, |row| row.status.faults != FaultSet::EMPTY);
        assert_eq!(opened, None, "{story}: {:?}", last(&outcome).status.faults);
        for side in [0, 1] {
            let rows = &outcome.trace.rows;
            let bridge = heats(rows, side, motor.bridge_continuous_a, motor.bridge_time_constant_s);
            let winding = heats(rows, side, motor.continuous_current_a, motor.winding_time_constant_s);
            let hottest = |heats: &[(f64, f64)]| heats.iter().map(|(_, heat)| *heat).fold(0.0, f64::max);
            assert!(hottest(&bridge) < 1.1, "{story}: {}", hottest(&bridge));
            assert!(
                hottest(&winding) < 0.9,
                "{story}: the windings get hot, {}",
                hottest(&winding)
            );
        }
        let moves_m_s = most(from(&outcome, told_s), |row| row.truth.speed_m_s.abs());
        assert!(moves_m_s < 1.0, "{story}: {moves_m_s} m/s");
        let rests = from(&outcome, 55.0);
        assert!(most(rests, |row| row.truth.speed_m_s.abs()) < 0.02, "{story}: stands");
    }
}

/// Bridges that bear far less than the vehicle file says, as without their cooling: a bridge shuts itself down, its fault output
/// opens the others in hardware, and the vehicle disarms and reports the fault.
#[test]
fn a_bridge_that_shuts_itself_down_opens_the_others() {
    let worse = "plant.vehicle = { drive_motor.bridge_continuous_a = 3.0 }";
    let outcome = drive(&reference(), 12.0, 20.0, &format!("{worse}\n{GRIPPY_GROUND}"), "");
    let told_s = first(&outcome, 0.0, |row| row.status.faults.contains(Fault::BridgeBreak)).expect("told");
    assert!(
        from(&outcome, told_s)
            .iter()
            .all(|row| !row.bridges_on && row.status.mode == Mode::Disarmed)
    );
    let heat = heats(&outcome.trace.rows, 0, 3.0, 3.0);
    let at = heat.iter().find(|(at_s, _)| *at_s >= told_s).expect("a row").1;
    // The bridge shuts down 90 K above the hottest air; the rated current makes 65 K, with a resistance that grows by 40 %.
    assert!((1.2..90.0 / 65.0 * 1.4).contains(&at), "shut down at a heat of {at}");
}
