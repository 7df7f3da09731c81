//! The share of its current limit that a motor may use. The share depends on the heat of the winding, the heat of the
//! bridge, and the measured current.

mod heating;

use heating::{HEAT_TICKS, Heating};

use crate::bounded::Bounded;
use crate::vehicle::MotorParameters;

/// Measured current, as a share of the allowed current, that is no excess: a cold armature and the sensor's gain error
/// make the armature equation wrong by this much.
const EXCESS_ALLOWED: f32 = 1.1;
/// Share of the limit by which each tick reduces it for an excess of 1: a time constant of 50 ms.
const EXCESS_GAIN: f32 = 0.02;
/// Largest reduction. A measured current of twice the armature equation's means that something else is wrong.
const EXCESS_MAX: f32 = 0.5;

/// Watches the current of one motor.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MotorGuard {
    per_limit: f32,
    /// Square of the largest current that does not exceed the whole limit, A^2.
    allowed_a2: f32,
    winding: Heating,
    bridge: Heating,
    /// Sum of the squared currents since the last update of the heats, A^2, and the number of ticks since then.
    squares_a2: f32,
    ticks: u8,
    overheated: bool,
    excess: f32,
    share: f32,
    /// The motor may use its whole limit, and this stays true until the next update of the heats.
    whole: bool,
}

impl MotorGuard {
    /// A guard for the motor with these parameters and for its bridge, both cold. Guards with different `phase`s (0 to
    /// 3) update their heats in different ticks.
    // Keeps one copy in the flash instead of one copy per motor.
    #[inline(never)]
    pub fn new(motor: &MotorParameters<f32>, phase: u8) -> Self {
        let limit_a = motor.current_limit_a;
        let heating = |continuous_a, time_constant_s| Heating::new(continuous_a, time_constant_s, limit_a);
        let allowed_a = EXCESS_ALLOWED * limit_a;
        Self {
            per_limit: 1.0 / limit_a,
            allowed_a2: allowed_a * allowed_a,
            winding: heating(motor.continuous_current_a, motor.winding_time_constant_s),
            bridge: heating(motor.bridge_continuous_a, motor.bridge_time_constant_s),
            squares_a2: 0.0,
            ticks: phase,
            overheated: false,
            excess: 0.0,
            share: 1.0,
            whole: true,
        }
    }

    /// This guard with the heats of another guard's motor and bridge.
    #[must_use]
    #[inline(never)]
    pub fn as_warm_as(self, other: &Self) -> Self {
        Self {
            winding: self.winding.as_warm_as(&other.winding),
            bridge: self.bridge.as_warm_as(&other.bridge),
            overheated: other.overheated,
            whole: false,
            ..self
        }
    }

    /// Updates the guard with the measured current of one tick, A.
    #[inline]
    pub fn update(&mut self, current_a: f32) {
        let square_a2 = current_a * current_a;
        self.squares_a2 += square_a2;
        self.ticks += 1;
        if self.ticks >= HEAT_TICKS {
            self.warm();
        }
        if self.whole && square_a2 <= self.allowed_a2 {
            // The usual case: nothing to reduce.
            return;
        }
        self.bound(current_a.abs());
    }

    /// Updates the heats with the currents of the last ticks.
    fn warm(&mut self) {
        self.winding.update(self.squares_a2);
        self.bridge.update(self.squares_a2);
        self.squares_a2 = 0.0;
        self.ticks = 0;
        self.overheated = self.winding.is_overheated() || self.bridge.is_overheated();
        self.whole = self.is_whole();
    }

    /// Whether neither heat nor excess current bounds the motor, and neither heat is close to doing so.
    fn is_whole(&self) -> bool {
        self.share >= 1.0 && self.winding.is_cool() && self.bridge.is_cool()
    }

