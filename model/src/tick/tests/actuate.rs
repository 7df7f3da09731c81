//! Stage 4, and the state that the core carries from tick to tick.

use super::super::Decision;
use super::{Bench, BoardScales, VehicleCore, reference, sensed_at_rest};
use crate::command::Request;
use crate::control::motor::{DUTY_FULL_SCALE, duty};
use crate::estimate::Estimate;
use crate::sample::{Actuation, MOTORS};
use crate::sensed::Sensed;
use crate::status::Terms;
use crate::supervise::arming::Mode;
use crate::supervise::codes::{Blocker, BlockerSet, Fault, FaultSet, Limit, LimitSet};
use crate::vehicle::Vehicle;

fn driving(voltage_v: [f32; MOTORS]) -> Decision {
    Decision {
        mode: Mode::Armed,
        faults: FaultSet::EMPTY,
        blockers: BlockerSet::EMPTY,
        late_ticks: 3,
        refused_arms: 4,
        limits: LimitSet::EMPTY,
        voltage_v,
        ballast_off: false,
        motor_shares: [1.0; MOTORS],
        terms: Terms::default(),
        speed_reference_m_s: 0.5,
        yaw_rate_reference_rad_s: -0.25,
    }
}

fn actuated(sensed: &Sensed, decision: Decision) -> super::super::Output {
    VehicleCore::new(&reference(), &BoardScales::EXAMPLE).actuate(sensed, &Estimate::default(), decision)
}

/// The limits are 5.37 V (17 A through 0.316 ohm) and 23.4 V (4 A through 5.853 ohm) above and below the back-EMF, with
/// 1.295 V s and 1.529 V s per rad.
#[test]
fn each_current_limit_bounds_its_motor_and_raises_its_flag_only() {
    for (motor, limit, limit_v, v_s) in [
        (0, Limit::LeftCurrent, 17.0 * 0.316, 43.0 * 0.030124),
        (1, Limit::RightCurrent, 17.0 * 0.316, 43.0 * 0.030124),
        (2, Limit::BallastCurrent, 4.0 * 5.853, 28.0 * 0.0546),
    ] {
        for rate_rad_s in [0.0, 3.0, -3.0] {
            let mut sensed = sensed_at_rest();
            sensed.supply_v = 27.5;
            sensed.relative_rate_rad_s[motor] = rate_rad_s;
            for (share, bound) in [(0.99_f32, false), (1.01, true), (-0.99, false), (-1.01, true)] {
                // The other motors' voltages are within their limits.
                let mut voltage_v = [0.1; MOTORS];
                voltage_v[motor] = v_s * rate_rad_s + share * limit_v;
                let output = actuated(&sensed, driving(voltage_v));
                let expected = v_s * rate_rad_s + share.clamp(-1.0, 1.0) * limit_v;
                assert!(
                    (output.status.voltage_v[motor] - expected).abs() < 1e-3,
                    "{motor} {share}"
                );
                let mut limits = LimitSet::EMPTY;
                limits.set(limit, bound);
                assert_eq!(output.status.limits, limits, "{motor} {share}");
                assert_eq!(
                    output.actuation.duty,
                    output
                        .status
                        .voltage_v
                        .map(|v| duty(v, 27.5, BoardScales::EXAMPLE.duty_max))
                );
                assert!(output.actuation.enable);
            }
        }
    }
}

/// The current limit lies around the back-EMF. With a wrong rate from the encoder, that limit alone would drive a ballast that
/// is switched off.
#[test]
fn a_ballast_that_is_off_gets_no_voltage_whatever_its_encoder_shows() {
    let mut sensed = sensed_at_rest();
    sensed.relative_rate_rad_s[2] = 40.0;
    let decision = Decision {
        ballast_off: true,
        ..driving([1.0, 1.0, 5.0])
    };
    let output = actuated(&sensed, decision);
    assert_eq!((output.actuation.duty[2], output.status.voltage_v[2]), (0, 0.0));
    assert!(output.actuation.enable && output.actuation.duty[0] > 0);
    assert!(!output.status.limits.contains(Limit::BallastCurrent));
}

