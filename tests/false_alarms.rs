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

/// What fails in these drives, in a vehicle that stands on a slope or drives.
fn flown(vehicle: &Vehicle<f64>, slope_deg: f64, speed_m_s: f64, seed: u64, event: &str) -> (DriveOutcome, String) {
    let outcome = fly(
        vehicle,
        seed,
        slope_deg,
        speed_m_s,
        &format!("{{ at_s = 8.0, {event} }}"),
    );
    let story = format!(
        "{event} at {speed_m_s} m/s on {slope_deg} deg, seed {seed}: {:?}",
        outcome.log
    );
    (outcome, story)
}

/// A current sensor dies, or goes on showing its last value, while the current is large: on a slope. Its motor still has
/// its torque, so nothing else is wrong; the vehicle comes to a controlled stop.
#[test]
fn a_current_sensor_that_fails_on_a_slope_is_no_open_lead_and_no_encoder() {
    for vehicle in [reference(), small()] {
        for slope_deg in [7.0, -10.0, 16.0, 24.0] {
            for (speed_m_s, seed) in [(0.0, 1), (0.0, 11), (0.4, 21)] {
                for reads in ["dead", "stuck"] {
                    let event = format!("action = 'analog-fault', sensor = 'left-current', reads = '{reads}'");
                    let (outcome, story) = flown(&vehicle, slope_deg, speed_m_s, seed, &event);
                    let stops_s = first(&outcome, 8.0, |row| row.status.mode == Mode::Stopping);
                    assert!(stops_s.is_some_and(|s| s < 1.0), "{stops_s:?} s, {story}");
                    assert_eq!(faults(&outcome), only(&[Fault::CurrentSensor]), "{story}");
                }
            }
        }
    }
}

/// A sensor that shows the current backward at hold, while the encoder agrees with the other wheel and the gyro.
#[test]
fn a_current_that_is_measured_backward_on_a_slope_is_no_encoder() {
    for vehicle in [reference(), small()] {
        for (slope_deg, seed) in [(10.0, 1), (-12.0, 2), (20.0, 3)] {
            let event = "action = 'analog-fault', sensor = 'right-current', gain = -1.0";
            let (outcome, story) = flown(&vehicle, slope_deg, 0.0, seed, event);
            let stops_s = first(&outcome, 8.0, |row| row.status.mode == Mode::Stopping);
            assert!(stops_s.is_some_and(|s| s < 1.0), "{stops_s:?} s, {story}");
            assert_eq!(faults(&outcome), only(&[Fault::CurrentSensor]), "{story}");
        }
    }
}

/// A lead that opens takes the motor's torque, which the wheel shows, or the other motor.
#[test]
fn a_lead_that_opens_on_a_slope_is_an_open_lead() {
    for (vehicle, drives) in [
        (
            reference(),
            [(20.0, 0.0), (24.0, 0.0), (-24.0, 0.0), (-7.0, 1.0), (7.0, 0.6)],
        ),
        (
            small(),
            [(16.0, 0.0), (20.0, 0.0), (24.0, 0.0), (-7.0, 1.0), (7.0, 0.6)],
        ),
    ] {
        for (slope_deg, speed_m_s) in drives {
            for seed in [1, 11] {
                let event = "action = 'motor-leads', motor = 'right', leads = 'open'";
                let (outcome, story) = flown(&vehicle, slope_deg, speed_m_s, seed, event);
                let opens_s = first(&outcome, 8.0, |row| row.status.mode == Mode::Disarmed);
                assert!(opens_s.is_some_and(|s| s < 0.4), "{opens_s:?} s, {story}");
                assert_eq!(faults(&outcome), only(&[Fault::RightMotorOpen]), "{story}");
            }
        }
    }
}

/// A reversed encoder makes any current too small for the rate that it shows.
#[test]
fn a_reversed_encoder_is_no_open_lead() {
    for (slope_deg, speed_m_s, seed) in [(0.0, 1.2, 1), (0.0, -1.2, 2), (7.0, -0.6, 3), (7.0, -1.2, 4)] {
        let event = "action = 'sensor-fault', sensor = 'left-encoder', fault = 'wrong-sign'";
        let (outcome, story) = flown(&small(), slope_deg, speed_m_s, seed, event);
        let opens_s = first(&outcome, 8.0, |row| row.status.mode == Mode::Disarmed);
        assert!(opens_s.is_some_and(|s| s < 0.6), "{opens_s:?} s, {story}");
        assert_eq!(faults(&outcome), only(&[Fault::EncoderImplausible]), "{story}");
    }
}

/// An IMU's noise makes the law's voltage alternate, which turns no motor.
#[test]
fn the_garbage_of_an_imu_is_no_silent_encoder() {
    for seed in [3, 7] {
        for slope_deg in [0.0, 7.0, 10.0] {
            let event = "action = 'sensor-fault', sensor = 'arm-imu', fault = 'garbage'";
            let (outcome, story) = flown(&small(), slope_deg, 0.0, seed, event);
            assert_eq!(faults(&outcome), only(&[Fault::ImuImplausible]), "{story}");
        }
    }
}

/// Gyros that vibrate make the laws' voltages alternate, which turns no motor.
#[test]
fn gyros_that_vibrate_are_no_silent_encoder() {
    for frequency_hz in [50.0, 150.0, 300.0, 450.0] {
        for (speed_m_s, seed) in [(0.0, 1), (1.0, 2)] {
            let steps = format!(
                "{{ at_s = 4.0, action = 'drive', speed_m_s = {speed_m_s:?} }}, {{ at_s = 6.0, action = 'vibration', \
                 amplitude_rad_s = 0.2, frequency_hz = {frequency_hz:?} }}"
            );
            let outcome = drive(&reference(), 18.0, 0.0, &format!("seed = {seed}"), &steps);
            let story = format!("{frequency_hz} Hz at {speed_m_s} m/s: {:?}", outcome.log);
            assert_eq!(last(&outcome).status.faults, FaultSet::EMPTY, "{story}");
        }
    }
}

/// Nothing but its encoder shows how the ballast turns, and a ballast without torque turns slowly.
#[test]
fn an_open_lead_of_the_ballast_motor_is_no_wrong_encoder() {
    for (speed_m_s, seed) in [(1.0, 1), (1.0, 2), (-1.0, 3), (2.0, 4)] {
        let back = -speed_m_s;
        let event = format!(
            "{{ at_s = 8.0, action = 'motor-leads', motor = 'ballast', leads = 'open' }}, \
             {{ at_s = 10.0, action = 'drive', speed_m_s = {back:?} }}"
        );
        let outcome = fly(&reference(), seed, 0.0, speed_m_s, &event);
        let found = faults(&outcome);
        let story = format!("{speed_m_s} m/s, seed {seed}: {:?}", outcome.log);
        assert!(found.contains(Fault::BallastMotorOpen), "{story}");
        assert!(!found.contains(Fault::BallastEncoder), "{story}");
        assert_eq!(last(&outcome).status.mode, Mode::Armed, "{story}");
    }
}