    /// The share of the limit that the heats and the excess leave.
    #[inline(never)]
    fn bound(&mut self, current_a: f32) {
        let excess = current_a * self.per_limit - EXCESS_ALLOWED * self.share;
        self.excess = (self.excess + EXCESS_GAIN * excess).bounded(0.0, EXCESS_MAX);
        let (winding, bridge) = (self.winding.share(), self.bridge.share());
        let by_heat = if winding < bridge { winding } else { bridge };
        self.share = by_heat * (1.0 - self.excess);
        self.whole = self.is_whole();
    }

    /// Share of its current limit that the motor may use, 0 to 1.
    pub fn share(&self) -> f32 {
        self.share
    }

    /// Whether the winding or the bridge is so hot that the limit must have failed.
    #[inline]
    pub fn is_overheated(&self) -> bool {
        self.overheated
    }

    /// Whether the winding is so hot that the limit must have failed.
    pub fn winding_is_overheated(&self) -> bool {
        self.winding.is_overheated()
    }

    /// Whether the bridge is so hot that the limit must have failed.
    pub fn bridge_is_overheated(&self) -> bool {
        self.bridge.is_overheated()
    }
}

#[cfg(test)]
mod tests {
    extern crate std;

    use super::*;
    use crate::sample::TICK_S;
    use crate::vehicle::test_vehicle::reference;

    fn motor() -> MotorParameters<f32> {
        MotorParameters {
            current_limit_a: 17.0,
            continuous_current_a: 5.8,
            winding_time_constant_s: 40.0,
            bridge_continuous_a: 60.0,
            bridge_time_constant_s: 3.0,
            ..reference().parameters().drive_motor
        }
    }

    fn guard() -> MotorGuard {
        MotorGuard::new(&motor(), 0)
    }

