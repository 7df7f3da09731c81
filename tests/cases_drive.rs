//! Obstacles at which comparable machines have run away or kept pushing: scenarios on the virtual board, each kind at several
//! values and seeds. `tests/control.rs` tries further values and slopes.

use model::supervise::arming::Mode;
use model::supervise::codes::FaultSet;
use virtual_board::scenario::trace::TraceRow;

#[path = "support/outcomes.rs"]
mod outcomes;
#[path = "support/short_cases.rs"]
mod short_cases;
mod support;
use short_cases::SHORT_CASES;
use support::flights::{at_speed, drive, first, fly, last};

/// The cases that the flashed ELF flies, too.
#[test]
fn the_short_cases_end_as_they_must() {
    for case in SHORT_CASES {
        for seed in [1, 2, 3] {
            case.check(seed, &drive(&case.scenario(seed)));
        }
    }
}

/// A step in the ground, 1.5 m ahead of a vehicle that drives at `speed_m_s`, which rises by `height_m` as the vehicle meets it.
fn kerb(height_m: f64, speed_m_s: f64) -> String {
    let way = f64::signum(speed_m_s);
    let (at_m, rise_m) = (1.5 * way, height_m * way);
    format!("terrain.profile = [{{ kind = \"step\", at_m = {at_m:?}, height_m = {rise_m:?} }}]")
}

/// Distance of the axle from a kerb whose edge the wheels, of 0.25 m, touch.
fn touches_before_m(height_m: f64) -> f64 {
    (height_m * (2.0 * 0.25 - height_m)).sqrt()
}

fn fastest_m_s<'a>(rows: impl Iterator<Item = &'a TraceRow>) -> f64 {
    rows.map(|row| row.truth.speed_m_s.abs()).fold(0.0, f64::max)
}

#[test]
fn behind_a_kerb_the_vehicle_is_no_more_than_half_a_metre_per_second_too_fast() {
    // The first two kerbs stop the vehicle; it comes over the others.
    for (height_m, speed_m_s, over) in [
        (0.02, 0.3, false),
        (0.015, -0.3, false),
        (0.01, -0.8, true),
        (0.015, 1.0, true),
        (0.03, -1.5, true),
    ] {
        for seed in [5, 15] {
            let outcome = fly(
                8.0 + 4.0 / f64::abs(speed_m_s),
                seed,
                &kerb(height_m, speed_m_s),
                &at_speed(speed_m_s),
            );
            let story = format!("{height_m} m at {speed_m_s} m/s, seed {seed}");
            let excess_m_s = fastest_m_s(outcome.trace.rows.iter()) - f64::abs(speed_m_s);
            println!("{story}: {excess_m_s:.2} m/s too fast");
            assert!(excess_m_s <= 0.5, "{story}: {excess_m_s} m/s");
            let status = &last(&outcome).status;
            assert_eq!((status.mode, status.faults), (Mode::Armed, FaultSet::EMPTY), "{story}");
            let furthest = |row: &TraceRow| row.truth.x_m.abs();
            let came_m = outcome.trace.rows.iter().map(furthest).fold(0.0, f64::max);
            let place_m = if over { 1.5 } else { 1.5 - touches_before_m(height_m) };
            assert!(came_m > place_m - 0.001, "{story}: {came_m} m of {place_m} m");
        }
    }
}

#[test]
fn a_vehicle_at_a_wall_backs_off_within_1_5_s_of_the_order() {
    for (height_m, speed_m_s, pushes_s) in [
        (0.075, 0.3, 8.0),
        (0.06, -0.3, 4.0),
        (0.075, 0.6, 15.0),
        (0.07, 1.0, 6.0),
    ] {
        for seed in [6, 16] {
            let told_s = 4.0 + 2.0 / f64::abs(speed_m_s) + pushes_s;
            let steps = format!(
                "{}, {{ at_s = {told_s:?}, action = \"drive\", speed_m_s = {:?} }}",
                at_speed(speed_m_s),
                -speed_m_s
            );
            let outcome = fly(told_s + 4.0, seed, &kerb(height_m, speed_m_s), &steps);
            let story = format!("{height_m} m at {speed_m_s} m/s for {pushes_s} s, seed {seed}");
            let way = f64::signum(speed_m_s);
            let before = outcome.trace.rows.iter().rfind(|row| row.time_s() < told_s);
            let place_m = way * before.expect("rows").truth.x_m;
            assert!(
                place_m > 1.1 && place_m < 1.5,
                "{story}: the vehicle does not stand at the wall: {place_m} m"
            );
            let backs_s = first(&outcome, told_s, |row| row.truth.speed_m_s / speed_m_s < -0.5);
            let back = outcome.trace.rows.iter().filter(|row| row.time_s() >= told_s);
            let fastest = fastest_m_s(back);
            println!("{story}: backs off after {backs_s:?} s, {fastest:.2} m/s");
            assert!(backs_s.is_some_and(|s| s <= 1.5), "{story}: {backs_s:?} s");
            assert!(fastest <= f64::abs(speed_m_s) + 0.2, "{story}: {fastest} m/s");
            assert_eq!(last(&outcome).status.mode, Mode::Armed, "{story}");
        }
    }
}
