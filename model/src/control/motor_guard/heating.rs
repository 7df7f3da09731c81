//! The heat of what a motor's current flows through.
//!
//! Winding and bridge heat up with the square of the measured current and cool in proportion to their heat. Each has one
//! time constant for both:
//!
//! ```text
//! tau h' = (i / i_c)^2 - h        h = 1: as warm as the continuous current i_c keeps it
//! ```
//!
//! A motor's winding and housing each have a time constant; the winding's is shorter. With the winding's time constant
//! alone the model is warmer than the motor until the motor has worked for a long time. The same applies to a bridge:
//! its package sits on copper, and both sit on a carrier. The time constant of a bridge is seconds, where that of a
//! winding is half a minute.

use crate::bounded::Bounded;
use crate::sample::TICK_S;

/// Width of the band of heat below 1 in which the limit falls linearly to the continuous current at heat 1.
const HEAT_BAND: f32 = 0.1;
/// Heat above which the limit has failed to protect winding or bridge: a fault.
const HEAT_FAULT: f32 = 1.2;
/// Number of ticks whose squared currents enter the heats in one update: less than a tenth of the shortest time constant
/// that a vehicle file may have.
pub(super) const HEAT_TICKS: u8 = 4;

/// The heat of one part that the motor's current flows through.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Heating {
    /// Heat gained per A^2 and tick, and the share of the heat that is lost in [`HEAT_TICKS`].
    warming_per_a2: f32,
    cooling: f32,
    /// The continuous current as a share of the limit, at most 1.
    continuous_share: f32,
    pub(super) heat: f32,
}

impl Heating {
    /// A cold part that withstands `continuous_a` indefinitely, in a motor with the current limit `limit_a`.
    pub(super) fn new(continuous_a: f32, time_constant_s: f32, limit_a: f32) -> Self {
        let tick = TICK_S / time_constant_s;
        Self {
            warming_per_a2: tick / (continuous_a * continuous_a),
            cooling: f32::from(HEAT_TICKS) * tick,
            continuous_share: (continuous_a / limit_a).bounded(0.0, 1.0),
            heat: 0.0,
        }
    }

    /// This part with the heat of `other`.
    pub(super) fn as_warm_as(self, other: &Self) -> Self {
        Self {
            heat: other.heat,
            ..self
        }
    }

    /// Updates the heat with the sum of the squared currents of [`HEAT_TICKS`], A^2.
    pub(super) fn update(&mut self, squares_a2: f32) {
        self.heat += self.warming_per_a2 * squares_a2 - self.cooling * self.heat;
    }

    /// Whether this heat leaves the whole limit.
    pub(super) fn is_cool(&self) -> bool {
        self.heat < 1.0 - HEAT_BAND
    }

    /// Share of the limit that this heat leaves, 0 to 1.
    pub(super) fn share(&self) -> f32 {
        let room = (1.0 - self.heat) * (1.0 / HEAT_BAND);
        (self.continuous_share + (1.0 - self.continuous_share) * room).bounded(0.0, 1.0)
    }

    /// Whether the part is so hot that the limit must have failed.
    pub(super) fn is_overheated(&self) -> bool {
        self.heat > HEAT_FAULT
    }
}
