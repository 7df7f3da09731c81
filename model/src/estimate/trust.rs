//! How far an accelerometer is trusted.

/// How far the accelerometer shows where down is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Trust {
    /// Not at all: the vehicle falls or lands, and gravity is no part of what the accelerometer feels, or the smaller.
    None,
    /// Little: the wheels slide, and the axle's acceleration is not what they show.
    Little,
    /// As far as the axle's acceleration is known.
    Driving,
    /// Fully, but for a short while only: the angle is not yet right, and what is wrong with it is no bias of the gyro.
    Settling,
    /// Fully: the vehicle does not move. The gyro shows its bias and the accelerometer shows gravity alone.
    AtRest,
}

/// Slow-down of the angle's correction while the wheels slide: not 0, so that a slide that is none cannot keep a wrong
/// angle for ever.
const LITTLE_FACTOR: f32 = 0.02;
/// Speed-up of the angle's correction while the body is known to be at rest.
const STANDSTILL_FACTOR: f32 = 20.0;
/// Speed-up of the bias's correction at rest: with the reference time constants the two poles are about
/// critically damped at 4.5 1/s.
const STANDSTILL_BIAS_FACTOR: f32 = 2400.0;

impl Trust {
    /// Speed-ups of the corrections of the angle and of the bias.
    pub(super) fn factors(self) -> (f32, f32) {
        match self {
            Self::None => (0.0, 0.0),
            Self::Little => (LITTLE_FACTOR, 0.0),
            Self::Driving => (1.0, 1.0),
            Self::Settling => (STANDSTILL_FACTOR, 0.0),
            Self::AtRest => (STANDSTILL_FACTOR, STANDSTILL_BIAS_FACTOR),
        }
    }

    /// The body is known to be at rest.
    pub(super) fn stands(self) -> bool {
        matches!(self, Self::Settling | Self::AtRest)
    }
}