    /// Seconds of constant current until `done` is true.
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
            let mut guard = self::guard();
            let end = (current_a / 5.8) * (current_a / 5.8);
            let expected_s = -40.0 * libm::logf(1.0 - 1.0 / end);
            let found_s = seconds_until(&mut guard, current_a, |guard| guard.winding.heat >= 1.0);
            assert!(
                (found_s - expected_s).abs() < 0.01 * expected_s,
                "{found_s} {expected_s}"
            );
            let cooled_s = seconds_until(&mut guard, 0.0, |guard| guard.winding.heat <= 0.5);
            assert!((cooled_s - 40.0 * libm::logf(2.0)).abs() < 0.3, "{cooled_s}");
        }
    }

    #[test]
    fn the_continuous_current_may_flow_for_ever_and_a_little_less_leaves_the_whole_limit() {
        let mut guard = self::guard();
        for _ in 0..600_000 {
            guard.update(5.8);
        }
        assert!((guard.winding.heat - 1.0).abs() < 1e-2 && !guard.winding_is_overheated());
        assert!((guard.share() * 17.0 - 5.8).abs() < 1.0, "{}", guard.share());
        let mut guard = self::guard();
        for _ in 0..600_000 {
            guard.update(5.8 * 0.94);
        }
        assert_eq!(guard.share(), 1.0);
    }

    /// Motors whose current is `gain` times the allowed current, as with cold armatures, and which are always
    /// commanded to the limit.
    #[test]
    fn the_limit_holds_the_heat_of_a_motor_that_is_always_asked_for_everything() {
        for gain in [0.8_f32, 1.0, 1.4] {
            let mut guard = self::guard();
            let mut hottest = 0.0_f32;
            let mut last_a = 0.0;
            for tick in 0..600_000 {
                last_a = gain * guard.share() * 17.0;
                guard.update(last_a);
                if guard.winding.heat > hottest {
                    hottest = guard.winding.heat;
                }
                if tick == 500 {
                    // The guard acts on the measured current, not on the modelled current.
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
            let mut guard = self::guard();
            let found_s = seconds_until(&mut guard, current_a, MotorGuard::winding_is_overheated);
            assert!(found_s < bound_s && found_s > 0.8 * bound_s, "{current_a}: {found_s}");
        }
    }

    #[test]
    fn what_was_taken_away_for_an_excess_comes_back() {
        let mut guard = self::guard();
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
        let mut warm = self::guard();
        for _ in 0..5000 {
            warm.update(17.0);
        }
        let other = MotorGuard::new(
            &MotorParameters {
                continuous_current_a: 8.0,
                ..motor()
            },
            0,
        );
        let mut after = other.as_warm_as(&warm);
        assert_eq!(after.winding.heat, warm.winding.heat);
        after.update(0.0);
        assert!(after.share() < 1.0, "{}", after.winding.heat);
        assert_eq!(self::guard().winding.heat, 0.0);
    }

    /// A motor whose bridge withstands less current than its winding.
    fn weak_bridge() -> MotorParameters<f32> {
        MotorParameters {
            bridge_continuous_a: 4.0,
            ..motor()
        }
    }

    /// The exact solution: h = (i / i_c)^2 (1 - exp(-t / tau)).
    #[test]
    fn a_bridge_warms_in_seconds_and_bounds_the_current_before_the_winding_does() {
        for current_a in [17.0_f32, -8.0, 5.0] {
            let mut guard = MotorGuard::new(&weak_bridge(), 0);
            let end = (current_a / 4.0) * (current_a / 4.0);
            let expected_s = -3.0 * libm::logf(1.0 - 0.9 / end);
            let found_s = seconds_until(&mut guard, current_a, |guard| guard.share() < 1.0);
            assert!(
                (found_s - expected_s).abs() < 0.01 * expected_s + f32::from(HEAT_TICKS) * TICK_S,
                "{found_s} {expected_s}"
            );
            assert!(guard.winding.heat < 0.9);
            let cools_s = 3.0 * libm::logf(guard.bridge.heat / 0.45);
            let cooled_s = seconds_until(&mut guard, 0.0, |guard| guard.bridge.heat <= 0.45);
            assert!((cooled_s - cools_s).abs() < 0.02, "{cooled_s} {cools_s}");
        }
    }

    /// The same as for the winding, within the time that a bridge has: cold armatures, always commanded to the limit.
    #[test]
    fn the_limit_holds_the_heat_of_a_bridge_that_is_always_asked_for_everything() {
        for gain in [0.8_f32, 1.0, 1.4] {
            let mut guard = MotorGuard::new(&weak_bridge(), 0);
            let (mut hottest, mut last_a) = (0.0_f32, 0.0);
            for _ in 0..30_000 {
                last_a = gain * guard.share() * 17.0;
                guard.update(last_a);
                if guard.bridge.heat > hottest {
                    hottest = guard.bridge.heat;
                }
            }
            assert!(hottest < 1.05 && !guard.bridge_is_overheated(), "{gain}: {hottest}");
            assert!((last_a - 4.0).abs() < 0.2, "{gain}: {last_a}");
        }
    }

    #[test]
    fn a_current_that_no_limit_holds_overheats_the_bridge_in_time() {
        let mut guard = MotorGuard::new(&weak_bridge(), 0);
        let expected_s = -3.0 * libm::logf(1.0 - 1.2 * 16.0 / (8.0 * 8.0));
        let found_s = seconds_until(&mut guard, 8.0, MotorGuard::bridge_is_overheated);
        assert!((found_s - expected_s).abs() < 0.01, "{found_s} {expected_s}");
        assert!(!guard.winding_is_overheated());
    }

    #[test]
    fn new_parameters_leave_the_bridge_as_warm_as_it_is() {
        let mut warm = MotorGuard::new(&weak_bridge(), 0);
        for _ in 0..1000 {
            warm.update(8.0);
        }
        let after = self::guard().as_warm_as(&warm);
        assert_eq!(after.bridge.heat, warm.bridge.heat);
        assert!(after.bridge.heat > 1.0);
    }
}
