//! Stage 3: what the laws do under each verdict, and when each limit's flag is set and clear.

use super::super::decide::{Laws, Wish};
use super::super::{Estimated, Sines};
use super::{BoardScales, reference, sensed_at_rest, without_spar};
use crate::command::{Command, DriveCommand};
use crate::estimate::Estimate;
use crate::sensed::Sensed;
use crate::supervise::arming::Mode;
use crate::supervise::codes::{Fault, FaultSet, Limit};
use crate::supervise::supervisor::Findings;

const ARMED: Findings = Findings {
    mode: Mode::Armed,
    newly_armed: false,
    faults: FaultSet::EMPTY,
};

/// The laws with what one tick shows them.
struct Bench {
    laws: Laws,
    sensed: Sensed,
    estimate: Estimate,
    command: Command,
}

impl Bench {
    /// Just armed: the next tick is the second of a drive.
    fn new() -> Self {
        let mut bench = Self {
            laws: Laws::new(&reference(), BoardScales::EXAMPLE.duty_max),
            sensed: sensed_at_rest(),
            estimate: Estimate::default(),
            command: Command::NONE,
        };
        bench.tick(Findings {
            newly_armed: true,
            ..ARMED
        });
        bench
    }

    fn tick(&mut self, verdict: Findings) -> Wish {
        let (phi, sin_slope) = (self.estimate.phi_rad, self.estimate.sin_slope);
        let estimate = self.estimate;
        let sines = Sines {
            phi: (phi.sin(), phi.cos()),
            slope: (sin_slope, (1.0 - sin_slope * sin_slope).sqrt()),
            roll: 0.0,
            slope_turn_per_s: 0.0,
        };
        let estimated = Estimated { estimate, sines };
        self.laws.step(verdict, &self.sensed, &estimated, &self.command)
    }
}

/// The probe adds 0.02 V for two ticks and takes 0.02 V off for two, alike for both drive motors; the ballast's motor gets nothing.
#[test]
fn a_vehicle_that_stands_gets_the_probe_and_nothing_else() {
    let mut bench = Bench::new();
    let probes: [f32; 8] = core::array::from_fn(|_| {
        let [left, right, ballast] = bench.tick(ARMED).voltage_v;
        assert_eq!((left, ballast), (right, 0.0));
        left
    });
    let two_and_two = [-0.02, -0.02, 0.02, 0.02, -0.02, -0.02, 0.02, 0.02];
    assert_eq!(probes, two_and_two);
}

#[test]
fn a_turn_to_the_left_drives_the_right_wheel_on_and_the_left_one_back() {
    for yaw_rate_rad_s in [0.8, -0.8] {
        let mut bench = Bench::new();
        bench.command.drive.yaw_rate_rad_s = yaw_rate_rad_s;
        let mut wish = Wish::default();
        for _ in 0..100 {
            wish = bench.tick(ARMED);
        }
        let [left, right, _] = wish.voltage_v;
        let turn_v = wish.terms.steering.sum_v();
        assert!(turn_v * yaw_rate_rad_s > 0.1, "{turn_v}");
        assert!((0.5 * (right - left) - turn_v).abs() < 1e-5);
        // The mean is the speed law's voltage plus the probe's.
        assert!((0.5 * (right + left) - wish.terms.speed.sum_v()).abs() < 0.021);
    }
}

/// Because of the play in its gears, the law of a vehicle that stands has slower poles. The torque of a turn on the spot takes up
/// the play, and the poles are those of driving.
#[test]
fn a_vehicle_that_turns_on_the_spot_is_not_as_slow_as_one_that_stands() {
    let swing_damping_v = |yaw_rate_rad_s: f32| {
        let mut bench = Bench::new();
        bench.command.drive.yaw_rate_rad_s = yaw_rate_rad_s;
        bench.estimate.phi_rad = 0.01;
        (0..5).fold(0.0, |_, _| bench.tick(ARMED).terms.speed.swing_damping_v)
    };
    let (stands_v, turns_v) = (swing_damping_v(0.0), swing_damping_v(0.8));
    assert!(stands_v < 0.0 && turns_v < 0.0, "{stands_v} V, {turns_v} V");
    assert!(stands_v / turns_v < 0.6, "{stands_v} V, {turns_v} V");
    assert!((swing_damping_v(-0.8) / turns_v - 1.0).abs() < 1e-3);
}