#[test]
fn a_stopping_vehicle_is_driven_and_a_disarmed_one_is_not() {
    let sensed = sensed_at_rest();
    for (mode, driven) in [(Mode::Armed, true), (Mode::Stopping, true), (Mode::Disarmed, false)] {
        let output = actuated(
            &sensed,
            Decision {
                mode,
                ..driving([3.0, -3.0, 1.0])
            },
        );
        assert_eq!(output.actuation != Actuation::SAFE, driven, "{mode:?}");
        assert_eq!(output.actuation.enable, driven, "{mode:?}");
        assert_eq!(output.status.mode, mode);
    }
    let duties = actuated(&sensed, driving([3.0, -3.0, 1.0])).actuation.duty;
    let expected = [3.0_f32, -3.0, 1.0].map(|v| v / sensed.supply_v * DUTY_FULL_SCALE);
    for (duty, expected) in duties.into_iter().zip(expected) {
        assert!((f32::from(duty) - expected).abs() <= 0.51, "{duty} for {expected}");
    }
}

#[test]
fn what_is_not_a_number_opens_the_bridges_in_its_tick() {
    for broken in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        for place in 0..=MOTORS {
            let mut bench = Bench::armed();
            let mut sensed = sensed_at_rest();
            let mut decision = driving([1.0; MOTORS]);
            if place == MOTORS {
                sensed.supply_v = broken;
            } else {
                decision.voltage_v[place] = broken;
                // The current limit bounds an infinite voltage, too; a motor without a current limit keeps the infinite voltage.
                if broken.is_infinite() {
                    sensed.relative_rate_rad_s[place] = broken;
                }
            }
            let output = bench.core.actuate(&sensed, &Estimate::default(), decision);
            assert_eq!(output.actuation, Actuation::SAFE, "{broken} at {place}");
            assert_eq!(output.status.mode, Mode::Disarmed);
            assert!(output.status.faults.contains(Fault::NotFinite));
            assert_eq!(bench.core.mode(), Mode::Disarmed);
            assert!(bench.tick().faults.contains(Fault::NotFinite), "latched");
        }
    }
}

#[test]
fn the_status_tells_what_was_decided() {
    let sensed = sensed_at_rest();
    let status = actuated(&sensed, driving([1.0; MOTORS])).status;
    assert_eq!((status.late_ticks, status.refused_arms), (3, 4));
    assert_eq!(
        (status.speed_reference_m_s, status.yaw_rate_reference_rad_s),
        (0.5, -0.25)
    );
    assert_eq!(
        (status.battery_v, status.current_a),
        (sensed.battery_v, sensed.current_a)
    );
    let mut bench = Bench::new();
    for tick in 1..5 {
        let status = bench.tick();
        assert_eq!((status.tick, status.time_us), (tick, 1000 * u64::from(tick)));
    }
}

/// The status shows the laws' references, which approach 1 m/s and 1 rad/s at 2 m/s^2 and 4 rad/s^2.
#[test]
fn the_status_shows_the_references_on_their_way() {
    let mut bench = Bench::armed();
    bench.command.drive.yaw_rate_rad_s = 1.0;
    let status = (0..100).fold(bench.tick(), |_, _| bench.tick());
    assert!(
        (status.yaw_rate_reference_rad_s - 0.4).abs() < 0.01,
        "{}",
        status.yaw_rate_reference_rad_s
    );
    assert!(status.speed_reference_m_s.abs() < 0.01);
    bench.command.drive.yaw_rate_rad_s = 0.0;
    bench.command.drive.speed_m_s = 1.0;
    let status = (0..60).fold(bench.tick(), |_, _| bench.tick());
    assert!(
        status.speed_reference_m_s > 0.005 && status.speed_reference_m_s < 0.2,
        "{}",
        status.speed_reference_m_s
    );
    assert!(status.limits.contains(Limit::Reference));
}

