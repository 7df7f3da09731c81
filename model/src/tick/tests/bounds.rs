//! What bounds the motors besides their current limits: heat, and a supply that takes no power back.

use super::super::Decision;
use super::{BoardScales, VehicleCore, reference, sensed_at_rest};
use crate::command::Command;
use crate::control::motor::voltage;
use crate::estimate::Estimate;
use crate::sample::MOTORS;
use crate::status::Terms;
use crate::supervise::arming::Mode;
use crate::supervise::codes::{BlockerSet, FaultSet, Limit, LimitSet};

fn driving(voltage_v: [f32; MOTORS]) -> Decision {
    Decision {
        mode: Mode::Armed,
        faults: FaultSet::EMPTY,
        blockers: BlockerSet::EMPTY,
        late_ticks: 0,
        refused_arms: 0,
        limits: LimitSet::EMPTY,
        voltage_v,
        ballast_off: false,
        motor_shares: [1.0; MOTORS],
        terms: Terms::default(),
        speed_reference_m_s: 0.0,
        yaw_rate_reference_rad_s: 0.0,
    }
}

/// Near the supply's highest voltage, a motor that brakes from 10 rad/s brakes less, and a motor that drives is not bounded. The
/// back-EMF is 13.0 V, the wished voltage 5 V below it.
#[test]
fn a_supply_near_its_highest_voltage_takes_back_less() {
    for (battery_v, bound) in [(25.0, false), (27.5, false), (29.8, true)] {
        let mut core = VehicleCore::new(&reference(), &BoardScales::EXAMPLE);
        let mut sensed = sensed_at_rest();
        sensed.supply_v = battery_v;
        sensed.relative_rate_rad_s = [10.0, 10.0, 0.0];
        let output = core.actuate(&sensed, &Estimate::default(), driving([8.0, 15.0, 1.0]));
        let [left_v, right_v, ballast_v] = output.status.voltage_v;
        assert_eq!(output.status.limits.contains(Limit::Regeneration), bound, "{battery_v}");
        assert_eq!((right_v, ballast_v), (15.0, 1.0));
        if bound {
            assert!(left_v > 10.0 && left_v < 13.0, "{left_v}");
        } else {
            assert_eq!(left_v, 8.0);
        }
        let duties = output.actuation.duty.map(|duty| voltage(duty, battery_v));
        assert!((duties[0] - left_v).abs() < 0.01, "the bridge gives it");
    }
}

/// The sensor shows the left motor's current far above the limit: the left motor gets less voltage, and the right motor gets as
/// much more, so that the drive's mean stays.
#[test]
fn the_measured_current_bounds_its_motor_too() {
    let mut core = VehicleCore::new(&reference(), &BoardScales::EXAMPLE);
    let mut sensed = sensed_at_rest();
    sensed.current_a[0] = 25.0;
    let wanted = driving([5.0, 1.0, 0.0]);
    let before = core.actuate(&sensed, &Estimate::default(), wanted).status;
    assert_eq!(before.voltage_v, [5.0, 1.0, 0.0]);
    let estimated = core.estimate(&sensed);
    let mut motor_shares = [1.0; MOTORS];
    for _ in 0..100 {
        sensed.time_us += 1000;
        motor_shares = core.decide(&sensed, &estimated, &Command::NONE).motor_shares;
    }
    let bounded = Decision { motor_shares, ..wanted };
    let after = core.actuate(&sensed, &Estimate::default(), bounded).status;
    let [left_v, right_v, _] = after.voltage_v;
    assert!(left_v < 3.5, "{left_v}");
    assert!((left_v + right_v - 6.0).abs() < 1e-4, "{left_v} {right_v}");
    assert!(after.limits.contains(Limit::MotorHeat) && after.limits.contains(Limit::LeftCurrent));
    assert!(!after.limits.contains(Limit::RightCurrent));
}
