//! The current of a switched motor, compared with textbook formulas and with an integration in small steps.

use firmware::drive_board::{DUTY_MAX_PERCENT, PWM_HZ};

#[path = "support/switching.rs"]
mod switching;
use switching::{BridgeHold, Modulation, SwitchedMotor};

/// Largest duty of a bridge.
const MOST: f64 = DUTY_MAX_PERCENT as f64 / 100.0;

/// A drive motor of the reference vehicle at a full battery.
const DRIVE: SwitchedMotor = SwitchedMotor {
    resistance_ohm: 0.316,
    inductance_h: 80e-6,
    supply_v: 25.2,
    pwm_hz: PWM_HZ as f64,
};

/// The modulations that apply a voltage throughout the period.
const NEVER_OPEN: [Modulation; 3] = [
    Modulation::LockedAntiPhase,
    Modulation::DriveBrake,
    Modulation::Unipolar,
];

/// The plant's motors use the mean voltage alone, which is right for modulations that are never open.
#[test]
fn the_mean_is_that_of_the_averaged_motor() {
    for modulation in NEVER_OPEN {
        for duty in [-0.9, -0.3, 0.0, 0.5, MOST] {
            for back_emf_v in [-10.0, 0.0, 7.0] {
                let mean_a = DRIVE.periodic(modulation, duty, back_emf_v).mean_a;
                let averaged_a = (duty * DRIVE.supply_v - back_emf_v) / DRIVE.resistance_ohm;
                assert!(
                    (mean_a - averaged_a).abs() < 1e-9,
                    "{modulation:?} {duty} {back_emf_v}: {mean_a}"
                );
            }
        }
    }
}

/// Without resistance the ripple is the textbook's: 2 V d (1 - d) / (L f) between the rails with d the share of the
/// forward diagonal, V d (1 - d) / (L f) against zero, and at most half of that at twice the frequency.
#[test]
fn the_ripple_is_the_textbooks() {
    let motor = SwitchedMotor {
        resistance_ohm: 1e-3,
        ..DRIVE
    };
    let unit_a = motor.supply_v / (motor.inductance_h * motor.pwm_hz);
    for duty in [0.0, 0.1, 0.5, MOST] {
        let d = f64::midpoint(1.0, duty);
        for (modulation, expected_a) in [
            (Modulation::LockedAntiPhase, 2.0 * unit_a * d * (1.0 - d)),
            (Modulation::DriveBrake, unit_a * duty * (1.0 - duty)),
            (Modulation::Unipolar, unit_a * duty * (1.0 - duty) / 2.0),
        ] {
            let ripple_a = motor.periodic(modulation, duty, duty * motor.supply_v).ripple_a;
            assert!(
                (ripple_a - expected_a).abs() < 1e-3 * unit_a,
                "{modulation:?} {duty}: {ripple_a}"
            );
        }
    }
}

/// A still motor whose bridge drives for a share d < 1/2 and is open for the rest: the current rises for d and
/// falls for d, a triangle of height V d / (L f), and is 0 for the rest. Its mean is d times its height.
#[test]
fn an_open_bridge_lets_the_current_go_out() {
    let motor = SwitchedMotor {
        resistance_ohm: 1e-3,
        ..DRIVE
    };
    let unit_a = motor.supply_v / (motor.inductance_h * motor.pwm_hz);
    for duty in [-0.3_f64, 0.1, 0.25, 0.45] {
        let current = motor.periodic(Modulation::DriveOpen, duty, 0.0);
        assert!(
            (current.ripple_a - unit_a * duty.abs()).abs() < 1e-3 * unit_a,
            "{duty}: {current:?}"
        );
        let mean_a = unit_a * duty * duty.abs();
        assert!((current.mean_a - mean_a).abs() < 1e-3 * unit_a, "{duty}: {current:?}");
    }
    // An armed vehicle at rest: an open bridge lets the wheel turn, a braking bridge holds it.
    assert!(motor.periodic(Modulation::DriveOpen, 0.0, 5.0).mean_a.abs() < 1e-12);
    assert!(motor.periodic(Modulation::DriveBrake, 0.0, 5.0).mean_a < -1.0);
}

