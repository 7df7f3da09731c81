//! Turns at speed, which do not slide within the grip that the vehicle file states; and slides, which are no fault of a sensor.

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

/// Slip from which a wheel counts as sliding, m/s.
const SLIDES_M_S: f64 = 0.1;
/// When the operator commands the turn, and the stop, s.
const TURNS_S: f64 = 6.0;
const STOPS_S: f64 = 16.0;

fn slips_m_s(row: &TraceRow) -> f64 {
    row.truth
        .slip_m_s
        .iter()
        .fold(0.0_f64, |most, slip| most.max(slip.abs()))
}

/// A drive on a plane of `slope_deg` and grip `mu` with a turn at speed and then a stop; returns the rows from `TURNS_S` on.
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

/// The yaw rate that nine tenths of `mu` hold at every heading on a plane, rad/s: across the slope, the slope takes its full share
/// of the grip.
fn held_rad_s(slope_deg: f64, mu: f64, speed_m_s: f64) -> f64 {
    let (sin, cos) = slope_deg.to_radians().sin_cos();
    9.81 * (0.9 * mu * cos - sin).max(0.02) / speed_m_s.abs()
}

/// With the grip of its file, each vehicle turns as fast as commanded where nine tenths of the grip hold the turn; elsewhere it turns
/// as fast as they hold and reports the limit. The vehicle keeps the commanded speed, nothing slides, and a stop ends at rest.
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
            // The steady turn, from five seconds after its command on.
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
            // Errors of the estimated slope and waves of the speed remain.
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
                "{story}: reported in {told_of} of {}",
                steady.len()
            );
            wanted / told.1.abs()
        })
        .collect();
    let bounded = shares.iter().filter(|share| **share < 1.0).count();
    shown(
        "turns at up to 2.5 m/s and 2 rad/s on slopes of up to 20 deg",
        &format!(
            "none of {} slides; in {bounded} the yaw rate yields, which the status reports (*Reference*); the speed never yields",
            shares.len()
        ),
    );
}

/// Straight drives onto ice on a slope, long or half a metre: the wheels slide back and grip again, turned by the ground. That does
/// not look like a mirrored IMU.
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

/// Slip along or across the wheels that the law allows while it knows of a slide, m/s. The status must report wheels that slip more.
const ALLOWED_SLIP_M_S: f64 = 0.3;

/// Slip along the wheels or across them, m/s.
fn slides_m_s(row: &TraceRow) -> f64 {
    slips_m_s(row).max(row.truth.side_speed_m_s.abs())
}

/// Turns for which level ice gives too little grip, and stops in these turns: the status reports the slide within half a second, no
/// sensor is blamed, the estimates follow the vehicle and not its wheels, and the vehicle comes to rest.
#[test]
fn slides_in_turns_on_ice_are_told_and_followed() {
    let mut drives = Vec::new();
    for told in [(1.0, 2.0), (1.0, -1.5), (2.5, 1.0), (2.5, -2.0)] {
        for mu in [0.06, 0.09, 0.12] {
            for stops_s in [8.0, 11.0] {
                drives.push((reference(), mu, told, stops_s));
            }
        }
    }
    for told in [(0.8, 2.0), (1.2, -1.5)] {
        for mu in [0.06, 0.09, 0.12] {
            drives.push((small(), mu, told, 10.0));
        }
    }
    let seeds = 1_u64..;
    let drives: Vec<_> = drives.into_iter().zip(seeds).collect();
    let worst: Vec<[f64; 3]> = drives
        .into_par_iter()
        .map(|((vehicle, mu, told, stops_s), seed)| sliding(&vehicle, mu, told, stops_s, seed))
        .collect();
    let [untold_s, heading_deg, tilt_deg] =
        [0, 1, 2].map(|which| worst.iter().map(|found| found[which]).fold(0.0, f64::max));
    shown(
        "turns and stops on level ice of friction 0.06 to 0.12, both vehicles",
        &format!(
            "no slide of more than 0.3 m/s goes unreported for longer than {untold_s:.2} s, heading {heading_deg:.1} deg and arm {tilt_deg:.1} deg off at most; no fault; at rest"
        ),
    );
}

