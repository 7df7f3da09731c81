//! Limits the power that a braking motor may return to the supply.
//!
//! A motor that brakes returns `V (e - V) / R` while its voltage V lies between 0 and the back-EMF e; outside this
//! interval a braking motor takes power from the supply. The returned power raises the voltage of a full battery and of
//! a supply that takes no current back. Above a voltage halfway between the battery's nominal and its highest voltage,
//! the motors may return less and less power: the vehicle then brakes less. At the highest voltage they may return
//! none. If the supply rises in spite of that, fault BatteryHigh opens the bridges.

use super::motor::MotorLimits;
use crate::bounded::Bounded;
use crate::vehicle::{BatteryParameters, MotorParameters};

/// Power that a motor may return where the limit begins, as a share of the product of its current limit and the nominal
/// voltage. A motor that brakes at its current limit returns most, a quarter of that product, at half the supply
/// voltage.
const RETURN_SHARE: f32 = 0.25;

/// The supply's limit for one kind of motor.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SupplyGuard {
    /// Voltage above which the guard limits the returned power.
    start_v: f32,
    maximum_v: f32,
    w_per_v: f32,
    motor: MotorLimits,
}

impl SupplyGuard {
    /// A guard of this battery against the power that motors with these parameters return.
    pub fn new(battery: &BatteryParameters<f32>, motor: &MotorParameters<f32>) -> Self {
        let start_v = 0.5 * (battery.nominal_v + battery.maximum_v);
        let return_max_w = RETURN_SHARE * motor.current_limit_a * battery.nominal_v;
        Self {
            start_v,
            maximum_v: battery.maximum_v,
            w_per_v: return_max_w / (battery.maximum_v - start_v),
            motor: MotorLimits::new(motor),
        }
    }

