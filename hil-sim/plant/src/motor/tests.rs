//! Compares motors with a fine integration of their circuit, and diodes and battery with results
//! computed by hand.

use super::*;
use crate::battery::Battery;
use crate::tests::reference_vehicle;

const H: f64 = 5e-4;

fn motor() -> DcMotor {
    DcMotor::new(&reference_vehicle().parameters().drive_motor, 45.0)
}

/// One substep at a constant rate: (mean current, torque at the output).
fn substep(motor: &mut DcMotor, bridge: BridgeState, battery_v: f64, rate: f64) -> (f64, f64) {
    DcMotor::prepare(core::slice::from_mut(motor), H);
    let joint = motor.begin(H, bridge, battery_v, rate);
    motor.end(rate);
    let limit = joint.limit_n_m;
    let torque = (joint.constant_n_m - joint.damping_n_m_s * rate).clamp(-limit, limit);
    assert!((torque - motor.torque_n_m()).abs() < 1e-9 * (1.0 + torque.abs()));
    (motor.mean_current_a(), torque)
}

/// `L i' = volts - R i - emf` by RK4 in 10 000 steps: (mean, end).
fn circuit(mut i: f64, volts: f64, emf: f64) -> (f64, f64) {
    let p = reference_vehicle().parameters().drive_motor;
    let slope = |i: f64| (volts - emf - p.resistance_ohm * i) / p.inductance_h;
    let n = 10_000;
    let h = H / f64::from(n);
    let mut sum = 0.0;
    for _ in 0..n {
        let k1 = slope(i);
        let k2 = slope(i + 0.5 * h * k1);
        let k3 = slope(i + 0.5 * h * k2);
        let k4 = slope(i + h * k3);
        let next = i + h / 6.0 * (k1 + 2.0 * (k2 + k3) + k4);
        sum += 0.5 * h * (i + next);
        i = next;
    }
    (sum / H, i)
}

#[test]
fn the_armature_follows_its_circuit() {
    let mut m = motor();
    let rate = 3.0;
    let emf = 0.030124 * 43.0 * rate;
    let mut expected = (0.0, 0.0);
    for duty in [0.3, 0.3, -0.2, 0.1] {
        expected = circuit(expected.1, duty * 24.0, emf);
        let (mean, torque) = substep(&mut m, BridgeState::Duty(duty), 24.0, rate);
        assert!((mean - expected.0).abs() < 1e-6, "{mean} against {}", expected.0);
        assert!((m.current_a() - expected.1).abs() < 1e-6);
        assert!((torque - 0.0302 * 43.0 * mean).abs() < 1e-9);
    }
    assert!(expected.1.abs() > 1.0);
}

#[test]
fn without_inductance_it_is_ohms_law_at_once() {
    let mut p = reference_vehicle().parameters().drive_motor;
    p.inductance_h = 0.0;
    let mut m = DcMotor::new(&p, 45.0);
    let (mean, _) = substep(&mut m, BridgeState::Duty(0.5), 24.0, 2.0);
    let expected = (12.0 - 0.030124 * 43.0 * 2.0) / 0.316;
    assert!((mean - expected).abs() < 1e-12 && (m.current_a() - expected).abs() < 1e-12);
    let (mean, _) = substep(&mut m, BridgeState::Open, 24.0, 2.0);
    assert_eq!(mean, 0.0);
}

#[test]
fn an_open_bridge_neither_drives_nor_brakes_below_the_battery() {
    let mut m = motor();
    for rate in [0.0, 5.0, -15.0] {
        assert_eq!(substep(&mut m, BridgeState::Open, 24.0, rate), (0.0, 0.0));
    }
    // With a back-EMF above battery and diodes the motor generates and brakes the motion.
    let rate = 25.0;
    let emf = 0.030124 * 43.0 * rate;
    let mut last = (0.0, 0.0);
    for _ in 0..20 {
        last = substep(&mut m, BridgeState::Open, 24.0, rate);
    }
    let expected = -(emf - 24.0 - DIODES_V) / 0.316;
    assert!(
        (last.0 - expected).abs() < 1e-6 && expected < -10.0,
        "{} against {expected} A",
        last.0
    );
    assert!(
        (m.battery_current_a() - expected).abs() < 1e-6,
        "all of it charges the battery"
    );
}

#[test]
fn a_bridge_that_opens_lets_its_current_die_into_the_battery() {
    let mut m = motor();
    for _ in 0..20 {
        substep(&mut m, BridgeState::Duty(0.2), 24.0, 0.0);
    }
    let start = m.current_a();
    assert!((start - 4.8 / 0.316).abs() < 0.01);
    let (mean, _) = substep(&mut m, BridgeState::Open, 24.0, 0.0);
    // L i' = -(V + R i), solved by hand: the current ends after tau ln(1 + R i / V), about 44 us
    // here.
    let (v, r, l) = (24.0 + DIODES_V, 0.316, 8e-5);
    let dies = l / r * (1.0 + r * start / v).ln();
    assert!(dies > 4e-5 && dies < 5e-5);
    // Only the inductor's energy: R i^2 + V i over the time gives the charge.
    let n = 100_000;
    let mut i = start;
    let mut charge = 0.0;
    let h = dies / f64::from(n);
    for _ in 0..n {
        let middle = i - 0.5 * h * (v + r * i) / l;
        charge += h * middle;
        i -= h * (v + r * middle) / l;
    }
    assert!(i.abs() < 1e-4, "the hand result dies: {i}");
    assert!((mean - charge / H).abs() < 1e-5, "{mean} against {}", charge / H);
    assert_eq!(m.current_a(), 0.0);
    assert!(
        (m.battery_current_a() + mean).abs() < 1e-12,
        "the current does not flow back"
    );
}

