//! Rules for fields that follow from other fields when a vehicle file leaves them out.
//!
//! The yaw loop turns a vehicle on the spot by a voltage difference `v` of its motors: `J psi'' = b v - D psi'`, with the
//! inertia J that the motors turn, the torque b per volt about the vertical, and the drag D of back-EMF and bearings
//! ([`TurningDrive`]). The gains follow from the crossover: the angular frequency at which the loop with the proportional
//! gain alone, `kp b / (J s)`, has the gain 1.

use super::fields::{LeftOut, Rule};
use super::{Field, VehicleParameters};

/// Share of the supply that a bridge gives, for rules and analyses of a vehicle without a board. Each board states its own
/// largest duty; the firmware does not compile for a board that differs (`firmware/src/drive_board.rs`).
pub const BRIDGE_SHARE: f64 = 0.94;
/// Largest product of the crossover and the time constant of a free rotor, rad. In the play of the gears a rotor follows the
/// voltage with that time constant, and its encoder shows a turn that the wheel does not make. Beyond twice this
/// product, the reference vehicle with 1 deg of play chatters between the flanks.
const YAW_PLAY_SHARE: f64 = 0.49;
/// Lag of the yaw loop in addition to the motor's, s: 0.9 ms of the gyro's 250 Hz filter, half a tick of 1 ms for the age
/// of its sample, one tick until the voltage reaches the bridge, and half a tick because the bridge holds the voltage for
/// a tick.
const LAG_S: f64 = 0.0029;
/// Largest product of crossover and lag, rad: the lag's share of the phase margin, 20 deg.
const YAW_LAG_SHARE: f64 = 0.35;
/// Ratio of the integral's corner frequency to the crossover: the integral takes 13 deg of the phase margin.
const INTEGRAL_SHARE: f64 = 0.24;
/// Ratio of the heading hold's pole to the crossover: six times slower than the integral's corner, so the two do not
/// interact.
const HEADING_SHARE: f64 = 0.038;

/// The vehicle's turn on the spot, as seen by its motors.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TurningDrive {
    /// Inertia about the vertical, including wheels and rotors, kg m^2.
    pub inertia_kg_m2: f64,
    /// Torque about the vertical for one volt more at the right motor and one volt less at the left motor, N m/V.
    pub torque_per_volt_n_m_per_v: f64,
    /// Electrical time constant of a motor, s.
    pub electrical_s: f64,
    /// Time constant with which a rotor follows the voltage in the play of its gears, s.
    pub free_rotor_s: f64,
}

impl TurningDrive {
    /// The turning drive of a vehicle with these parameters.
    pub fn new(parameters: &VehicleParameters<f64>) -> Self {
        let (body, motor) = (&parameters.body, &parameters.drive_motor);
        let wheel_turn = body.half_track_m / body.wheel_radius_m;
        let rotors_kg_m2 = 2.0 * motor.rotor_inertia_kg_m2 * motor.gear_ratio * motor.gear_ratio;
        let wheels_kg = body.total_mass_kg - body.arm_mass_kg;
        Self {
            inertia_kg_m2: body.yaw_inertia_kg_m2
                + wheels_kg * body.half_track_m * body.half_track_m
                + (body.wheels_inertia_kg_m2 + rotors_kg_m2) * wheel_turn * wheel_turn,
            torque_per_volt_n_m_per_v: 2.0 * wheel_turn * motor.torque_constant_n_m_per_a * motor.gear_ratio
                / motor.resistance_ohm,
            electrical_s: motor.inductance_h / motor.resistance_ohm,
            free_rotor_s: motor.free_rotor_s(),
        }
    }

    /// The yaw loop's crossover by rule, rad/s.
    pub fn crossover_rad_s(&self) -> f64 {
        (YAW_PLAY_SHARE / self.free_rotor_s).min(YAW_LAG_SHARE / (LAG_S + self.electrical_s))
    }

