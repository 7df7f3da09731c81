//! Events after which a sound vehicle must not report a fault of something else.

use model::supervise::arming::Mode;
use model::supervise::codes::{Fault, FaultSet};
use model::vehicle::Vehicle;
use virtual_board::scenario::DriveOutcome;

mod support;
use support::flights::{first, last, only};
use support::reference;
use support::slopes::{drive, from, most, small};

/// A drive at `speed_m_s` from 4 s on, with `event` at 8 s.
fn fly(vehicle: &Vehicle<f64>, seed: u64, slope_deg: f64, speed_m_s: f64, event: &str) -> DriveOutcome {
    let steps = format!("{{ at_s = 4.0, action = 'drive', speed_m_s = {speed_m_s:?} }}, {event}");
    drive(vehicle, 14.0, slope_deg, &format!("seed = {seed}"), &steps)
}

/// The faults of the whole drive but StopTimeout: the fault under test begins the stop, but slope and speed decide how long the
/// stop takes.
fn faults(outcome: &DriveOutcome) -> FaultSet {
    let mut faults = last(outcome).status.faults;
    faults.set(Fault::StopTimeout, false);
    faults
}

/// A string of cells opens, and the supply falls to about half. The bridges then apply less voltage than the laws asked for, for
/// which no encoder is to blame.
#[test]
fn a_supply_that_falls_below_its_minimum_is_a_low_battery_and_nothing_else() {
    let halves = [
        (reference(), [9.0, 11.0, 13.0], [0.5, 1.0, -1.6]),
        (small(), [4.8, 5.5, 6.5], [0.3, 0.6, -0.8]),
    ];
    for (vehicle, supplies, speeds) in halves {
        for supply_v in supplies {
            for (speed_m_s, seed) in speeds.into_iter().zip([1, 11, 21]) {
                for slope_deg in [0.0, 10.0] {
                    let event = format!("{{ at_s = 8.0, action = 'battery', open_circuit_v = {supply_v:?} }}");
                    let outcome = fly(&vehicle, seed, slope_deg, speed_m_s, &event);
                    let story = format!("{supply_v} V at {speed_m_s} m/s on {slope_deg} deg, seed {seed}");
                    let stops_s = first(&outcome, 8.0, |row| row.status.mode == Mode::Stopping);
                    assert!(stops_s.is_some_and(|s| s < 0.3), "{story}: {:?}", outcome.log);
                    assert_eq!(
                        faults(&outcome),
                        only(&[Fault::BatteryLow]),
                        "{story}: {:?}",
                        outcome.log
                    );
                }
            }
        }
    }
}

/// Somebody pushes a vehicle that stands on the level, seconds after it was armed. The observer mistakes the push for a slope.
#[test]
fn a_push_at_a_vehicle_that_stands_is_no_slope_on_which_it_was_armed() {
    let pushes = [
        (reference(), [15.0, 90.0, 120.0, -150.0]),
        (small(), [5.0, 15.0, 20.0, -25.0]),
    ];
    for (vehicle, pushes_n) in pushes {
        for push_n in pushes_n {
            for (for_s, seed) in [(1.0, 1), (2.0, 11), (3.0, 21)] {
                let event = format!(
                    "{{ at_s = 8.0, action = 'push', on = 'axle', forward_n = {push_n:?}, for_s = {for_s:?} }}"
                );
                let outcome = fly(&vehicle, seed, 0.0, 0.0, &event);
                let story = format!("{push_n} N for {for_s} s, seed {seed}");
                assert!(
                    !faults(&outcome).contains(Fault::SteepSlope),
                    "{story}: {:?}",
                    outcome.log
                );
            }
        }
    }
}

/// An offset of 15 to 20 mg along the axle, which the accelerometer's data sheet allows, looks like a roll of the plane but turns
/// with the vehicle. The status reports no slide, and a vehicle that is commanded to stand stands.
#[test]
fn an_offset_of_the_accelerometer_along_the_axle_is_no_slide() {
    for vehicle in [reference(), small()] {
        for bias_m_s2 in [-0.2, -0.15, 0.17, 0.2] {
            for (yaw_rate_rad_s, seed) in [(1.0, 1), (-0.45, 11)] {
                let tables = format!("seed = {seed}\nplant.arm_imu.accel_bias_y_m_s2 = {bias_m_s2:?}");
                let steps = format!(
                    "{{ at_s = 4.0, action = 'drive', speed_m_s = 0.8, yaw_rate_rad_s = {yaw_rate_rad_s:?} }},
                     {{ at_s = 14.0, action = 'drive' }}"
                );
                let outcome = drive(&vehicle, 20.0, 0.0, &tables, &steps);
                let story = format!("{bias_m_s2} m/s^2, {yaw_rate_rad_s} rad/s, seed {seed}");
                let rows = &outcome.trace.rows;
                let off_m_s = most(rows, |row| {
                    (f64::from(row.status.estimate.speed_m_s) - row.truth.speed_m_s).abs()
                });
                // The status reports a slide when a difference of 0.25 m/s^2 lasts. At rest 0.1 m/s may remain.
                assert!(off_m_s < 0.1, "{story}: {off_m_s} m/s");
                assert!(rows.iter().all(|row| !row.status.estimate.sliding), "{story}");
                assert_eq!(last(&outcome).status.faults, FaultSet::EMPTY, "{story}");
                let end_m_s = most(from(&outcome, 19.0), |row| row.truth.speed_m_s.abs());
                assert!(end_m_s < 0.05, "{story}: {end_m_s} m/s");
            }
        }
    }
}
