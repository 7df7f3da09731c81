//! A forced whirl: the vehicle reports it, comes to rest, and drives on.

use model::supervise::arming::Mode;
use model::supervise::codes::{Fault, FaultSet};
use virtual_board::scenario::trace::TraceRow;

mod support;
use support::flights::{first, fly, last};
use support::generated::shown;
use support::slopes::{from, most};

/// When the push comes, and within which time after it the vehicle must be at rest again, s.
const PUSHED_S: f64 = 6.0;
const REST_WITHIN_S: f64 = 14.0;

/// Pushes of the axle during which no law can keep the arm down: 150 N for a second make the vehicle faster than its motors can
/// turn. Forward and backward, at rest and at speed, off a patch of ice and over a kerb of 50 mm, the arm turns over or nearly does.
/// The status reports ArmAngle within half a second of the push's end, the bridges open, and friction alone brings the vehicle to
/// rest. From the hardest pushes the arm comes back, but the vehicle is then twice as fast as its motors can turn: their back-EMF
/// drives the current, and the status reports Overcurrent. There it knows its arm's angle; once the faults are cleared, the vehicle arms and drives as commanded.
#[test]
fn a_forced_whirl_is_told_and_ends_at_rest_from_which_the_vehicle_drives_on() {
    let [mut whirled, mut turned_over] = [0; 2];
    let [mut latest_told_s, mut latest_rest_s] = [0.0_f64; 2];
    let ice = "terrain.patch = [{ from_m = -2.0, to_m = 4.0, left = 0.1, right = 0.1 }]";
    let kerb = "terrain.profile = [{ kind = 'step', at_m = 4.0, height_m = 0.05 }]";
    for (push_n, for_s, speed_m_s, ground) in [
        (150.0, 1.0, 0.0, ""),
        (-200.0, 1.0, 0.0, ""),
        (400.0, 0.5, 0.0, ""),
        (300.0, 0.6, -1.5, ""),
        (250.0, 0.6, 1.0, ice),
        (200.0, 0.6, 1.0, kerb),
    ] {
        let steps = format!(
            "{{ at_s = 4.0, action = 'drive', speed_m_s = {speed_m_s:?} }},
             {{ at_s = {PUSHED_S:?}, action = 'push', on = 'axle', forward_n = {push_n:?}, for_s = {for_s:?} }},
             {{ at_s = {:?}, action = 'drive' }}, {{ at_s = 22.0, action = 'clear-faults' }},
             {{ at_s = 23.0, action = 'arm' }}, {{ at_s = 25.0, action = 'drive', speed_m_s = 0.5 }}",
            PUSHED_S + 2.0
        );
        let outcome = fly(31.0, 1, ground, &steps);
        let story = format!("{push_n} N for {for_s} s at {speed_m_s} m/s, ground {ground:?}");
        let arm_rad = most(&outcome.trace.rows, |row| row.truth.phi_rad.abs());
        let whirls = |row: &TraceRow| row.status.faults.contains(Fault::ArmAngle);
        let fault = |row: &TraceRow| whirls(row) || row.status.faults.contains(Fault::Overcurrent);
        let told_s = first(&outcome, PUSHED_S, fault);
        let rests = |row: &TraceRow| row.status.estimate.at_rest && row.truth.speed_m_s.abs() < 0.05;
        let rests_s = first(&outcome, PUSHED_S + 2.0, rests).map(|late_s| late_s + 2.0);
        let faults = outcome.trace.rows[outcome.trace.rows.partition_point(|row| row.time_s() < 21.0)]
            .status
            .faults;
        println!("{story}: {faults}, arm {arm_rad:.1} rad, told after {told_s:?} s, at rest after {rests_s:?} s");
        assert!(arm_rad > 1.4, "{story}: {arm_rad} rad");
        assert!(told_s.expect("told") < for_s + 0.5, "{story}: {told_s:?} s");
        assert!(
            rests_s.expect("comes to rest") < REST_WITHIN_S,
            "{story}: {rests_s:?} s"
        );
        latest_told_s = latest_told_s.max(told_s.unwrap_or(f64::INFINITY));
        latest_rest_s = latest_rest_s.max(rests_s.unwrap_or(f64::INFINITY));
        whirled += u32::from(arm_rad > core::f64::consts::PI);
        turned_over += u32::from(first(&outcome, PUSHED_S, whirls).is_some());

        let before = &from(&outcome, 21.5)[0];
        let turns = core::f64::consts::TAU;
        let off_rad = (f64::from(before.status.estimate.phi_rad) - before.truth.phi_rad + 0.5 * turns)
            .rem_euclid(turns)
            - 0.5 * turns;
        assert!(off_rad.abs() < 0.02, "{story}: the arm's angle is off by {off_rad} rad");
        let end = last(&outcome);
        assert_eq!(
            (end.status.mode, end.status.faults),
            (Mode::Armed, FaultSet::EMPTY),
            "{story}"
        );
        assert!(
            (end.truth.speed_m_s - 0.5).abs() < 0.02,
            "{story}: {} m/s",
            end.truth.speed_m_s
        );
    }
    assert!(whirled >= 4, "the arm turns over in {whirled} drives only");
    assert!(turned_over >= 4, "ArmAngle told in {turned_over} drives only");
    shown(
        "pushed into a whirl",
        &format!(
            "reports ArmAngle (or Overcurrent, where the pushed motors drive the current) within {latest_told_s:.2} s of the start of the push, comes to rest by itself within {latest_rest_s:.1} s, drives on once its faults are cleared"
        ),
    );
}
