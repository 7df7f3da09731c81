//! Compares the wheels' turns with the turns that their motors' voltages should have caused.
//!
//! With its wheels off the ground the vehicle has no balance for a law to keep. The law takes the turning wheels for a
//! slide, and its reaction differs between boards and runs. The armature equation applies whatever the law does.

use core::f64::consts::TAU;

use firmware::flight_record::FlightRecord;
use model::command::DriveCommand;
use model::sample::Motor;
use model::vehicle::MotorParameters;

use super::joint_turn::{JointMotor, JointTurn};

/// Smallest significant turn, rad: about twice the turn that a current sensor's permitted offset of half an ampere adds
/// with the reference vehicle's voltages in 3 s.
const LEAST_RAD: f64 = TAU / 10.0;
/// Largest difference between a wheel's turn and the turn from its voltage, as a share. Back-EMF constants are within a
/// tenth of their data sheet, the supply's reading within 3 %. In the air the resistance drops an eighth of the voltage:
/// a winding 60 K warmer has a quarter more resistance, which is 3 % of the voltage, and a sensor's offset is 7 %.
/// Exchanged motor leads are off by 2, a wheel that its motor does not drive by 1.
const SHARE: f64 = 0.25;

/// Turns of the two wheels under one command.
#[derive(Debug)]
pub(super) struct Turns {
    command: DriveCommand,
    /// Required direction of each wheel: 1 forward, -1 backward.
    directions: [f64; 2],
    motor: JointMotor,
    before: Option<FlightRecord>,
    wheels: [JointTurn; 2],
}

/// Whether a wheel turned in its direction, as far as its voltage should have turned it.
fn is_right(turn: JointTurn, direction: f64) -> bool {
    let (counted, by_voltage) = (direction * turn.counted, direction * turn.by_voltage);
    counted > LEAST_RAD && (counted - by_voltage).abs() < SHARE * by_voltage
}

impl Turns {
    /// An empty measurement of wheels with such motors under `command`; left and right must turn in `directions`.
    pub(super) fn new(motor: &MotorParameters<f32>, command: DriveCommand, directions: [f64; 2]) -> Self {
        Self {
            command,
            directions,
            motor: JointMotor::new(motor, 0.0),
            before: None,
            wheels: [JointTurn::default(); 2],
        }
    }

    /// Adds the time from the previous tick to this tick, if both were under the command. The stop at the end of a
    /// drive, which may turn the wheels back, does not count.
    pub(super) fn add(&mut self, tick: &FlightRecord) {
        let Some(before) = self.before.replace(*tick) else {
            return;
        };
        let commanded = |tick: &FlightRecord| tick.actuation.enable && tick.command.drive == self.command;
        if !commanded(&before) || !commanded(tick) || tick.tick != before.tick.wrapping_add(1) {
            return;
        }
        for (wheel, motor) in self.wheels.iter_mut().zip([Motor::Left, Motor::Right]) {
            self.motor.add(wheel, motor, &before, tick);
        }
    }

    /// Whether both wheels turned in the required direction, as far as their voltages should have turned them.
    pub(super) fn are_right(&self) -> bool {
        let mut wheels = self.wheels.iter().zip(self.directions);
        wheels.all(|(wheel, direction)| is_right(*wheel, direction))
    }

    /// The measurement as text.
    pub(super) fn text(&self) -> String {
        let [left, right] = self.wheels;
        format!(
            "left {:+.1} rad, by its voltage {:+.1}; right {:+.1} rad, by its voltage {:+.1}",
            left.counted, left.by_voltage, right.counted, right.by_voltage
        )
    }
}

#[cfg(test)]
mod tests {
    use firmware::drive_board::SCALES;
    use model::control::motor::DUTY_FULL_SCALE;

    use super::*;

    /// Three seconds in which a motor's voltage drives its wheel at a steady rate, rad/s, with 1 A. Each wheel's encoder
    /// counts `turns` times that turn.
    fn driven(rate_rad_s: f64, turns: [f64; 2], speed_m_s: f32) -> Turns {
        let mut found = forward();
        let battery_v = 24.0;
        let current_a = 1.0;
        let voltage_v = rate_rad_s * found.motor.back_emf_v_s_per_rad + current_a * found.motor.resistance_ohm;
        let mut tick = FlightRecord::NONE;
        tick.sample.analog.battery_voltage = SCALES.analog.battery_voltage.counts(battery_v) as u16;
        tick.sample.analog.left_current = SCALES.analog.left_current.counts(current_a) as u16;
        tick.sample.analog.right_current = SCALES.analog.right_current.counts(current_a) as u16;
        tick.actuation.enable = true;
        tick.command.drive = DriveCommand::driving(speed_m_s, 0.0);
        for motor in [0, 1] {
            tick.actuation.duty[motor] = (voltage_v / battery_v * f64::from(DUTY_FULL_SCALE)) as i16;
        }
        for n in 0..3000 {
            tick.tick = n;
            tick.sample.time_us = 1000 * u64::from(n);
            for motor in [0, 1] {
                let counts = turns[motor] * rate_rad_s * 1e-3 * f64::from(n) * found.motor.counts_per_rad;
                tick.sample.encoder_counts[motor] = counts as i64;
            }
            found.add(&tick);
        }
        found
    }

    fn forward() -> Turns {
        let motor = firmware::built_in::PARAMETERS.drive_motor;
        Turns::new(&motor, DriveCommand::driving(0.5, 0.0), [1.0; 2])
    }

    /// A wheel that its own voltage turns the wrong way is as wrong as a wheel that another motor's voltage turns the
    /// right way.
    #[test]
    fn a_turn_needs_each_wheel_to_turn_its_own_way() {
        let wheel = |counted, by_voltage| JointTurn { counted, by_voltage };
        for (wheels, right) in [
            ([wheel(-2.0, -2.1), wheel(2.0, 2.1)], true),
            ([wheel(2.0, 2.1), wheel(-2.0, -2.1)], false),
            // Left and right motors are exchanged.
            ([wheel(2.0, -2.1), wheel(-2.0, 2.1)], false),
            ([wheel(-2.0, 2.1), wheel(2.0, -2.1)], false),
        ] {
            let turns = Turns {
                directions: [-1.0, 1.0],
                wheels,
                ..forward()
            };
            assert_eq!(turns.are_right(), right, "{}", turns.text());
        }
    }

    #[test]
    fn wheels_that_turn_as_their_voltages_tell_are_right() {
        for turns in [0.85, 1.0, 1.15] {
            let found = driven(1.5, [turns; 2], 0.5);
            assert!(found.are_right(), "{}", found.text());
        }
    }

    #[test]
    fn exchanged_leads_and_wheels_that_nothing_drives_are_found_on_either_side() {
        for wrong in [-1.0, 0.0, 0.6, 1.4] {
            for turns in [[wrong, 1.0], [1.0, wrong]] {
                let found = driven(1.5, turns, 0.5);
                assert!(!found.are_right(), "{turns:?}: {}", found.text());
            }
        }
    }

    /// A voltage that drives a wheel backward is as wrong as a wheel that turns backward, and so is a voltage that
    /// hardly drives the wheel.
    #[test]
    fn wheels_that_are_driven_backward_or_hardly_are_not_right() {
        for rate_rad_s in [-1.5, 0.1] {
            let found = driven(rate_rad_s, [1.0; 2], 0.5);
            assert!(!found.are_right(), "{}", found.text());
        }
    }

    #[test]
    fn what_is_not_commanded_forward_does_not_count() {
        let found = driven(1.5, [1.0; 2], 0.0);
        assert_eq!(found.text(), forward().text());
    }
}