#[test]
fn a_broken_lead_carries_nothing_and_a_short_brakes_and_chops() {
    let mut m = motor();
    for _ in 0..20 {
        substep(&mut m, BridgeState::Duty(0.5), 24.0, 2.0);
    }
    assert!(m.current_a() > 10.0);
    assert_eq!(substep(&mut m, BridgeState::Disconnected, 24.0, 2.0), (0.0, 0.0));
    assert_eq!((m.current_a(), m.battery_current_a()), (0.0, 0.0));
    // A short: the back-EMF drives a current through the armature alone, which brakes the motor.
    let rate = 6.0;
    for duty in [0.3, -0.3, 0.0] {
        for _ in 0..40 {
            substep(&mut m, BridgeState::Shorted(duty), 24.0, rate);
        }
        let expected = -0.030124 * 43.0 * rate / 0.316;
        assert!((m.mean_current_a() - expected).abs() < 1e-9, "{}", m.mean_current_a());
        let bridge = if duty == 0.0 { 0.0 } else { 45.0_f64.copysign(duty) };
        assert_eq!(m.bridge_current_a(), bridge);
        // The battery heats the short: i^2 R over its voltage.
        assert!((m.battery_current_a() - bridge * bridge * 0.05 / 24.0).abs() < 1e-12);
    }
    substep(&mut m, BridgeState::Duty(0.0), 24.0, 0.0);
    assert_eq!(
        m.bridge_current_a(),
        m.mean_current_a(),
        "the sensor does not see the motor again"
    );
}

#[test]
fn the_bridge_chops_at_its_limit_either_way() {
    let mut m = motor();
    for sign in [1.0, -1.0] {
        for _ in 0..50 {
            substep(&mut m, BridgeState::Duty(sign), 24.0, 0.0);
        }
        assert_eq!(m.current_a(), sign * 45.0, "stall without it: 76 A");
        // Chopping passes only R i, which determines the share of the current that the battery
        // supplies.
        let expected = 45.0 * 45.0 * 0.316 / 24.0;
        assert!((m.battery_current_a() - expected).abs() < 1e-9);
    }
    for _ in 0..50 {
        substep(&mut m, BridgeState::Duty(0.1), 24.0, 0.0);
    }
    assert!(
        (m.current_a() - 2.4 / 0.316).abs() < 1e-6,
        "the bridge chops on below its limit"
    );
}

#[test]
fn the_battery_sags_under_load_and_rises_under_regeneration() {
    let battery = Battery {
        open_circuit_v: 25.2,
        resistance_ohm: 0.06,
        idle_a: 0.2,
    };
    // Both settle where V = Voc - R (idle + duty i), i = (duty V - emf) / R_a.
    for (duty, rate) in [(0.5, 0.0), (0.1, 12.0)] {
        let mut motors = [motor()];
        let mut v = 25.2;
        for _ in 0..40 {
            DcMotor::prepare(&mut motors, H);
            v = battery.terminal_v(MotorSpan::Substep, v, &motors, &[BridgeState::Duty(duty)], &[rate]);
            let [m] = &mut motors;
            substep(m, BridgeState::Duty(duty), v, rate);
        }
        let emf = 0.030124 * 43.0 * rate;
        let expected = (25.2 - 0.06 * (0.2 - duty * emf / 0.316)) / (1.0 + 0.06 * duty * duty / 0.316);
        assert!((v - expected).abs() < 1e-6, "{v} against {expected} V");
        assert!(if rate > 0.0 { v > 25.3 } else { v < 24.2 }, "{v}");
    }
    // A very weak battery with a motor without inductance is still stable.
    let weak = Battery {
        resistance_ohm: 10.0,
        ..battery
    };
    let mut p = reference_vehicle().parameters().drive_motor;
    p.inductance_h = 0.0;
    let mut motors = [DcMotor::new(&p, 45.0)];
    let mut last = 25.2;
    for _ in 0..40 {
        DcMotor::prepare(&mut motors, H);
        last = weak.terminal_v(MotorSpan::Substep, last, &motors, &[BridgeState::Duty(1.0)], &[0.0]);
        let [m] = &mut motors;
        substep(m, BridgeState::Duty(1.0), last, 0.0);
    }
    let expected = (25.2 - 2.0) / (1.0 + 10.0 / 0.316);
    assert!((last - expected).abs() < 1e-9, "{last} against {expected}");
}