/// Steering takes at most half of the supply that the duty can give; driving has what steering leaves.
#[test]
fn steering_takes_half_of_the_supply_and_driving_the_rest() {
    let mut bench = Bench::new();
    bench.command.drive.yaw_rate_rad_s = 2.0;
    bench.estimate.yaw_rate_rad_s = -20.0;
    bench.estimate.phi_rad = -0.9;
    // Less than the current limits allow.
    bench.sensed.supply_v = 4.0;
    let supply_v = BoardScales::EXAMPLE.duty_max * bench.sensed.supply_v;
    let mut wish = Wish::default();
    for _ in 0..20 {
        wish = bench.tick(ARMED);
    }
    let [left, right, _] = wish.voltage_v;
    assert!(
        (0.5 * (right - left) - 0.5 * supply_v).abs() < 1e-3,
        "{left} V, {right} V"
    );
    let drive_v = 0.5 * (left + right);
    assert!((drive_v.abs() - 0.5 * supply_v).abs() < 0.021, "{drive_v} V");
    assert!(wish.limits.contains(Limit::Voltage));
    // Without the turn, driving may take the whole supply, and takes more than half of it.
    bench.command.drive.yaw_rate_rad_s = 0.0;
    bench.estimate.yaw_rate_rad_s = 0.0;
    let mut bench = Bench {
        laws: Bench::new().laws,
        ..bench
    };
    let drive_v = (0..20).fold(0.0, |_, _| bench.tick(ARMED).voltage_v[0]);
    assert!(drive_v.abs() > 0.6 * supply_v, "{drive_v} V");
}

/// A commanded speed counts as reached within 0.01 m/s.
#[test]
fn each_limits_flag_rises_with_its_cause_and_falls_without() {
    type Cause = fn(&mut Bench);
    let causes: [(Limit, bool, Cause); 15] = [
        (Limit::Voltage, true, |b| {
            (b.sensed.supply_v, b.estimate.phi_rad) = (2.0, 0.9);
        }),
        (Limit::Voltage, true, |b| {
            (b.sensed.supply_v, b.estimate.phi_rad) = (2.0, -0.9);
        }),
        (Limit::Voltage, false, |b| b.estimate.phi_rad = 0.01),
        (Limit::Reference, true, |b| b.command.drive.speed_m_s = 0.5),
        (Limit::Reference, true, |b| b.command.drive.speed_m_s = -0.5),
        (Limit::Reference, false, |b| b.command.drive.speed_m_s = 0.009),
        (Limit::Reference, false, |b| b.command.drive.speed_m_s = -0.009),
        // After 20 ticks the reference reaches 0.08 rad/s. A slope with the sine 0.53 leaves no grip for a turn at 2.5 m/s.
        (Limit::Reference, true, |b| b.command.drive.yaw_rate_rad_s = 0.2),
        (Limit::Reference, false, |b| b.command.drive.yaw_rate_rad_s = -0.07),
        (Limit::Reference, true, |b| {
            (
                b.command.drive.yaw_rate_rad_s,
                b.estimate.speed_m_s,
                b.estimate.sin_slope,
            ) = (0.07, 2.5, 0.53);
        }),
        (Limit::Stall, true, |b| b.estimate.stalled = true),
        (Limit::Slip, true, |b| b.estimate.sliding = true),
        // Rubber of 0.6 holds no slope of 60 degrees, and an arm of 0.72 r carries none of 50.
        (Limit::SlopeLimit, true, |b| b.estimate.sin_slope = 0.87),
        (Limit::SlopeLimit, true, |b| b.estimate.sin_slope = -0.87),
        (Limit::SlopeLimit, false, |b| b.estimate.sin_slope = 0.1),
    ];
    for (n, (limit, expected, cause)) in causes.into_iter().enumerate() {
        let mut bench = Bench::new();
        assert_eq!(
            bench.tick(ARMED).limits.bits(),
            0,
            "nothing bounds a vehicle that stands"
        );
        let (sensed, estimate) = (bench.sensed, bench.estimate);
        cause(&mut bench);
        // While the vehicle drives, the laws follow the slope slowly. So the vehicle is armed on it.
        let armed = bench.tick(Findings {
            newly_armed: true,
            ..ARMED
        });
        let limits = (0..20).fold(armed, |_, _| bench.tick(ARMED)).limits;
        assert_eq!(limits.contains(limit), expected, "cause {n}: {limits}");
        if matches!(limit, Limit::Stall | Limit::Slip) {
            assert_eq!(limits.bits(), 1 << limit as u8, "cause {n}: {limits}");
            (bench.sensed, bench.estimate) = (sensed, estimate);
            assert!(bench.tick(ARMED).limits.is_empty(), "cause {n} has gone");
        }
    }
}

