//! Turns at speed: within the grip that the vehicle file states they do not slide; and slides that are no fault of a sensor.

use model::supervise::arming::Mode;
use model::supervise::codes::{FaultSet, Limit};
use model::vehicle::Vehicle;
use rayon::prelude::*;
use virtual_board::scenario::trace::TraceRow;

mod support;
use support::flights::last;
use support::generated::shown;
use support::reference;
use support::slopes::{drive, from, most, small};

/// Slip, m/s, from which a wheel slides.
const SLIDES_M_S: f64 = 0.1;
/// When the vehicle is told to turn, and to stop, s.
const TURNS_S: f64 = 6.0;
const STOPS_S: f64 = 16.0;

fn slips_m_s(row: &TraceRow) -> f64 {
    row.truth
        .slip_m_s
        .iter()
        .fold(0.0_f64, |most, slip| most.max(slip.abs()))
}

/// A drive on a plane of `slope_deg` and grip `mu`, told to turn at speed and then to stop; what follows `TURNS_S`.
fn turning(
    vehicle: &Vehicle<f64>,
    slope_deg: f64,
    mu: f64,
    (speed_m_s, yaw_rad_s): (f64, f64),
    seed: u64,
) -> Vec<TraceRow> {
    let outcome = drive(
        vehicle,
        STOPS_S + 5.0,
        slope_deg,
        &format!("seed = {seed}\nterrain.friction = {{ left = {mu:?}, right = {mu:?} }}"),
        &format!(
            "{{ at_s = {TURNS_S:?}, action = 'drive', speed_m_s = {speed_m_s:?}, yaw_rate_rad_s = {yaw_rad_s:?} }},
             {{ at_s = {STOPS_S:?}, action = 'drive' }}"
        ),
    );
    let status = last(&outcome).status;
    let story = format!("{slope_deg} deg, mu {mu}, {speed_m_s} m/s, {yaw_rad_s} rad/s, seed {seed}");
    assert_eq!((status.mode, status.faults), (Mode::Armed, FaultSet::EMPTY), "{story}");
    let rests_m_s = last(&outcome).truth.speed_m_s.abs();
    assert!(rests_m_s < 0.05, "{story}: a stop in a turn ends at {rests_m_s} m/s");
    from(&outcome, TURNS_S).to_vec()
}

/// The yaw rate that nine tenths of `mu` hold at every heading of a plane, rad/s: across the heading the slope adds all of itself.
fn held_rad_s(slope_deg: f64, mu: f64, speed_m_s: f64) -> f64 {
    let (sin, cos) = slope_deg.to_radians().sin_cos();
    9.81 * (0.9 * mu * cos - sin).max(0.02) / speed_m_s.abs()
}

/// With the grip of their files, both vehicles turn as fast as told where nine tenths of it hold that, and else as fast as these
/// hold, which is told; the speed is the one told, nothing slides, and a stop comes to rest.
#[test]
fn turns_on_slopes_are_held_by_the_grip_of_the_file() {
    let mut drives = Vec::new();
    for slope_deg in [0.0, 8.0, 12.0, 15.0, 18.0, 20.0] {
        for told in [(2.5, 2.0), (2.5, -1.5), (-2.5, 2.0), (1.8, 2.0)] {
            drives.push((reference(), slope_deg, told, 1));
        }
        drives.push((reference(), slope_deg, (2.5, 2.0), 2));
        drives.push((small(), slope_deg, (1.2, 2.0), 1));
        drives.push((small(), slope_deg, (-1.2, -2.0), 2));
    }
    let shares: Vec<f64> = drives
        .into_par_iter()
        .map(|(vehicle, slope_deg, told, seed)| {
            let mu = vehicle.parameters().control.grip_mu;
            let rows = turning(&vehicle, slope_deg, mu, told, seed);
            let story = format!("{slope_deg} deg, {told:?}, seed {seed}");
            let slip_m_s = most(&rows, slips_m_s);
            assert!(slip_m_s < SLIDES_M_S, "{story}: slip {slip_m_s} m/s");
            assert!(
                rows.iter().all(|row| !row.status.limits.contains(Limit::Slip)),
                "{story}"
            );
            // The turn at its speed, from five seconds after it was told on.
            let steady: Vec<&TraceRow> = rows
                .iter()
                .filter(|row| row.time_s() > TURNS_S + 5.0 && row.time_s() < STOPS_S)
                .collect();
            let mean = |value: &dyn Fn(&TraceRow) -> f64| {
                steady.iter().map(|row| value(row)).sum::<f64>() / steady.len() as f64
            };
            let (speed_m_s, yaw_rad_s) = (mean(&|row| row.truth.speed_m_s), mean(&|row| row.truth.yaw_rate_rad_s));
            assert!((speed_m_s - told.0).abs() < 0.03, "{story}: {speed_m_s} m/s");
            let held = held_rad_s(slope_deg, mu, told.0);
            let wanted = held.min(told.1.abs());
            // What the slope's estimate and the speed's waves leave.
            assert!(
                (yaw_rad_s.abs() / wanted - 1.0).abs() < 0.06,
                "{story}: {yaw_rad_s} of {wanted} rad/s"
            );
            assert!(yaw_rad_s * told.1 > 0.0, "{story}");
            let told_of = steady
                .iter()
                .filter(|row| row.status.limits.contains(Limit::Reference))
                .count();
            assert!(
                told_of == steady.len() || held > 0.97 * told.1.abs(),
                "{story}: told in {told_of} of {}",
                steady.len()
            );
            wanted / told.1.abs()
        })
        .collect();
    let bounded = shares.iter().filter(|share| **share < 1.0).count();
    shown(
        "turns at up to 2.5 m/s and 2 rad/s on slopes of up to 20 deg",
        &format!(
            "none of {} slides; in {bounded} the yaw rate yields, which is told (*Reference*), the speed never",
            shares.len()
        ),
    );
}

/// Straight on, ice that a slope begins on, or half a metre of it: wheels slide back and are caught, turned by the ground. That is
/// no mirrored IMU.
#[test]
fn wheels_that_grip_again_do_not_make_a_sound_imu_implausible() {
    let drives: Vec<_> = [
        (18.0, 0.15, 60.0, 0.7),
        (18.0, 0.15, 60.0, 1.2),
        (12.0, 0.08, 1.0, 0.8),
        (5.0, 0.03, 0.5, 0.5),
    ]
    .into_par_iter()
    .flat_map(|ice| (1..=6).into_par_iter().map(move |seed| (ice, seed)))
    .collect();
    drives
        .into_par_iter()
        .for_each(|((slope_deg, mu, length_m, speed_m_s), seed)| {
            let tables = format!(
                "seed = {seed}\nterrain.patch = [{{ from_m = 1.5, to_m = {:?}, left = {mu:?}, right = {mu:?} }}]",
                1.5 + length_m
            );
            let steps = format!(
                "{{ at_s = 4.0, action = 'drive', speed_m_s = {speed_m_s:?} }}, {{ at_s = 15.0, action = 'drive' }}"
            );
            let outcome = drive(&reference(), 22.0, slope_deg, &tables, &steps);
            let status = last(&outcome).status;
            let story = format!("{slope_deg} deg, mu {mu}, {speed_m_s} m/s, seed {seed}");
            assert_eq!((status.mode, status.faults), (Mode::Armed, FaultSet::EMPTY), "{story}");
        });
}
