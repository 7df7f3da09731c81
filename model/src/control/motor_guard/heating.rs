//! The heat of what a motor's current flows through.
//!
//! Winding and bridge warm with the square of the measured current and cool as they are warm, one time constant for both:
//!
//! ```text
//! tau h' = (i / i_c)^2 - h        h = 1: as warm as the continuous current i_c keeps it
//! ```
//!
//! A winding and a housing have a time constant each, of which the winding's is the shorter: with that one alone the model
//! is warmer than the motor, as long as the motor has not been at work for long. So it is with a bridge's package on its
//! copper and what carries both, and seconds there are what half a minute is in a winding.

use crate::bounded::Bounded;
use crate::sample::TICK_S;

/// Heat below 1 from which on the limit falls, in proportion, to the continuous current at heat 1.
const HEAT_BAND: f32 = 0.1;
/// Heat beyond which the limit does not hold winding or bridge: a fault.
const HEAT_FAULT: f32 = 1.2;
/// Ticks whose currents' squares the heats take at once: less than a tenth of the shortest time constant that a vehicle file
/// may have.
pub(super) const HEAT_TICKS: u8 = 4;

/// The heat of one thing that the motor's current flows through.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Heating {
    /// Heat per A^2 in a tick, and the share of the heat that goes in [`HEAT_TICKS`].
    warming_per_a2: f32,
    cooling: f32,
    /// The continuous current as a share of the limit, 1 at most.
    continuous_share: f32,
    pub(super) heat: f32,
}

impl Heating {
    /// Something cold that bears `continuous_a` for ever, in a motor that may use `limit_a`.
    pub(super) fn new(continuous_a: f32, time_constant_s: f32, limit_a: f32) -> Self {
        let tick = TICK_S / time_constant_s;
        Self {
            warming_per_a2: tick / (continuous_a * continuous_a),
            cooling: f32::from(HEAT_TICKS) * tick,
            continuous_share: (continuous_a / limit_a).bounded(0.0, 1.0),
            heat: 0.0,
        }
    }

    /// This one, as warm as another.
    pub(super) fn as_warm_as(self, other: &Self) -> Self {
        Self {
            heat: other.heat,
            ..self
        }
    }

    /// Takes the squares of the currents of [`HEAT_TICKS`], A^2.
    pub(super) fn update(&mut self, squares_a2: f32) {
        self.heat += self.warming_per_a2 * squares_a2 - self.cooling * self.heat;
    }

    /// Whether it leaves the whole limit.
    pub(super) fn is_cool(&self) -> bool {
        self.heat < 1.0 - HEAT_BAND
    }

    /// Share of the limit that this heat leaves, 0 to 1.
    pub(super) fn share(&self) -> f32 {
        let room = (1.0 - self.heat) * (1.0 / HEAT_BAND);
        (self.continuous_share + (1.0 - self.continuous_share) * room).bounded(0.0, 1.0)
    }

    /// Whether it is so hot that the limit cannot have held.
    pub(super) fn is_overheated(&self) -> bool {
        self.heat > HEAT_FAULT
    }
}
