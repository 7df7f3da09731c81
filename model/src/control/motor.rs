//! From wanted motor voltages to duties: current limit, supply limit, battery compensation.

use crate::bounded::Bounded;
use crate::vehicle::MotorParameters;

/// Full scale of a duty count.
pub const DUTY_FULL_SCALE: f32 = 32767.0;

/// The limits of one motor.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MotorLimits {
    /// Back-EMF per rad/s at the gearbox output.
    back_emf_v_s_per_rad: f32,
    /// Voltage across the armature at the current limit.
    current_v: f32,
    pub(super) resistance_ohm: f32,
}

/// A voltage within a motor's limits, and whether the current limit changed it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LimitedVoltage {
    /// Voltage, V.
    pub voltage_v: f32,
    /// Whether the current limit changed the voltage.
    pub by_current: bool,
}

impl MotorLimits {
    /// The limits of a motor of these parameters.
    pub fn new(motor: &MotorParameters<f32>) -> Self {
        Self {
            back_emf_v_s_per_rad: motor.back_emf_constant_v_s_per_rad * motor.gear_ratio,
            current_v: motor.current_limit_a * motor.resistance_ohm,
            resistance_ohm: motor.resistance_ohm,
        }
    }

    /// Bounds `wanted_v` so that the steady current at the output rate `rate_rad_s` stays within the
    /// limit. Inductance is neglected: its time constant is a quarter of a tick.
    pub fn limit(&self, wanted_v: f32, rate_rad_s: f32) -> LimitedVoltage {
        let back_emf_v = self.back_emf_v(rate_rad_s);
        let voltage_v = wanted_v.bounded(back_emf_v - self.current_v, back_emf_v + self.current_v);
        LimitedVoltage {
            voltage_v,
            by_current: voltage_v != wanted_v,
        }
    }

    /// The same limits with a share of the current limit, 0 to 1.
    #[must_use]
    pub fn with_share(self, share: f32) -> Self {
        Self {
            current_v: self.current_v * share,
            ..self
        }
    }

    /// Bounds the voltages of the two drive motors, left and right, each by its limits at its output rate. If a limit
    /// reduces the sum, the motor with room left makes up for the loss: the sum controls the arm and the speed and has
    /// priority over the difference, which steers. Neither voltage leaves its motor's limits, so a spinning vehicle is
    /// braked and never spun faster.
    pub fn limit_pair(limits: [Self; 2], wanted_v: [f32; 2], rate_rad_s: [f32; 2]) -> [LimitedVoltage; 2] {
        let [left_limits, right_limits] = limits;
        let [wanted_left_v, wanted_right_v] = wanted_v;
        let [left_rad_s, right_rad_s] = rate_rad_s;
        let left = left_limits.limit(wanted_left_v, left_rad_s);
        let right = right_limits.limit(wanted_right_v, right_rad_s);
        if !left.by_current && !right.by_current {
            return [left, right];
        }
        let lost_v = (wanted_left_v - left.voltage_v) + (wanted_right_v - right.voltage_v);
        // A motor at the limit that reduced the sum has no room in that direction, so at most one of the two voltages
        // changes.
        [
            LimitedVoltage {
                voltage_v: left_limits.limit(left.voltage_v + lost_v, left_rad_s).voltage_v,
                ..left
            },
            LimitedVoltage {
                voltage_v: right_limits.limit(right.voltage_v + lost_v, right_rad_s).voltage_v,
                ..right
            },
        ]
    }

    /// Residual of the armature equation: applied voltage less resistance drop and back-EMF, V. The residual is near 0
    /// while encoder and current sensor are right.
    pub fn residual_v(&self, voltage_v: f32, current_a: f32, rate_rad_s: f32) -> f32 {
        voltage_v - self.drop_v(current_a) - self.back_emf_v(rate_rad_s)
    }

    /// Back-EMF at the output rate `rate_rad_s`, V.
    pub fn back_emf_v(&self, rate_rad_s: f32) -> f32 {
        self.back_emf_v_s_per_rad * rate_rad_s
    }

    /// Steady current that `voltage_v` drives at the output rate `rate_rad_s`, A.
    pub fn current_a(&self, voltage_v: f32, rate_rad_s: f32) -> f32 {
        (voltage_v - self.back_emf_v(rate_rad_s)) / self.resistance_ohm
    }

    /// Voltage drop of the current across the armature, V.
    pub fn drop_v(&self, current_a: f32) -> f32 {
        self.resistance_ohm * current_a
    }
}

/// The duty that gives `voltage_v` from a supply of `battery_v`, within `duty_max` of it
/// ([`BoardScales::duty_max`](crate::board::BoardScales::duty_max)) either way.
///
/// ```
/// use model::control::motor::duty;
/// assert_eq!(duty(12.0, 24.0, 0.75), 16384);
/// assert_eq!(duty(-12.0, 24.0, 0.75), -16384);
/// assert_eq!(duty(100.0, 24.0, 0.75), 24575);
/// assert_eq!(duty(1.0, 0.0, 0.75), 0);
/// ```
pub fn duty(voltage_v: f32, battery_v: f32, duty_max: f32) -> i16 {
    if battery_v <= 1.0 {
        return 0;
    }
    let share = (voltage_v / battery_v).bounded(-duty_max, duty_max);
    let scaled = share * DUTY_FULL_SCALE;
    // Rounds half away from zero; `as` saturates and gives 0 for NaN.
    (scaled + if scaled < 0.0 { -0.5 } else { 0.5 }) as i16
}

