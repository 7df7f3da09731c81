//! Degrees of trust in an accelerometer.

/// How well the accelerometer shows the vertical.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Trust {
    /// Not at all: the vehicle falls or lands, and the accelerometer feels gravity not at all or only as the smaller
    /// part.
    None,
    /// Little: the wheels slide and do not show the axle's acceleration.
    Little,
    /// As far as the axle's acceleration is known.
    Driving,
    /// Fully, but only for a short while: the angle is not yet right, and its error is no bias of the gyro.
    Settling,
    /// Fully: the vehicle does not move. The gyro shows its bias and the accelerometer shows gravity alone.
    AtRest,
}

/// Factor by which the angle's correction is slower while the wheels slide. The factor is not 0, so a false slide
/// cannot keep a wrong angle for ever.
const LITTLE_FACTOR: f32 = 0.02;
/// Factor by which the angle's correction is faster while the body is known to be at rest.
const STANDSTILL_FACTOR: f32 = 20.0;
/// Factor by which the bias's correction is faster at rest: with the reference time constants the two poles are
/// about critically damped at 4.5 1/s.
const STANDSTILL_BIAS_FACTOR: f32 = 2400.0;

impl Trust {
    /// Factors on the corrections of the angle and of the bias.
    pub(super) fn factors(self) -> (f32, f32) {
        match self {
            Self::None => (0.0, 0.0),
            Self::Little => (LITTLE_FACTOR, 0.0),
            Self::Driving => (1.0, 1.0),
            Self::Settling => (STANDSTILL_FACTOR, 0.0),
            Self::AtRest => (STANDSTILL_FACTOR, STANDSTILL_BIAS_FACTOR),
        }
    }

    /// Whether the body is known to be at rest.
    pub(super) fn stands(self) -> bool {
        matches!(self, Self::Settling | Self::AtRest)
    }
}