/// A controlled stop drives towards rest whatever is commanded; the laws of a disarmed vehicle have no target.
#[test]
fn the_mode_decides_what_is_aimed_at() {
    for (mode, target_m_s) in [(Mode::Armed, 1.0), (Mode::Stopping, 0.0), (Mode::Disarmed, 0.0)] {
        let mut bench = Bench::new();
        bench.command.drive = DriveCommand::driving(1.0, 0.5);
        bench.tick(ARMED);
        let mut wish = Wish::default();
        for _ in 0..500 {
            wish = bench.tick(Findings { mode, ..ARMED });
        }
        assert_eq!(bench.laws.intent().target_m_s, target_m_s, "{mode:?}");
        let yaw_reference = bench.laws.yaw_rate_reference_rad_s();
        match mode {
            Mode::Armed => assert_eq!(yaw_reference, 0.5),
            Mode::Stopping => assert_eq!(yaw_reference, 0.0),
            Mode::Disarmed => assert_eq!(wish, Wish::default()),
        }
    }
}

/// The intent, which the estimator reads, holds the target and the reference that the speed law uses.
#[test]
fn the_intent_is_the_laws_target_and_reference() {
    let mut bench = Bench::new();
    bench.command.drive.speed_m_s = 1.5;
    for _ in 0..100 {
        bench.tick(ARMED);
    }
    let intent = bench.laws.intent();
    assert_eq!((intent.target_m_s, intent.stuck), (1.5, false));
    assert_eq!(intent.reference_m_s, bench.laws.speed_reference_m_s());
    assert!(intent.reference_m_s > 0.01 && intent.reference_m_s < 1.0, "{intent:?}");
}

#[test]
fn arming_starts_every_law_at_the_present_motion() {
    let mut bench = Bench::new();
    bench.command.drive = DriveCommand::driving(1.0, 1.0);
    for _ in 0..300 {
        bench.tick(ARMED);
    }
    bench.tick(Findings {
        mode: Mode::Disarmed,
        ..ARMED
    });
    bench.command.drive = DriveCommand::NEUTRAL;
    bench.estimate.speed_m_s = 0.7;
    bench.estimate.theta_rate_rad_s = 2.8;
    bench.estimate.heading_rad = 3.0;
    let wish = bench.tick(Findings {
        newly_armed: true,
        ..ARMED
    });
    let reference_m_s = bench.laws.speed_reference_m_s();
    assert!((reference_m_s - 0.7).abs() < 0.02, "{reference_m_s} m/s");
    assert_eq!(bench.laws.yaw_rate_reference_rad_s(), 0.0);
    assert_eq!(wish.terms.steering.integral_v, 0.0, "the heading of arming is held");
}

/// A fault of the spar switches the ballast off until the next arming, also when its cause has gone.
#[test]
fn a_fault_of_the_spar_switches_the_ballast_off_until_the_next_arming() {
    for fault in FaultSet::SPAR.iter() {
        let mut bench = Bench::new();
        bench.estimate.spar_rad = 0.1;
        let before = bench.tick(ARMED);
        assert!(
            !before.ballast_off && before.voltage_v[2] != 0.0,
            "a tilted spar is levelled"
        );
        let mut faults = FaultSet::EMPTY;
        faults.insert(fault);
        for verdict in [Findings { faults, ..ARMED }, ARMED, ARMED] {
            let wish = bench.tick(verdict);
            assert!(wish.ballast_off && wish.voltage_v[2] == 0.0, "{}", fault.name());
            assert_eq!(wish.terms.spar.sum_v(), 0.0);
        }
        let armed_again = bench.tick(Findings {
            newly_armed: true,
            ..ARMED
        });
        assert!(!armed_again.ballast_off && armed_again.voltage_v[2] != 0.0);
    }
    // No other fault touches the spar.
    for fault in Fault::ALL.iter().copied().filter(|f| !FaultSet::SPAR.contains(*f)) {
        let mut bench = Bench::new();
        bench.estimate.spar_rad = 0.1;
        let mut faults = FaultSet::EMPTY;
        faults.insert(fault);
        assert!(
            !bench.tick(Findings { faults, ..ARMED }).ballast_off,
            "{}",
            fault.name()
        );
    }
}

#[test]
fn a_vehicle_without_a_spar_has_its_ballast_off() {
    let mut bench = Bench::new();
    bench.laws = Laws::new(&without_spar(), BoardScales::EXAMPLE.duty_max);
    let wish = bench.tick(ARMED);
    assert!(wish.ballast_off && wish.voltage_v[2] == 0.0);
}
