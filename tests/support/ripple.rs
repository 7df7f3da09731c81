//! The tables of a drive motor's current within a period of the PWM, at a full battery of seven cells.

use std::fmt::Write as _;

use firmware::drive_board::nucleo_h743zi::analog::{CONVERTER_HZ, CURRENT_STEP_HALF_CYCLES};
use firmware::drive_board::{DUTY_MAX_PERCENT, PWM_HZ};
use model::vehicle::MotorParameters;

use super::switching::{Modulation, SwitchedMotor};

/// Time from one current's sample to the next, s.
const CURRENT_STEP_S: f64 = CURRENT_STEP_HALF_CYCLES as f64 / (2.0 * CONVERTER_HZ as f64);
/// Largest duty of a bridge.
const MOST: f64 = DUTY_MAX_PERCENT as f64 / 100.0;

/// The motor on its bridge.
pub fn motor(drive: &MotorParameters<f64>) -> SwitchedMotor {
    SwitchedMotor {
        resistance_ohm: drive.resistance_ohm,
        inductance_h: drive.inductance_h,
        supply_v: 25.2,
        pwm_hz: f64::from(PWM_HZ),
    }
}

/// The table of the current under each modulation.
pub fn modulations(motor: &SwitchedMotor) -> String {
    let mut text = String::from(
        "| PWM | Ripple, A peak to peak, at 0 V | at 25 % | at 50 % | at 94 % | Heat of the ripple at 0 V, W | Share of the asked current, motor still, at 10 % | at 25 % |\n|---|---|---|---|---|---|---|---|\n",
    );
    for modulation in Modulation::ALL {
        let at = |duty: f64| motor.periodic(modulation, duty, duty * motor.supply_v);
        let [none, quarter, half, most] = [0.0, 0.25, 0.5, MOST].map(|duty| at(duty).ripple_a);
        let heat_w = at(0.0).ripple_heat_w(motor.resistance_ohm);
        let share = |duty: f64| {
            let asked_a = duty * motor.supply_v / motor.resistance_ohm;
            100.0 * motor.periodic(modulation, duty, 0.0).mean_a / asked_a
        };
        let (tenth, fourth) = (share(0.1), share(0.25));
        let name = modulation.name();
        let _ = writeln!(
            text,
            "| {name} | {none:.1} | {quarter:.1} | {half:.1} | {most:.1} | {heat_w:.1} | {tenth:.0} % | {fourth:.0} % |"
        );
    }
    text
}

/// The table of the converter's readings of the left and the right motor's current, less the current's mean.
pub fn samples(motor: &SwitchedMotor) -> String {
    let mut text = String::from(
        "| Sample | after the middle of the brake, us | at 10 % | at 25 % | at 50 % | at 94 % |\n|---|---|---|---|---|---|\n",
    );
    for (name, steps) in [("left", -0.5), ("right", 0.5)] {
        let after_s = steps * CURRENT_STEP_S;
        let off = [0.1, 0.25, 0.5, MOST].map(|duty| {
            let back_emf_v = duty * motor.supply_v;
            let mean_a = motor.periodic(Modulation::DriveBrake, duty, back_emf_v).mean_a;
            motor.braking_a(duty, back_emf_v, after_s) - mean_a
        });
        let cells = off.map(|off_a| format!("{off_a:+.2}")).join(" | ");
        let _ = writeln!(text, "| {name} | {:+.2} | {cells} |", after_s * 1e6);
    }
    text
}