/// Returns the longest time for which a slide stays unreported, s, and the largest errors of heading and arm, deg.
fn sliding(vehicle: &Vehicle<f64>, mu: f64, (speed_m_s, yaw_rad_s): (f64, f64), stops_s: f64, seed: u64) -> [f64; 3] {
    // The time that friction takes to stop the vehicle, and 5 s for the rest.
    let rests_s = stops_s + speed_m_s / (9.81 * mu) + 5.0;
    let outcome = drive(
        vehicle,
        rests_s + 1.0,
        0.0,
        &format!("seed = {seed}\nterrain.friction = {{ left = {mu:?}, right = {mu:?} }}"),
        &format!(
            "{{ at_s = 4.0, action = 'drive', speed_m_s = {speed_m_s:?}, yaw_rate_rad_s = {yaw_rad_s:?} }},
             {{ at_s = {stops_s:?}, action = 'drive' }}"
        ),
    );
    let story = format!("mu {mu}, {speed_m_s} m/s, {yaw_rad_s} rad/s, stop at {stops_s} s, seed {seed}");
    let status = last(&outcome).status;
    assert_eq!((status.mode, status.faults), (Mode::Armed, FaultSet::EMPTY), "{story}");
    let rows = from(&outcome, 4.0);
    assert!(
        most(rows, slides_m_s) > SLIDES_M_S,
        "{story}: the wheels do not slide in this turn"
    );
    let (mut untold_s, mut longest_s) = (0.0, 0.0_f64);
    for pair in rows.windows(2) {
        let untold = slides_m_s(&pair[1]) > ALLOWED_SLIP_M_S && !pair[1].status.limits.contains(Limit::Slip);
        untold_s = if untold {
            untold_s + pair[1].time_s() - pair[0].time_s()
        } else {
            0.0
        };
        longest_s = longest_s.max(untold_s);
    }
    assert!(longest_s < 0.5, "{story}: unreported for {longest_s} s");
    let off_deg = |value: &dyn Fn(&TraceRow) -> f64| most(rows, |row| value(row).abs().to_degrees());
    let heading_deg = off_deg(&|row| row.truth.heading_rad - f64::from(row.status.estimate.heading_rad));
    let tilt_deg = off_deg(&|row| row.truth.phi_rad - f64::from(row.status.estimate.phi_rad));
    assert!(heading_deg < 2.0, "{story}: heading {heading_deg} deg off");
    assert!(tilt_deg < 2.0, "{story}: arm {tilt_deg} deg off");
    let rests = from(&outcome, rests_s);
    let (speed_m_s, aside_m_s) = (
        most(rests, |row| row.truth.speed_m_s.abs()),
        most(rests, |row| row.truth.side_speed_m_s.abs()),
    );
    assert!(
        speed_m_s < 0.05 && aside_m_s < 0.05,
        "{story}: goes on at {speed_m_s} m/s, {aside_m_s} m/s aside"
    );
    [longest_s, heading_deg, tilt_deg]
}

/// Wheels whose radii differ by up to a tenth, an IMU that is mounted 2 deg askew about any axis, worn gears, and slopes: in turns and
/// reversals nothing slides, and the status reports no slide.
#[test]
fn turns_of_wheels_that_roll_are_no_slide() {
    let mut plants = Vec::new();
    for share in [0.005, 0.02, 0.05, 0.1, -0.1] {
        let [left, right] = [1.0 + 0.5 * share, 1.0 - 0.5 * share];
        plants.push((
            0.0,
            format!("plant.left.wheel_radius_factor = {left:?}\nplant.right.wheel_radius_factor = {right:?}"),
        ));
    }
    for axis in ["x", "y", "z"] {
        plants.push((0.0, format!("plant.arm_imu.misalignment_{axis}_deg = -2.0")));
    }
    plants.push((
        0.0,
        "plant.left.backlash_deg = 1.0\nplant.right.backlash_deg = 1.0".to_owned(),
    ));
    plants.push((10.0, String::new()));
    plants.push((0.0, "terrain.plane.slope_y_rad = 0.15".to_owned()));
    let drives: Vec<_> = plants
        .into_iter()
        .flat_map(|plant| [(2.5, 2.0), (1.0, 2.0), (1.0, 1.0), (2.5, 0.0)].map(|told| (plant.clone(), told)))
        .flat_map(|drive| [(reference(), drive.clone()), (small(), drive)])
        .zip(1_u64..)
        .collect();
    drives
        .into_par_iter()
        .for_each(|((vehicle, ((slope_deg, plant), (speed_m_s, yaw_rad_s))), seed)| {
            let speed_m_s = f64::min(speed_m_s, vehicle.parameters().control.speed_max_m_s);
            let outcome = drive(
                &vehicle,
                18.0,
                slope_deg,
                &format!("seed = {seed}\n{plant}"),
                &format!(
                    "{{ at_s = 4.0, action = 'drive', speed_m_s = {speed_m_s:?}, yaw_rate_rad_s = {yaw_rad_s:?} }},
                     {{ at_s = 8.0, action = 'drive', speed_m_s = -{speed_m_s:?}, yaw_rate_rad_s = -{yaw_rad_s:?} }},
                     {{ at_s = 13.0, action = 'drive' }}"
                ),
            );
            let story = format!("{slope_deg} deg, {plant}, {speed_m_s} m/s, {yaw_rad_s} rad/s, seed {seed}");
            let slip_m_s = most(from(&outcome, 4.0), slips_m_s);
            assert!(slip_m_s < SLIDES_M_S, "{story}: a wheel slides, {slip_m_s} m/s");
            let told = from(&outcome, 4.0)
                .iter()
                .find(|row| row.status.limits.contains(Limit::Slip));
            assert!(
                told.is_none(),
                "{story}: a slide reported at {} s",
                told.map_or(0.0, TraceRow::time_s)
            );
            let status = last(&outcome).status;
            assert_eq!((status.mode, status.faults), (Mode::Armed, FaultSet::EMPTY), "{story}");
            let rests_m_s = last(&outcome).truth.speed_m_s.abs();
            assert!(rests_m_s < 0.05, "{story}: goes on at {rests_m_s} m/s");
        });
}