    /// The smaller of the crossover with this gain, V s/rad, and the crossover by rule, rad/s.
    fn crossover_with_rad_s(&self, kp_v_s_per_rad: f64) -> f64 {
        let crossover_rad_s = kp_v_s_per_rad * self.torque_per_volt_n_m_per_v / self.inertia_kg_m2;
        self.crossover_rad_s().min(crossover_rad_s)
    }
}

impl VehicleParameters<f64> {
    /// Sets every field that has a rule and is `left_out` to its rule's value, rounded to two digits and within the
    /// field's range.
    ///
    /// A rule reads the file's values, and the rules' values of earlier fields. If the other values do not describe a
    /// vehicle, the field gets a value within its range, and [`Vehicle::new`](super::Vehicle::new) reports the wrong
    /// value.
    pub fn follow_rules(&mut self, left_out: impl Fn(&str, &Field) -> bool) {
        for number in 0..self.count() {
            if let Some((table, field)) = self.field(number)
                && let LeftOut::Rule(rule) = field.left_out
                && left_out(table, field)
            {
                let value = two_digits(self.by_rule(rule).max(field.min).min(field.max));
                // The bounds of the range have two digits or fewer, so the value stays within the range.
                let _ = self.set(number, value);
            }
        }
    }

    fn by_rule(&self, rule: Rule) -> f64 {
        let (turning, kp_v_s_per_rad) = (TurningDrive::new(self), self.control.yaw_kp_v_s_per_rad);
        match rule {
            Rule::YawGain => turning.crossover_rad_s() * turning.inertia_kg_m2 / turning.torque_per_volt_n_m_per_v,
            Rule::YawIntegral => INTEGRAL_SHARE * turning.crossover_with_rad_s(kp_v_s_per_rad) * kp_v_s_per_rad,
            Rule::HeadingGain => HEADING_SHARE * turning.crossover_with_rad_s(kp_v_s_per_rad),
            Rule::BridgeVoltage => BRIDGE_SHARE * self.battery.nominal_v,
        }
    }
}

