//! The speed loop, with the law that the vehicle file names.

use super::LawOutput;
use super::landing::LandingLaw;
use super::speed::{SpeedInput, SpeedTerms};
use super::swing_damped::SwingDampedLaw;
use crate::vehicle::{SpeedLawChoice, Vehicle};

/// The speed loop, with the law that the vehicle file names.
// A vehicle has one, in place: there is no heap.
#[allow(clippy::large_enum_variant)]
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum SpeedController {
    /// Eq. 3.25 with its additions.
    SwingDamped(SwingDampedLaw),
    /// The landing law.
    Landing(LandingLaw),
}

impl SpeedController {
    /// The loop for `vehicle`, called every `dt_s` seconds.
    pub fn new(vehicle: &Vehicle<f32>, dt_s: f32) -> Self {
        match vehicle.speed_law() {
            SpeedLawChoice::SwingDamped => Self::SwingDamped(SwingDampedLaw::new(vehicle, dt_s)),
            SpeedLawChoice::Landing => Self::Landing(LandingLaw::new(vehicle, dt_s)),
        }
    }

    /// Restarts at the present speed: the reference does not jump, and the law's memory is cleared.
    pub fn reset(&mut self, speed_m_s: f32) {
        match self {
            Self::SwingDamped(law) => law.reset(speed_m_s),
            Self::Landing(law) => law.reset(speed_m_s),
        }
    }

    /// One tick: returns the voltage of each drive motor, within `voltage_max_v`, and its terms.
    // Inlined on the host: the terms of its result need not pass through memory.
    #[allow(clippy::inline_always)]
    #[cfg_attr(not(target_os = "none"), inline(always))]
    pub fn step(&mut self, input: &SpeedInput) -> LawOutput<SpeedTerms> {
        match self {
            Self::SwingDamped(law) => law.step(input),
            Self::Landing(law) => law.step(input),
        }
    }

    /// The governed reference, m/s.
    pub fn reference_m_s(&self) -> f32 {
        match self {
            Self::SwingDamped(law) => law.reference_m_s(),
            Self::Landing(law) => law.reference_m_s(),
        }
    }

    /// Whether the law has found that the vehicle is commanded to drive but makes no progress. Eq. 3.25 does not check
    /// this and returns false.
    pub fn is_stuck(&self) -> bool {
        match self {
            Self::SwingDamped(_) => false,
            Self::Landing(law) => law.is_stuck(),
        }
    }

    /// Whether the wheels have just come past what had held them up; Eq. 3.25 does not look.
    pub fn is_just_free(&self) -> bool {
        match self {
            Self::SwingDamped(_) => false,
            Self::Landing(law) => law.is_just_free(),
        }
    }

    /// Whether the slope is steeper than the arm's weight can balance or the configured grip can hold.
    pub fn slope_limited(&self) -> bool {
        match self {
            Self::SwingDamped(_) => false,
            Self::Landing(law) => law.slope_limited(),
        }
    }

    /// Whether the vehicle was armed on a slope on which it cannot stand. Eq. 3.25 does not check this and returns
    /// false.
    pub fn refuses_slope(&self) -> bool {
        match self {
            Self::SwingDamped(_) => false,
            Self::Landing(law) => law.refuses_slope(),
        }
    }

    /// Change of the slope's sine that the last tick showed; `None` before the first tick. Eq. 3.25 does not learn the
    /// slope.
    pub fn slope_lesson(&self) -> Option<f32> {
        match self {
            Self::SwingDamped(_) => None,
            Self::Landing(law) => law.slope_lesson(),
        }
    }

    /// Acceleration of the axle in the tick decided last, g, for the spar on it. Eq. 3.25 does not know it.
    pub fn acceleration_g(&self) -> Option<f32> {
        match self {
            Self::SwingDamped(_) => None,
            Self::Landing(law) => Some(law.acceleration_g()),
        }
    }
}
