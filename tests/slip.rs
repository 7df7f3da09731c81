//! Ground with less grip than the vehicle file states: the wheels slide no more than necessary.

use model::supervise::arming::Mode;
use model::supervise::codes::{FaultSet, Limit};
use rayon::prelude::*;
use virtual_board::scenario::trace::TraceRow;

mod support;
use support::flights::{drive, scenario};
use support::generated::shown;

/// When the operator commands a stop, s.
const STOPS_S: f64 = 15.0;

/// Allowed slip, m/s: the largest slip that the law asks for, and what the wheels gain at 2 m/s^2 in the 0.15 s until the vehicle
/// knows of the slide.
const SLIP_M_S: f64 = 0.3 + 0.15 * 2.0;
/// Drift of the estimated speed over the ground, m/s^2.
const DRIFT_M_S2: f64 = 0.06;

/// While the vehicle speeds up on ice, its wheels run only a little faster than the vehicle. This costs the vehicle little time:
/// speeding up and stopping take hardly longer than friction, or the ramp, demands. The status reports the slide, and the vehicle
/// stays armed without a fault.
#[test]
fn on_ice_the_wheels_slide_no_more_than_they_must() {
    let drives: Vec<_> = [
        (0.05, 1.5),
        (0.07, 1.5),
        (0.09, 1.5),
        (0.12, 1.5),
        (0.05, 2.5),
        (0.03, 1.5),
    ]
    .into_par_iter()
    .flat_map(|(mu, speed_m_s)| [1, 2].into_par_iter().map(move |seed| (mu, speed_m_s, seed)))
    .collect();
    let worst: Vec<[f64; 2]> = drives
        .into_par_iter()
        .map(|(mu, speed_m_s, seed)| on_ice(mu, speed_m_s, seed))
        .collect();
    let [slip_m_s, late_s] = [0, 1].map(|which| worst.iter().map(|found| found[which]).fold(0.0, f64::max));
    shown(
        "speeds up to 1.5 and 2.5 m/s on ice",
        &format!(
            "slip {slip_m_s:.2} m/s at most while it speeds up; there and at rest at most {late_s:.2} s later than friction and ramp take"
        ),
    );
}

/// Returns the largest slip while the vehicle speeds up, m/s, and how much later than friction and ramp demand the vehicle reaches
/// its speed or stops, s.
fn on_ice(mu: f64, told_m_s: f64, seed: u64) -> [f64; 2] {
    let outcome = drive(&scenario(
        30.0,
        seed,
        &format!("terrain.friction = {{ left = {mu:?}, right = {mu:?} }}"),
        &format!(
            "{{ at_s = 4.0, action = 'drive', speed_m_s = {told_m_s:?} }},
             {{ at_s = {STOPS_S:?}, action = 'drive' }}"
        ),
    ));
    let rows = &outcome.trace.rows;
    let story = format!("mu {mu}, {told_m_s} m/s, seed {seed}");
    let slip_m_s = |row: &TraceRow| {
        row.truth
            .slip_m_s
            .iter()
            .fold(0.0_f64, |most, slip| most.max(slip.abs()))
    };
    let speeds_up: Vec<&TraceRow> = rows.iter().take_while(|row| row.time_s() < STOPS_S).collect();
    for row in &speeds_up {
        let allowed_m_s = SLIP_M_S + DRIFT_M_S2 * (row.time_s() - 4.0).max(0.0);
        assert!(
            slip_m_s(row) < allowed_m_s,
            "{story}: {} m/s at {} s",
            slip_m_s(row),
            row.time_s()
        );
    }
    // The status reports a slide that lasts for a second.
    for rows in speeds_up.windows(100) {
        let slides = rows.iter().all(|row| slip_m_s(row) > 0.1);
        let told = rows.iter().any(|row| row.status.limits.contains(Limit::Slip));
        assert!(!slides || told, "{story}: not reported at {} s", rows[0].time_s());
    }
    let largest_m_s = speeds_up.iter().map(|row| slip_m_s(row)).fold(0.0, f64::max);
    // The reference vehicle's ramp is 2 m/s^2; the smoothing of the ramp takes some tenths of a second more.
    let force_m_s2 = f64::min(9.81 * mu, 2.0);
    let reached = |from_s: f64, there: &dyn Fn(f64) -> bool| {
        let row = rows
            .iter()
            .find(|row| row.time_s() > from_s && there(row.truth.speed_m_s));
        row.map_or(f64::INFINITY, |row| row.time_s() - from_s)
    };
    let up_s = reached(4.0, &|speed_m_s| speed_m_s > 0.95 * told_m_s);
    let down_s = reached(STOPS_S, &|speed_m_s| speed_m_s < 0.05 * told_m_s);
    let late_s = up_s.max(down_s) - 0.95 * told_m_s / force_m_s2;
    println!("{story}: slip {largest_m_s:.2} m/s, up in {up_s:.2} s, down in {down_s:.2} s");
    assert!(late_s < 1.0, "{story}: {late_s} s later than friction and ramp take");
    let last = rows.last().expect("rows");
    assert_eq!(
        (last.status.mode, last.status.faults),
        (Mode::Armed, FaultSet::EMPTY),
        "{story}"
    );
    [largest_m_s, late_s]
}