/// The track, or a wheel's radius, is up to a tenth other than the file's: turns on the spot and at speed, on the level and on a
/// slope, are no slide; the vehicle stays where it turns, and it stops when told.
#[test]
fn a_track_other_than_the_files_is_no_slide() {
    let mut drives: Vec<(&str, f64, f64, f64, f64, u64)> = Vec::new();
    for (field, file) in [("half_track_m", 0.25), ("wheel_radius_m", 0.25)] {
        for factor in [0.9, 0.94, 1.06, 1.1] {
            for (slope_deg, speed_m_s, yaw_rad_s, seed) in [
                (0.0, 0.0, 2.0, 1),
                (15.0, 0.0, -2.0, 2),
                (8.0, 0.0, 1.0, 3),
                (0.0, 0.8, 1.5, 1),
                (10.0, -0.8, 1.5, 2),
            ] {
                drives.push((field, factor * file, slope_deg, speed_m_s, yaw_rad_s, seed));
            }
        }
    }
    drives
        .into_par_iter()
        .for_each(|(field, value, slope_deg, speed_m_s, yaw_rad_s, seed)| {
            let outcome = drive(
                &reference(),
                STOPS_S + 14.0,
                slope_deg,
                &format!("seed = {seed}\nplant.vehicle.body.{field} = {value:?}"),
                &format!(
                "{{ at_s = {TURNS_S:?}, action = 'drive', speed_m_s = {speed_m_s:?}, yaw_rate_rad_s = {yaw_rad_s:?} }},
                 {{ at_s = {:?}, action = 'drive' }}",
                STOPS_S + 10.0
            ),
            );
            let end = last(&outcome);
            let story = format!("{field} = {value}, {slope_deg} deg, {speed_m_s} m/s, {yaw_rad_s} rad/s, seed {seed}");
            assert_eq!(
                (end.status.mode, end.status.faults),
                (Mode::Armed, FaultSet::EMPTY),
                "{story}"
            );
            let turn = from(&outcome, TURNS_S);
            assert!(
                turn.iter().all(|row| !row.status.estimate.sliding),
                "{story}: told as a slide"
            );
            assert!(
                end.truth.speed_m_s.abs() < 0.02,
                "{story}: ends at {} m/s",
                end.truth.speed_m_s
            );
            if speed_m_s == 0.0 {
                // On the level five centimetres per turn; on a slope, which turns under the vehicle, less than a wheel's radius.
                let most_m = if slope_deg == 0.0 { 0.05 } else { 0.25 };
                let creeps_m = f64::hypot(end.truth.x_m - turn[0].truth.x_m, end.truth.y_m - turn[0].truth.y_m);
                let turns = 20.0 * yaw_rad_s.abs() / (2.0 * std::f64::consts::PI);
                assert!(creeps_m < most_m * turns, "{story}: creeps {creeps_m} m");
            }
        });
}