/// Compared with the current integrated through the period in ten thousand steps.
#[test]
fn mean_and_root_mean_square_are_those_of_the_stepped_current() {
    const STEPS: usize = 10_000;
    for modulation in Modulation::ALL {
        let step_s = 1.0 / (DRIVE.pwm_hz * STEPS as f64);
        let (duty, back_emf_v) = (0.4, 8.0);
        let mut current_a: f64 = 0.0;
        let (mut sum, mut square) = (0.0, 0.0);
        // After 60 periods, 12 time constants, the current is periodic.
        for _ in 0..60 {
            (sum, square) = (0.0, 0.0);
            for step in 0..STEPS {
                let at = (step as f64 + 0.5) / STEPS as f64;
                let mut end = 0.0;
                let (_, held) = modulation
                    .stretches(duty)
                    .into_iter()
                    .find(|(share, _)| {
                        end += share;
                        at < end
                    })
                    .expect("the stretches fill the period");
                let change = |voltage: f64| {
                    (voltage * DRIVE.supply_v - DRIVE.resistance_ohm * current_a - back_emf_v) / DRIVE.inductance_h
                        * step_s
                };
                current_a = match held {
                    BridgeHold::At(voltage) => current_a + change(voltage),
                    // The diodes do not let the current reverse.
                    BridgeHold::Open if current_a > 0.0 => (current_a + change(-1.0)).max(0.0),
                    BridgeHold::Open => (current_a + change(1.0)).min(0.0).max(current_a),
                };
                sum += current_a / STEPS as f64;
                square += current_a * current_a / STEPS as f64;
            }
        }
        let exact = DRIVE.periodic(modulation, duty, back_emf_v);
        assert!((exact.mean_a - sum).abs() < 0.01, "{modulation:?}: {sum}, {exact:?}");
        assert!(
            (exact.rms_a - square.sqrt()).abs() < 0.01,
            "{modulation:?}: {square}, {exact:?}"
        );
    }
}

/// In the middle of the braking interval the current is the mean except for the curvature of the exponential. To
/// second order in x, the period over the time constant, the current is less than the mean by V/R x^2/24 d (1 -
/// d^2); the next order is smaller by x^2.
#[test]
fn the_mean_flows_in_the_middle_of_the_brake() {
    let x = DRIVE.resistance_ohm / (DRIVE.inductance_h * DRIVE.pwm_hz);
    for duty in [0.0, 0.05, 0.25, 0.5, 0.75, MOST] {
        for back_emf_v in [0.0, 7.0] {
            for sign in [1.0, -1.0] {
                let mean_a = DRIVE.periodic(Modulation::DriveBrake, sign * duty, back_emf_v).mean_a;
                let short_a = sign * (mean_a - DRIVE.braking_a(sign * duty, back_emf_v, 0.0));
                let bend_a = DRIVE.supply_v / DRIVE.resistance_ohm * x * x / 24.0 * duty * (1.0 - duty * duty);
                assert!(
                    (short_a - bend_a).abs() <= x * x * bend_a + 1e-9,
                    "{duty}: {short_a}, {bend_a}"
                );
            }
        }
    }
}

/// Away from the middle the current falls by the duty's share of the supply's slope.
#[test]
fn a_sample_beside_the_middle_is_off_by_the_slope() {
    let late_s = 0.5e-6;
    let x = DRIVE.resistance_ohm / (DRIVE.inductance_h * DRIVE.pwm_hz);
    for duty in [0.25, 0.5, MOST] {
        // At the back-EMF of the mean voltage no mean current flows whose decay would add to the difference; the
        // curvature's share is at most x^2/24.
        let back_emf_v = duty * DRIVE.supply_v;
        let fell_a = DRIVE.braking_a(duty, back_emf_v, -late_s) - DRIVE.braking_a(duty, back_emf_v, late_s);
        let expected_a = 2.0 * late_s * back_emf_v / DRIVE.inductance_h;
        assert!(
            (fell_a - expected_a).abs() <= x * x / 24.0 * expected_a,
            "{duty}: {fell_a}, {expected_a}"
        );
    }
}
