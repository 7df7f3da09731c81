//! The temperature of each bridge's silicon, and the thermal shutdown of a bridge.
//!
//! Two transistors in series carry the motor's current whatever the bridge does. Their resistance grows with their
//! temperature T, and the package on its copper takes the heat to the air:
//!
//! ```text
//! tau T' = R_th R_25 i^2 (1 + a (T - 25)) - (T - T_air)
//! ```
//!
//! `R_th R_25` is chosen so that the silicon reaches [`RATED_C`] at the bridge's continuous current. The air has the
//! highest temperature in which a bridge is rated. The vehicle's own heat model contains no temperature and no
//! resistance; only the rating is common to both models.

use model::sample::MOTORS;
use model::vehicle::MotorParameters;

/// The hottest air in which a bridge is rated, and the silicon's temperature there at the continuous current, C.
const AIR_C: f64 = 60.0;
const RATED_C: f64 = 125.0;
/// Growth of a transistor's resistance relative to 25 C, 1/K: 40 % up to 125 C.
const GROWTH_PER_K: f64 = 0.004;
/// Temperature at which a driver shuts down, the lowest that makers specify, and the hysteresis below it at which the
/// driver starts again, C.
const SHUT_DOWN_C: f64 = 150.0;
const HYSTERESIS_K: f64 = 20.0;

/// Step of the temperatures, s: a tenth of the shortest time constant allowed, less half a tick for the rounding of ticks.
const STEP_S: f64 = 0.0045;

/// The temperatures of the bridges' silicon.
#[derive(Debug, Clone)]
pub(crate) struct BridgeHeat {
    /// `R_th R_25`, K/A^2, and the reciprocal of the time constant, 1/s.
    k_per_a2: [f64; MOTORS],
    per_s: [f64; MOTORS],
    /// Temperatures above the air, K.
    rise_k: [f64; MOTORS],
    /// Integrals of the squared currents since the last step, A^2 s, and the time since then, s.
    squares_a2_s: [f64; MOTORS],
    since_s: f64,
    /// Bridges that have shut down.
    shut: [bool; MOTORS],
}

impl BridgeHeat {
    /// The cold bridges of these motors.
    pub(crate) fn new(motors: [&MotorParameters<f64>; MOTORS]) -> Self {
        let rated = (RATED_C - AIR_C) / (1.0 + GROWTH_PER_K * (RATED_C - 25.0));
        Self {
            k_per_a2: motors.map(|motor| rated / (motor.bridge_continuous_a * motor.bridge_continuous_a)),
            per_s: motors.map(|motor| 1.0 / motor.bridge_time_constant_s),
            rise_k: [0.0; MOTORS],
            squares_a2_s: [0.0; MOTORS],
            since_s: 0.0,
            shut: [false; MOTORS],
        }
    }

    /// Adds the currents of `dt_s` seconds. Returns whether any bridge is near or beyond its shutdown, which
    /// [`BridgeHeat::shut_down`] then checks.
    #[inline]
    pub(crate) fn follow(&mut self, dt_s: f64, current_a: [f64; MOTORS]) -> bool {
        for (squares, current_a) in self.squares_a2_s.iter_mut().zip(current_a) {
            *squares += current_a * current_a * dt_s;
        }
        self.since_s += dt_s;
        if self.since_s < STEP_S {
            return false;
        }
        self.warm()
    }

    /// Updates the temperatures with the currents since the last step.
    #[inline(never)]
    fn warm(&mut self) -> bool {
        let mut hottest_k = 0.0_f64;
        for (i, rise_k) in self.rise_k.iter_mut().enumerate() {
            let growth = 1.0 + GROWTH_PER_K * (AIR_C - 25.0 + *rise_k);
            let brought_k_s = self.k_per_a2[i] * self.squares_a2_s[i] * growth;
            *rise_k += self.per_s[i] * (brought_k_s - *rise_k * self.since_s);
            hottest_k = hottest_k.max(*rise_k);
        }
        self.squares_a2_s = [0.0; MOTORS];
        self.since_s = 0.0;
        hottest_k > SHUT_DOWN_C - HYSTERESIS_K - AIR_C || self.any_shut()
    }

    /// Updates and returns the bridges that have shut down, from their temperatures.
    #[cold]
    pub(crate) fn shut_down(&mut self) -> [bool; MOTORS] {
        for (shut, rise_k) in self.shut.iter_mut().zip(self.rise_k) {
            let limit_c = if *shut { SHUT_DOWN_C - HYSTERESIS_K } else { SHUT_DOWN_C };
            *shut = AIR_C + rise_k > limit_c;
        }
        self.shut
    }

    /// Whether any bridge has shut down.
    #[inline]
    pub(crate) fn any_shut(&self) -> bool {
        self.shut != [false; MOTORS]
    }

    /// The temperatures of the silicon, C.
    #[cfg(test)]
    fn temperatures_c(&self) -> [f64; MOTORS] {
        self.rise_k.map(|rise_k| AIR_C + rise_k)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tests::reference_vehicle;

    fn heat() -> BridgeHeat {
        let mut motor = reference_vehicle().parameters().drive_motor;
        (motor.bridge_continuous_a, motor.bridge_time_constant_s) = (10.0, 3.0);
        BridgeHeat::new([&motor; MOTORS])
    }

    fn run(heat: &mut BridgeHeat, ms: u32, current_a: [f64; MOTORS]) {
        for _ in 0..ms {
            if heat.follow(1e-3, current_a) {
                heat.shut_down();
            }
        }
    }

    /// The rated current leads to the rated temperature. At a smaller current the rise falls by more than the square
    /// of the current, because the resistance falls with the temperature.
    #[test]
    fn the_continuous_current_keeps_the_silicon_at_its_rating() {
        let mut heat = heat();
        run(&mut heat, 60_000, [10.0, 5.0, 0.0]);
        let [rated_c, half_c, still_c] = heat.temperatures_c();
        assert!((rated_c - 125.0).abs() < 0.01, "{rated_c}");
        assert!(half_c > 60.0 && half_c - 60.0 < 65.0 / 4.0, "{half_c}");
        assert_eq!(still_c, 60.0);
        assert!(!heat.any_shut());
    }

    /// The equation is linear in T: `T_air + T_end (1 - exp(-t (1 - a k i^2) / tau))`.
    #[test]
    fn too_much_current_shuts_down_when_the_closed_form_says_and_only_its_own_bridge() {
        let (k, i2) = (65.0 / 1.4 / 100.0, 16.0 * 16.0);
        let slowed = 1.0 - 0.004 * k * i2;
        let end_k = 1.14 * k * i2 / slowed;
        let expected_s = -3.0 / slowed * f64::ln(1.0 - 90.0 / end_k);
        let mut heat = heat();
        let mut ms = 0;
        while !heat.any_shut() {
            run(&mut heat, 1, [3.0, -16.0, 3.0]);
            ms += 1;
            assert!(ms < 100_000, "it shuts down");
        }
        assert!(
            (1e-3 * f64::from(ms) - expected_s).abs() < 0.005,
            "{ms} ms, {expected_s} s"
        );
        assert_eq!(heat.shut, [false, true, false]);
        // The bridge starts again once it has cooled by the hysteresis.
        run(&mut heat, 100, [0.0; MOTORS]);
        assert!(heat.any_shut());
        let cooled_ms = (3000.0 * f64::ln(90.0 / 70.0)) as u32;
        run(&mut heat, cooled_ms - 110, [0.0; MOTORS]);
        assert!(heat.any_shut());
        run(&mut heat, 20, [0.0; MOTORS]);
        assert!(!heat.any_shut());
    }
}
