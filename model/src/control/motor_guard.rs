//! How much of its current limit a motor may use: by the heat of its winding, and by the current that is measured.
//!
//! The winding warms with the square of the measured current and cools as it is warm, one time constant for both:
//!
//! ```text
//! tau h' = (i / i_c)^2 - h        h = 1: as warm as the continuous current i_c keeps it
//! ```
//!
//! A winding and a housing have a time constant each; the winding's is shorter. With the winding's constant alone the
//! model is warmer than the motor as long as the motor has not worked for long.

use crate::bounded::Bounded;
use crate::sample::TICK_S;
use crate::vehicle::MotorParameters;

/// Heat below 1 from which on the limit falls, in proportion, to the continuous current at heat 1.
const HEAT_BAND: f32 = 0.1;
/// Heat beyond which the limit does not hold the motor: a fault.
const HEAT_FAULT: f32 = 1.2;
/// Measured current, as a share of what the motor may use, that the armature equation may be wrong by: an armature that is
/// cold, and the sensor's gain.
const EXCESS_ALLOWED: f32 = 1.1;
/// Share of the limit that each tick takes away for an excess of 1: a time constant of 50 ms.
const EXCESS_GAIN: f32 = 0.02;
/// Largest share taken away: twice the current that the equation gives means that something else is wrong.
const EXCESS_MAX: f32 = 0.5;

/// Watches the current of one motor.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MotorGuard {
    per_limit: f32,
    /// Heat per A^2 in a tick, and the share of the heat that goes in a tick.
    warming_per_a2: f32,
    cooling: f32,
    /// The continuous current as a share of the limit.
    continuous_share: f32,
    heat: f32,
    excess: f32,
    share: f32,
}

impl MotorGuard {
    /// A guard for the motor of these parameters, cold.
    pub fn new(motor: &MotorParameters<f32>) -> Self {
        let cooling = TICK_S / motor.winding_time_constant_s;
        let continuous_a = motor.continuous_current_a;
        Self {
            per_limit: 1.0 / motor.current_limit_a,
            warming_per_a2: cooling / (continuous_a * continuous_a),
            cooling,
            continuous_share: (continuous_a / motor.current_limit_a).bounded(0.0, 1.0),
            heat: 0.0,
            excess: 0.0,
            share: 1.0,
        }
    }

    /// This guard, for a motor that is as warm as another guard's.
    #[must_use]
    pub fn as_warm_as(self, other: &Self) -> Self {
        Self {
            heat: other.heat,
            ..self
        }
    }

    /// Takes the measured current of one tick, A.
    pub fn update(&mut self, current_a: f32) {
        self.heat += self.warming_per_a2 * current_a * current_a - self.cooling * self.heat;
        let used = current_a.abs() * self.per_limit;
        if self.share >= 1.0 && used <= EXCESS_ALLOWED && self.heat < 1.0 - HEAT_BAND {
            // As nearly always: nothing to take away.
            return;
        }
        let excess = used - EXCESS_ALLOWED * self.share;
        self.excess = (self.excess + EXCESS_GAIN * excess).bounded(0.0, EXCESS_MAX);
        let room = (1.0 - self.heat) * (1.0 / HEAT_BAND);
        let by_heat = self.continuous_share + (1.0 - self.continuous_share) * room;
        self.share = by_heat.bounded(0.0, 1.0) * (1.0 - self.excess);
    }

    /// Share of its current limit that the motor may use, 0 to 1.
    pub fn share(&self) -> f32 {
        self.share
    }

    /// Whether the winding is so hot that the limit cannot have held.
    pub fn is_overheated(&self) -> bool {
        self.heat > HEAT_FAULT
    }
}

#[cfg(test)]
mod tests {
    extern crate std;

    use super::*;
    use crate::vehicle::test_vehicle::reference;

    fn motor() -> MotorParameters<f32> {
        MotorParameters {
            current_limit_a: 17.0,
            continuous_current_a: 5.8,
            winding_time_constant_s: 40.0,
            ..reference().parameters().drive_motor
        }
    }