/// Only while the bridges are open does the estimator take it that the ballast hangs down.
#[test]
fn an_armed_vehicle_does_not_take_its_ballast_for_one_that_hangs() {
    for armed in [true, false] {
        let mut bench = Bench::armed();
        if !armed {
            bench.request(Request::Disarm);
        }
        // The ballast's output turns by 0.22 rad, too slowly for the watch over its encoder.
        for _ in 0..100 {
            bench.sample.encoder_counts[2] += 10;
            bench.tick();
        }
        let turned_rad = 1000.0 * 2.0 * core::f32::consts::PI / (1024.0 * 28.0);
        let shown = bench.tick().estimate.ballast_rad;
        let expected = if armed { turned_rad } else { 0.0 };
        assert!((shown - expected).abs() < 1e-3, "{armed}: {shown}");
    }
}

/// A change of parameters while disarmed: what the vehicle has reported stays, and the vehicle calibrates anew.
#[test]
fn another_vehicle_takes_over_what_was_told_of_the_one_before() {
    let mut bench = Bench::armed();
    // One late tick, a latched fault, a refused request, and some distance driven.
    bench.sample.time_us += 1000;
    bench.tick();
    for _ in 0..90 {
        bench.sample.encoder_counts[0] += 80;
        bench.sample.encoder_counts[1] += 100;
        bench.sample.encoder_counts[2] += 1;
        bench.tick();
    }
    bench.sample.emergency_stop = true;
    bench.tick();
    bench.sample.emergency_stop = false;
    let before = bench.request(Request::Arm);
    assert_eq!((before.late_ticks, before.refused_arms), (1, 1));
    assert!(before.faults.contains(Fault::EmergencyStop), "{}", before.faults);
    assert!(before.estimate.distance_m > 0.1 && before.estimate.x_m > 0.1);

    let mut parameters = *reference().parameters();
    parameters.safety.stop_timeout_s = 2.0;
    let vehicle = Vehicle::new(parameters).expect("valid");
    bench.core = bench.core.with_vehicle(&vehicle);
    // The late tick between the two vehicles counts, too.
    bench.sample.time_us += 1000;
    let after = bench.tick();
    assert_eq!(after.tick, before.tick + 1);
    assert_eq!((after.late_ticks, after.refused_arms), (2, 1));
    assert_eq!(after.faults, before.faults);
    assert!(after.blockers.contains(Blocker::NotCalibrated) && after.blockers.contains(Blocker::FaultLatched));
    for (after, before) in [
        (after.estimate.heading_rad, before.estimate.heading_rad),
        (after.estimate.distance_m, before.estimate.distance_m),
        (after.estimate.x_m, before.estimate.x_m),
        (after.estimate.y_m, before.estimate.y_m),
        (after.battery_v, before.battery_v),
    ] {
        assert!((after - before).abs() < 2e-4, "{after} after {before}");
    }
    // The encoders' counts are no jump to the new vehicle, and its parameters are in force.
    for _ in 0..700 {
        bench.tick();
    }
    bench.request(Request::ClearFaults);
    let status = bench.request(Request::Arm);
    assert_eq!(
        (status.mode, status.faults),
        (Mode::Armed, FaultSet::EMPTY),
        "{}",
        status.blockers
    );
    // 1.2 rad/s: too fast for a vehicle that has stopped, too slow for a jump.
    let mut stopping = 0;
    bench.command.age_us = 250_001;
    for tick in 1..4000_u32 {
        let noise = i64::from(tick % 2);
        bench.sample.encoder_counts[0] += 8 + noise;
        bench.sample.encoder_counts[1] += 8 + noise;
        let status = bench.tick();
        if status.mode == Mode::Disarmed {
            break;
        }
        stopping += 1;
    }
    assert!(stopping <= 2001, "{stopping}");
}