/// The voltage that `duty` counts give from a supply of `battery_v`.
pub fn voltage(duty: i16, battery_v: f32) -> f32 {
    f32::from(duty) / DUTY_FULL_SCALE * battery_v
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn the_current_limit_bounds_both_ways_around_the_back_emf() {
        let limits = MotorLimits {
            back_emf_v_s_per_rad: 1.3,
            current_v: 5.0,
            resistance_ohm: 0.3,
        };
        for (wanted, rate, voltage, by_current) in [
            (24.0, 0.0, 5.0, true),
            (-24.0, 0.0, -5.0, true),
            (14.0, 10.0, 14.0, false),
            (24.0, 10.0, 18.0, true),
            (0.0, 10.0, 8.0, true),
        ] {
            assert_eq!(
                limits.limit(wanted, rate),
                LimitedVoltage {
                    voltage_v: voltage,
                    by_current
                }
            );
        }
    }

    #[test]
    fn at_the_current_limit_the_drive_motors_keep_their_sum_before_their_difference() {
        let limits = MotorLimits {
            back_emf_v_s_per_rad: 1.0,
            current_v: 5.0,
            resistance_ohm: 0.3,
        };
        for (wanted_v, rate_rad_s, found_v) in [
            // No limit acts.
            ([1.0, 4.0], [0.0, 0.0], [1.0, 4.0]),
            // Steering exceeds the right motor's limit: the left motor makes up for the sum, and the difference
            // shrinks.
            ([2.0, 6.0], [0.0, 0.0], [3.0, 5.0]),
            ([-6.5, -2.0], [0.0, 0.0], [-5.0, -3.5]),
            // Limits about the back-EMF of a turn.
            ([-1.0, 9.0], [-2.0, 2.0], [1.0, 7.0]),
            // Braking a spin: both limits reduce the difference and leave the sum.
            ([8.0, -8.0], [-20.0, 20.0], [-15.0, 15.0]),
            ([-8.0, 8.0], [20.0, -20.0], [15.0, -15.0]),
            ([9.0, -5.0], [-20.0, 20.0], [-15.0, 19.0]),
            ([7.0, -9.0], [-3.0, 3.0], [-0.0, -2.0]),
            // The sum alone exceeds both limits.
            ([4.0, 9.0], [0.0, 0.0], [5.0, 5.0]),
            ([8.0, 9.0], [0.0, 0.0], [5.0, 5.0]),
        ] {
            let found = MotorLimits::limit_pair([limits; 2], wanted_v, rate_rad_s);
            assert_eq!(found.map(|limited| limited.voltage_v), found_v, "{wanted_v:?}");
        }
        let [left, right] = MotorLimits::limit_pair([limits; 2], [2.0, 6.0], [0.0, 0.0]);
        assert!(!left.by_current && right.by_current);
        // A hot left motor may use half of its limit: the right motor makes up for the rest, up to its own limit.
        let found = MotorLimits::limit_pair([limits.with_share(0.5), limits], [4.0, 3.0], [0.0, 0.0]);
        assert_eq!(found.map(|limited| limited.voltage_v), [2.5, 4.5]);
    }

    proptest! {
        /// For any wanted voltages both motors stay within their current limits, and the sum is kept wherever the
        /// motors can give it.
        #[test]
        fn the_pair_stays_within_the_limits_and_keeps_the_sum_where_it_can(
            left_v in -30.0_f32..30.0, right_v in -30.0_f32..30.0,
            left_rad_s in -30.0_f32..30.0, right_rad_s in -30.0_f32..30.0,
        ) {
            let limits = MotorLimits { back_emf_v_s_per_rad: 1.0, current_v: 5.0, resistance_ohm: 0.3 };
            let [left, right] = MotorLimits::limit_pair([limits; 2], [left_v, right_v], [left_rad_s, right_rad_s]);
            for (limited, rate) in [(left, left_rad_s), (right, right_rad_s)] {
                prop_assert!((limited.voltage_v - rate).abs() <= 5.0 + 1e-4, "{limited:?} at {rate} rad/s");
            }
            let emf = left_rad_s + right_rad_s;
            let feasible = (left_v + right_v).bounded(emf - 10.0, emf + 10.0);
            prop_assert!((left.voltage_v + right.voltage_v - feasible).abs() < 1e-3, "{left:?} {right:?}");
            // The difference lies between the wanted difference and the wheels' own back-EMF difference: no spin is
            // driven further.
            let (wanted, made) = (right_v - left_v, right_rad_s - left_rad_s);
            let given = right.voltage_v - left.voltage_v;
            prop_assert!(
                given >= wanted.min(made) - 1e-3 && given <= wanted.max(made) + 1e-3,
                "{given} of {wanted} and {made}"
            );
        }
    }

    #[test]
    fn duty_and_voltage_are_inverse_to_half_a_count() {
        for k in -100..=100 {
            let v = 0.2 * k as f32;
            assert!(
                (voltage(duty(v, 25.0, 1.0), 25.0) - v).abs() <= 0.5 * 25.0 / DUTY_FULL_SCALE + 1e-5,
                "{v}"
            );
        }
        assert_eq!(duty(f32::NAN, 24.0, 1.0), 0);
    }
}
