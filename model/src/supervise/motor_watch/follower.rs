//! Whether a measured current follows the voltage.

use crate::bounded::Bounded;
use crate::sample::TICK_S;
use crate::vehicle::MotorParameters;

/// The response of the measured current to the voltage.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CurrentResponse {
    /// The voltage changed too little to decide, or the response lies between the other two.
    Unknown,
    /// The current changes as the voltage makes it.
    Follows,
    /// The current does not change with the voltage.
    Dead,
}

/// Compares the changes of current and voltage by sums of products of their second differences, which exclude steady
/// loads, ramps and offsets.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Follower {
    ampere_per_volt: f32,
    /// Share of a change of current that is left after a tick.
    rest: f32,
    /// Ticks processed, up to [`DIFFERENCE_TICKS`].
    ticks: u8,
    /// Current that the voltage alone would drive, at the end of the tick. A run of ticks starts with the steady current,
    /// because the back-EMF is not known here.
    model_a: f32,
    pub(super) model: SecondDifference,
    measured: SecondDifference,
    pub(super) power: f32,
    pub(super) common: f32,
    pub(super) measured_power: f32,
}

/// Time constant of the sums, in ticks: 60 ms.
const SUM_TICKS: f32 = 60.0;
const SUM_KEPT: f32 = 1.0 - 1.0 / SUM_TICKS;
/// Largest change that counts, A, so that one jump, as of a dying sensor, does not outweigh a hundred ticks.
const CHANGE_MAX_A: f32 = 0.5;
/// Least sum of the squared modelled second differences that is evidence, A^2: that of 15 mA in every tick, three quarters
/// of what the laws' probe of 20 mV drives through 1.3 ohm. The converter's noise, 4 mA per reading, contributes two
/// fifths of this sum.
pub(super) const POWER_MIN_A2: f32 = SUM_TICKS * 0.015 * 0.015;
/// Share of the modelled change that a working sensor shows at least, and a dead sensor at most.
const FOLLOWS_SHARE: f32 = 0.5;
const DEAD_SHARE: f32 = 0.25;
/// Share of the modelled mean square that a dead sensor shows at most. A working sensor may also show the effect of the
/// back-EMF.
const DEAD_POWER_SHARE: f32 = 0.5;

impl Follower {
    /// A follower for the motor with these parameters.
    pub fn new(motor: &MotorParameters<f32>) -> Self {
        let ticks = TICK_S * motor.resistance_ohm / motor.inductance_h;
        // Without inductance the quotient is infinite, and the remaining share is 0.
        Self {
            ampere_per_volt: 1.0 / motor.resistance_ohm,
            rest: libm::expf(-ticks),
            ticks: 0,
            model_a: 0.0,
            model: SecondDifference::default(),
            measured: SecondDifference::default(),
            power: 0.0,
            common: 0.0,
            measured_power: 0.0,
        }
    }

    /// Forgets every tick so far.
    pub fn reset(&mut self) {
        self.ticks = 0;
        self.power = 0.0;
        self.common = 0.0;
        self.measured_power = 0.0;
    }

    /// Updates the sums with the voltage since the last tick and the current measured within it. Returns the response.
    // Inlined like `MotorWatch::update`, its only caller.
    #[allow(clippy::inline_always)]
    #[cfg_attr(not(target_os = "none"), inline(always))]
    pub fn update(&mut self, voltage_v: f32, current_a: f32) -> CurrentResponse {
        let steady_a = voltage_v * self.ampere_per_volt;
        let before_a = if self.ticks == 0 { steady_a } else { self.model_a };
        let after_a = steady_a + self.rest * (before_a - steady_a);
        self.model_a = after_a;
        // The mean over the tick suits a current that is measured at any time within the tick or averaged over it.
        let mean_a = 0.5 * (before_a + after_a);
        let changes = [self.model.update(mean_a), self.measured.update(current_a)];
        if self.ticks < DIFFERENCE_TICKS {
            self.ticks += 1;
        } else {
            let [model, measured] = if changes.iter().all(|change| change.abs() <= CHANGE_MAX_A) {
                // This is nearly always the case.
                changes
            } else {
                changes.map(|change| change.bounded(-CHANGE_MAX_A, CHANGE_MAX_A))
            };
            self.power = SUM_KEPT * self.power + model * model;
            self.common = SUM_KEPT * self.common + model * measured;
            self.measured_power = SUM_KEPT * self.measured_power + measured * measured;
        }
        self.answer()
    }

    /// How the measured current has responded lately.
    #[inline]
    pub fn answer(&self) -> CurrentResponse {
        if self.power < POWER_MIN_A2 {
            CurrentResponse::Unknown
        } else if self.common > FOLLOWS_SHARE * self.power {
            CurrentResponse::Follows
        } else if self.common < DEAD_SHARE * self.power && self.measured_power < DEAD_POWER_SHARE * self.power {
            CurrentResponse::Dead
        } else {
            CurrentResponse::Unknown
        }
    }
}

/// Number of values that must precede the first known second difference.
pub(super) const DIFFERENCE_TICKS: u8 = 2;

/// The second difference of a sequence, valid after [`DIFFERENCE_TICKS`] values.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct SecondDifference {
    pub(super) last: f32,
    last_step: f32,
}

impl SecondDifference {
    pub(super) fn update(&mut self, value: f32) -> f32 {
        let step = value - self.last;
        let second = step - self.last_step;
        self.last = value;
        self.last_step = step;
        second
    }
}
