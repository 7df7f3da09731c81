//! The speed loop under the law that the vehicle file chooses.

use super::LawOutput;
use super::landing::LandingLaw;
use super::speed::{SpeedInput, SpeedTerms};
use super::swing_damped::SwingDampedLaw;
use crate::vehicle::{SpeedLawChoice, Vehicle};

/// The speed loop under the law that the vehicle file names.
// A vehicle has one, in place: there is no heap.
#[allow(clippy::large_enum_variant)]
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum SpeedController {
    /// Eq. 3.25 with what surrounds it.
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

    /// Starts anew at the present speed: no jump of the reference, nothing remembered.
    pub fn reset(&mut self, speed_m_s: f32) {
        match self {
            Self::SwingDamped(law) => law.reset(speed_m_s),
            Self::Landing(law) => law.reset(speed_m_s),
        }
    }

    /// One tick: the voltage for each of the two motors within `voltage_max_v`, and its terms.
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

    /// The law has found that the vehicle is commanded to drive and makes no progress; Eq. 3.25 does not look.
    pub fn is_stuck(&self) -> bool {
        match self {
            Self::SwingDamped(_) => false,
            Self::Landing(law) => law.is_stuck(),
        }
    }

    /// The slope is beyond what the arm's weight can carry or the configured grip can hold.
    pub fn slope_limited(&self) -> bool {
        match self {
            Self::SwingDamped(_) => false,
            Self::Landing(law) => law.slope_limited(),
        }
    }

    /// The vehicle was armed on a slope on which it cannot stand; Eq. 3.25 does not look.
    pub fn refuses_slope(&self) -> bool {
        match self {
            Self::SwingDamped(_) => false,
            Self::Landing(law) => law.refuses_slope(),
        }
    }

    /// What the last tick taught of the slope, as a change of its sine; nothing before the first tick. Eq. 3.25 learns
    /// nothing of it.
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