    /// Returns the voltage, between `voltage_v` and the back-EMF at the output rate `rate_rad_s`, that is nearest to
    /// `voltage_v` and with which the motor returns no more than the allowed power to a supply of `battery_v`.
    pub fn limit(&self, voltage_v: f32, rate_rad_s: f32, battery_v: f32) -> f32 {
        if battery_v <= self.start_v {
            return voltage_v;
        }
        let return_max_w = (self.w_per_v * (self.maximum_v - battery_v)).bounded(0.0, f32::MAX);
        let (back_emf_v, resistance_ohm) = (self.motor.back_emf_v(rate_rad_s), self.motor.resistance_ohm);
        let returned_w = voltage_v * (back_emf_v - voltage_v) / resistance_ohm;
        if returned_w <= return_max_w {
            return voltage_v;
        }
        // The root of V (e - V) = R P that brakes less. The root exists, because the wanted voltage returns more than
        // P.
        let half_v = 0.5 * back_emf_v;
        let square = half_v * half_v - resistance_ohm * return_max_w;
        let aside_v = square_root::sqrtf(square.bounded(0.0, f32::MAX));
        if back_emf_v < 0.0 {
            half_v - aside_v
        } else {
            half_v + aside_v
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::vehicle::test_vehicle::reference;

    /// Back-EMF of the reference's drive motors, V s per rad at the output.
    const EMF_V_S: f32 = 0.030124 * 43.0;

    fn guard() -> SupplyGuard {
        let vehicle = reference();
        let p = vehicle.parameters();
        SupplyGuard::new(&p.battery, &p.drive_motor)
    }

    fn returned_w(voltage_v: f32, rate_rad_s: f32) -> f32 {
        voltage_v * (EMF_V_S * rate_rad_s - voltage_v) / 0.316
    }

    #[test]
    fn a_supply_in_its_range_bounds_nothing() {
        for voltage_v in [-20.0, 0.0, 5.0, 20.0] {
            for rate_rad_s in [-10.0, 0.0, 10.0] {
                assert_eq!(guard().limit(voltage_v, rate_rad_s, 27.6), voltage_v);
            }
        }
    }

    #[test]
    fn a_motor_returns_less_and_less_up_to_the_highest_voltage_and_then_nothing() {
        for rate_rad_s in [10.0_f32, -10.0] {
            let back_emf_v = EMF_V_S * rate_rad_s;
            let wanted_v = back_emf_v - 5.0 * rate_rad_s.signum();
            for (battery_v, share) in [(27.7, 0.958), (28.8, 0.5), (29.4, 0.25), (30.0, 0.0), (40.0, 0.0)] {
                let found_v = guard().limit(wanted_v, rate_rad_s, battery_v);
                let allowed_w = share * 0.25 * 17.0 * 25.2;
                let expected_w = if returned_w(wanted_v, rate_rad_s) < allowed_w {
                    returned_w(wanted_v, rate_rad_s)
                } else {
                    allowed_w
                };
                let found_w = returned_w(found_v, rate_rad_s);
                assert!(
                    (found_w - expected_w).abs() < 0.5,
                    "{battery_v}: {found_w} {expected_w}"
                );
                // The limited voltage brakes less and never drives.
                let between = |v: f32| v.abs() >= wanted_v.abs() && v.abs() <= back_emf_v.abs() + 1e-3;
                assert!(between(found_v), "{battery_v}: {found_v}");
            }
        }
    }

    /// The guard leaves a voltage that drives the motor, or that takes power from the supply to brake.
    #[test]
    fn what_returns_nothing_is_not_bounded() {
        for battery_v in [29.0, 30.0, 40.0] {
            for (voltage_v, rate_rad_s) in [
                (15.0, 10.0),
                (-1.0, 10.0),
                (-15.0, -10.0),
                (1.0, -10.0),
                (5.0, 0.0),
                (-5.0, 0.0),
            ] {
                assert_eq!(guard().limit(voltage_v, rate_rad_s, battery_v), voltage_v);
            }
        }
    }

    /// Two motors brake a vehicle at their current limit from 2.5 m/s into a full battery: with the guard the supply stays
    /// below its highest voltage, even where it would not without the guard because the battery's resistance is high.
    #[test]
    fn a_full_battery_is_not_driven_over_its_highest_voltage() {
        for resistance_ohm in [0.1_f32, 0.3, 0.6] {
            for guarded in [true, false] {
                let limits = MotorLimits::new(&reference().parameters().drive_motor);
                let (mut filtered_v, mut rate_rad_s, mut highest_v) = (27.5_f32, 10.0_f32, 0.0_f32);
                for _ in 0..3000 {
                    let mut voltage_v = limits.limit(-24.0, rate_rad_s).voltage_v;
                    if guarded {
                        voltage_v = guard().limit(voltage_v, rate_rad_s, filtered_v);
                    }
                    let battery_v = {
                        // Open-circuit voltage plus the rise by the power that both motors return: V = 27.5 + r P / V.
                        let back_w = 2.0 * returned_w(voltage_v, rate_rad_s);
                        let half = 0.5 * 27.5;
                        let square = half * half + resistance_ohm * back_w;
                        half + square_root::sqrtf(square.bounded(0.0, f32::MAX))
                    };
                    // The filter of the voltage measurement, 5 ms.
                    filtered_v += 0.18 * (battery_v - filtered_v);
                    if filtered_v > highest_v {
                        highest_v = filtered_v;
                    }
                    // 13.6 kg on wheels of 0.25 m with the rotors behind their gears: 0.95 kg m^2.
                    let current_a = limits.current_a(voltage_v, rate_rad_s);
                    rate_rad_s += 2.0 * 0.0302 * 43.0 * current_a / 0.95 * 1e-3;
                    if rate_rad_s < 0.1 {
                        break;
                    }
                }
                if guarded {
                    assert!(highest_v < 30.0, "{resistance_ohm}: {highest_v}");
                } else if resistance_ohm > 0.5 {
                    assert!(highest_v > 30.0, "{resistance_ohm}: {highest_v}");
                }
            }
        }
    }
}