/// The value rounded to two digits, as a person would write it. No input is known to three digits.
fn two_digits(value: f64) -> f64 {
    /// No field's range exceeds this many powers of ten.
    const POWERS: usize = 12;
    let (mut up, mut down) = (1.0, 1.0);
    for _ in 0..POWERS {
        if value * up < 10.0 {
            up *= 10.0;
        } else if value / down >= 100.0 {
            down *= 10.0;
        }
    }
    libm::round(value * up / down) * down / up
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::vehicle::test_vehicle::reference;

    #[test]
    fn a_value_is_rounded_to_two_digits() {
        for (value, rounded) in [
            (3.969, 4.0),
            (0.0, 0.0),
            (0.012_34, 0.012),
            (0.3949, 0.39),
            (9.96, 10.0),
            (99.4, 99.0),
            (114.9, 110.0),
            (500.0, 500.0),
        ] {
            assert_eq!(two_digits(value), rounded, "{value}");
        }
    }

    /// For the reference vehicle, the rules give the gains that were tuned by hand.
    #[test]
    fn the_rule_gives_the_reference_vehicle_the_gains_that_it_was_tuned_to() {
        let mut parameters = reference().parameters().cast::<f64>();
        parameters.control.yaw_kp_v_s_per_rad = 0.0;
        parameters.follow_rules(|_, _| true);
        let control = &parameters.control;
        assert_eq!(
            [
                control.yaw_kp_v_s_per_rad,
                control.yaw_ki_v_per_rad,
                control.heading_kp_per_s
            ],
            [4.0, 100.0, 4.0]
        );
        assert_eq!(control.ballast_voltage_max_v, 24.0);
    }

    #[test]
    fn what_is_given_stays_and_the_others_go_with_it() {
        let mut parameters = reference().parameters().cast::<f64>();
        parameters.control.yaw_kp_v_s_per_rad = 2.0;
        parameters.follow_rules(|_, field| field.name != "yaw_kp_v_s_per_rad");
        let control = &parameters.control;
        assert_eq!((control.yaw_kp_v_s_per_rad, control.heading_kp_per_s), (2.0, 2.0));
        // Half the gain halves the corner.
        assert_eq!(control.yaw_ki_v_per_rad, 25.0);
    }

    /// The phase, rad, and the gain of the yaw loop, its heading hold included, at `w` rad/s.
    fn loop_at(parameters: &VehicleParameters<f64>, w: f64) -> (f64, f64) {
        let (turning, control) = (TurningDrive::new(parameters), &parameters.control);
        let motor = &parameters.drive_motor;
        let wheel_turn = parameters.body.half_track_m / parameters.body.wheel_radius_m;
        let feed_forward = motor.back_emf_constant_v_s_per_rad * motor.gear_ratio * wheel_turn;
        let torque = turning.torque_per_volt_n_m_per_v;
        // [(kp + ki/s) (1 + h/s) + f h/s] b e^(-lag s) / ((J s + b f) (1 + s L/R)), each factor by its angle and
        // magnitude.
        let (kp, ki, h) = (
            control.yaw_kp_v_s_per_rad,
            control.yaw_ki_v_per_rad,
            control.heading_kp_per_s,
        );
        let factor = |re: f64, im: f64| (libm::atan2(im, re), libm::hypot(re, im));
        let (law_angle, law_gain) = factor(kp - ki * h / (w * w), -(kp * h + ki + feed_forward * h) / w);
        let (drive_angle, drive_gain) = factor(torque * feed_forward, turning.inertia_kg_m2 * w);
        let (electric_angle, electric_gain) = factor(1.0, turning.electrical_s * w);
        (
            law_angle - drive_angle - electric_angle - LAG_S * w,
            law_gain * torque / (drive_gain * electric_gain),
        )
    }

    proptest! {
        /// Vehicles from toys to carts: at every frequency with the loop gain 1 the phase margin is 45 deg or more, and
        /// where the phase reaches -180 deg the gain is at most a half.
        #[test]
        fn the_yaw_loop_keeps_its_margins_on_any_vehicle(
            radius_m in 0.03_f64..0.5, density in 0.3_f64..3.0, arm_share in 0.5_f64..0.95, track in 0.5_f64..2.0,
            spread in 0.2_f64..1.0, constant in 0.005_f64..0.1, resistance_ohm in 0.05_f64..5.0, electrical_ms in 0.0_f64..10.0,
            ratio in 5.0_f64..60.0, rotors in 0.0_f64..0.3,
        ) {
            let mut p = reference().parameters().cast::<f64>();
            let mass_kg = 870.0 * density * radius_m * radius_m * radius_m;
            p.body.wheel_radius_m = radius_m;
            p.body.total_mass_kg = mass_kg;
            p.body.arm_mass_kg = arm_share * mass_kg;
            p.body.half_track_m = track * radius_m;
            p.body.yaw_inertia_kg_m2 = mass_kg * (spread * track * radius_m).powi(2);
            p.body.wheels_inertia_kg_m2 = 0.7 * (1.0 - arm_share) * mass_kg * radius_m * radius_m;
            p.drive_motor.torque_constant_n_m_per_a = constant;
            p.drive_motor.back_emf_constant_v_s_per_rad = constant;
            p.drive_motor.resistance_ohm = resistance_ohm;
            p.drive_motor.inductance_h = 0.001 * electrical_ms * resistance_ohm;
            p.drive_motor.gear_ratio = ratio;
            p.drive_motor.rotor_inertia_kg_m2 = rotors * mass_kg * radius_m * radius_m / (ratio * ratio);
            p.follow_rules(|_, _| true);
            let mut last = None;
            for step in 0..4000 {
                let (phase, gain) = loop_at(&p, 0.5 * libm::pow(1.003, f64::from(step)));
                if let Some((last_phase, last_gain)) = last {
                    if last_gain >= 1.0 && gain < 1.0 {
                        prop_assert!(phase > -0.75 * core::f64::consts::PI, "{phase} rad at the crossover");
                    }
                    if last_phase > -core::f64::consts::PI && phase <= -core::f64::consts::PI {
                        prop_assert!(gain < 0.5, "{gain} where the phase turns over");
                    }
                }
                last = Some((phase, gain));
            }
        }
    }
}