    /// Seconds of a constant current until `done`.
    fn seconds_until(guard: &mut MotorGuard, current_a: f32, done: impl Fn(&MotorGuard) -> bool) -> f32 {
        let mut ticks = 0_u32;
        while !done(guard) && ticks < 1_000_000 {
            guard.update(current_a);
            ticks += 1;
        }
        ticks as f32 * TICK_S
    }

    #[test]
    fn the_winding_warms_and_cools_by_its_time_constant() {
        for current_a in [17.0_f32, -17.0, 8.0] {
            let mut guard = MotorGuard::new(&motor());
            let end = (current_a / 5.8) * (current_a / 5.8);
            let expected_s = -40.0 * libm::logf(1.0 - 1.0 / end);
            let found_s = seconds_until(&mut guard, current_a, |guard| guard.heat >= 1.0);
            assert!(
                (found_s - expected_s).abs() < 0.01 * expected_s,
                "{found_s} {expected_s}"
            );
            let cooled_s = seconds_until(&mut guard, 0.0, |guard| guard.heat <= 0.5);
            assert!((cooled_s - 40.0 * libm::logf(2.0)).abs() < 0.3, "{cooled_s}");
        }
    }

    #[test]
    fn the_continuous_current_may_flow_for_ever_and_a_little_less_leaves_the_whole_limit() {
        let mut guard = MotorGuard::new(&motor());
        for _ in 0..600_000 {
            guard.update(5.8);
        }
        assert!((guard.heat - 1.0).abs() < 1e-2 && !guard.is_overheated());
        assert!((guard.share() * 17.0 - 5.8).abs() < 1.0, "{}", guard.share());
        let mut guard = MotorGuard::new(&motor());
        for _ in 0..600_000 {
            guard.update(5.8 * 0.94);
        }
        assert_eq!(guard.share(), 1.0);
    }

    /// Motors whose current is `gain` times what the limit allows, as cold armatures are: always asked for everything.
    #[test]
    fn the_limit_holds_the_heat_of_a_motor_that_is_always_asked_for_everything() {
        for gain in [0.8_f32, 1.0, 1.4] {
            let mut guard = MotorGuard::new(&motor());
            let mut hottest = 0.0_f32;
            let mut last_a = 0.0;
            for tick in 0..600_000 {
                last_a = gain * guard.share() * 17.0;
                guard.update(last_a);
                if guard.heat > hottest {
                    hottest = guard.heat;
                }
                if tick == 500 {
                    // The measured current counts, not the modelled one.
                    assert!(last_a <= EXCESS_ALLOWED * 17.0 + 0.1, "{gain}: {last_a}");
                }
            }
            assert!(hottest < 1.05, "{gain}: {hottest}");
            assert!((last_a - 5.8).abs() < 0.2, "{gain}: {last_a}");
        }
    }

    #[test]
    fn a_current_that_no_limit_holds_is_a_fault_in_time() {
        for (current_a, bound_s) in [(17.0, 6.3), (30.0, 1.9)] {
            let mut guard = MotorGuard::new(&motor());
            let found_s = seconds_until(&mut guard, current_a, MotorGuard::is_overheated);
            assert!(found_s < bound_s && found_s > 0.8 * bound_s, "{current_a}: {found_s}");
        }
    }

    #[test]
    fn what_was_taken_away_for_an_excess_comes_back() {
        let mut guard = MotorGuard::new(&motor());
        for _ in 0..200 {
            guard.update(25.0);
        }
        assert!(guard.share() < 0.7);
        for _ in 0..200 {
            guard.update(2.0);
        }
        assert_eq!(guard.share(), 1.0);
        // Neither 10 % nor the current limit itself is an excess.
        for _ in 0..1000 {
            guard.update(18.6);
        }
        assert_eq!(guard.share(), 1.0);
    }

    #[test]
    fn new_parameters_leave_the_motor_as_warm_as_it_is() {
        let mut warm = MotorGuard::new(&motor());
        for _ in 0..5000 {
            warm.update(17.0);
        }
        let other = MotorGuard::new(&MotorParameters {
            continuous_current_a: 8.0,
            ..motor()
        });
        let mut after = other.as_warm_as(&warm);
        assert_eq!(after.heat, warm.heat);
        after.update(0.0);
        assert!(after.share() < 1.0, "{}", after.heat);
        assert_eq!(MotorGuard::new(&motor()).heat, 0.0);
    }
}