/// A vehicle that meets ice on its way uphill slides back and drives on, again and again, until a stop is commanded. Sliding wheels
/// that look steady for a second slip by at most 0.45 m/s (`STEADY_SLIP_MAX_M_S`). The estimated speed may be wrong by that much
/// once the wheels have rolled for a second, and the place by that speed times the time for which they slid or seemed to slide.
#[test]
fn after_a_slide_on_a_slope_the_speed_is_that_of_the_rolling_wheels_again() {
    const STEADY_SLIP_M_S: f64 = 0.45;
    for (slope_deg, friction, speed_m_s, patch_m, seed) in [
        (15.0_f64, 0.05, 1.0, 58.5, 1),
        (15.0, 0.05, 1.0, 58.5, 2),
        (5.0, 0.03, 0.5, 0.5, 2),
        (8.0, 0.03, 1.0, 2.0, 2),
        (8.0, 0.08, 0.5, 0.5, 2),
        (12.0, 0.03, 0.5, 2.0, 2),
        (12.0, 0.08, 0.5, 2.0, 1),
        (20.0, 0.03, 1.0, 2.0, 2),
        (20.0, 0.08, 1.0, 0.5, 3),
    ] {
        let story = format!("{patch_m} m of {friction} on {slope_deg} deg at {speed_m_s} m/s, seed {seed}");
        let tables = format!(
            "chocked_until_armed = true\nterrain.plane = {{ slope_x_rad = {:?} }}\n\
             terrain.patch = [{{ from_m = 1.5, to_m = {:?}, left = {friction:?}, right = {friction:?} }}]",
            slope_deg.to_radians(),
            1.5 + patch_m
        );
        let steps = format!(
            "{{ at_s = 4.0, action = \"drive\", speed_m_s = {speed_m_s:?} }}, {{ at_s = 15.0, action = \"drive\" }}"
        );
        let outcome = drive(&scenario(22.0, seed, &tables, &steps));
        let (mut rolled_s, mut slid_s, mut worst_m_s) = (0.0, 0.0, 0.0_f64);
        for pair in outcome.trace.rows.windows(2) {
            let (row, dt_s) = (&pair[1], pair[1].time_s() - pair[0].time_s());
            let truly = row.truth.slip_m_s.iter().any(|slip| slip.abs() > 0.02);
            let told = row.status.limits.contains(Limit::Slip);
            rolled_s = if truly { 0.0 } else { rolled_s + dt_s };
            slid_s += if truly || told { dt_s } else { 0.0 };
            if rolled_s > 1.0 {
                let wrong_m_s = f64::from(row.status.estimate.speed_m_s) - row.truth.speed_m_s;
                worst_m_s = worst_m_s.max(wrong_m_s.abs());
            }
        }
        let last = outcome.trace.rows.last().expect("rows");
        let astray_m = (f64::from(last.status.estimate.x_m) - last.truth.x_m).abs();
        println!("{story}: {worst_m_s:.2} m/s wrong, {astray_m:.2} m after {slid_s:.1} s");
        assert!(worst_m_s < STEADY_SLIP_M_S, "{story}: {worst_m_s} m/s");
        assert!(
            astray_m < STEADY_SLIP_M_S * slid_s,
            "{story}: {astray_m} m after {slid_s} s"
        );
        assert_eq!(
            (last.status.mode, last.status.faults),
            (Mode::Armed, FaultSet::EMPTY),
            "{story}"
        );
    }
}
