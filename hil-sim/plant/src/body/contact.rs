//! Dry friction, regularised and solved implicitly: at a wheel's contact (two directions, one
//! Coulomb disc, [`ContactMode`]) and in a gearbox (one direction, [`GearMode`]).
//!
//! The law is `f = -limit s / max(|s|, e)` with the slip speed `s` at the end of the step: within the
//! band `e` a stiff damper (stick), outside it the Coulomb force against the slip. The step is solved
//! for the end-of-step slip. The band can therefore be so narrow that its creep is far below anything
//! measurable, and no step is too long for the band.

/// Band of the wheel's law in m/s: the creep of a contact at its limit.
pub const WHEEL_BAND_M_S: f64 = 1e-5;
/// Band of a gearbox's law in rad/s at its output.
pub const GEAR_BAND_RAD_S: f64 = 1e-6;

/// The state of one contact within a step's iteration.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ContactMode {
    /// The slip is within the band.
    Stick,
    /// Slipping at `speed` along the unit vector (along, across).
    Slide {
        /// Unit vector of the slip.
        direction: [f64; 2],
        /// Its magnitude, for the stiffness across it.
        speed: f64,
    },
}

/// The friction law, linearised about a mode: force = -(constant + stiffness . slip).
#[derive(Debug, Clone, Copy, Default)]
pub struct Linear {
    /// Part that does not depend on the slip.
    pub constant: [f64; 2],
    /// Symmetric: along-along, along-across, across-across.
    pub stiffness: [f64; 3],
}

impl ContactMode {
    /// The mode of a slip.
    #[inline]
    pub fn of(slip: [f64; 2], band: f64) -> Self {
        let speed = (slip[0] * slip[0] + slip[1] * slip[1]).sqrt();
        if speed <= band {
            Self::Stick
        } else {
            Self::Slide {
                direction: [slip[0] / speed, slip[1] / speed],
                speed,
            }
        }
    }

    /// Newton's linearisation of the law about this mode under the limit force `limit`.
    #[inline]
    pub fn linear(self, limit: f64, band: f64) -> Linear {
        match self {
            Self::Stick => {
                let k = limit / band;
                Linear {
                    constant: [0.0; 2],
                    stiffness: [k, 0.0, k],
                }
            }
            Self::Slide {
                direction: [a, b],
                speed,
            } => {
                let k = limit / speed;
                Linear {
                    constant: [limit * a, limit * b],
                    stiffness: [k * (1.0 - a * a), -k * a * b, k * (1.0 - b * b)],
                }
            }
        }
    }

    /// The secant of the law about this mode. It converges more slowly than Newton's linearisation but
    /// cannot cycle.
    #[inline]
    pub fn secant(self, limit: f64, band: f64) -> Linear {
        let k = match self {
            Self::Stick => limit / band,
            Self::Slide { speed, .. } => limit / speed,
        };
        Linear {
            constant: [0.0; 2],
            stiffness: [k, 0.0, k],
        }
    }

    /// The mode for the `slip` of a solution with this mode, and whether the mode has changed.
    #[inline]
    pub fn next(self, slip: [f64; 2], band: f64) -> (Self, bool) {
        let found = Self::of(slip, band);
        match (self, found) {
            (Self::Stick, Self::Stick) => (self, false),
            (Self::Slide { direction: [a, b], .. }, found) => {
                let along = a * slip[0] + b * slip[1];
                if along < 0.0 {
                    // The slip reversed within the step, so the slip ended on the way.
                    (Self::Stick, true)
                } else if let Self::Slide { direction: [c, d], .. } = found {
                    // A direction that turned by more than 0.1 rad needs a new linearisation.
                    (found, a * c + b * d < 0.995)
                } else {
                    (found, true)
                }
            }
            (Self::Stick, found) => (found, true),
        }
    }
}

/// The state of a gearbox's friction within a step's iteration: the law of a contact in one direction.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum GearMode {
    /// The slip is within the band.
    Stick,
    /// Slipping at this rate.
    Slide(f64),
}

/// The law in one direction linearised about a mode: force = -(constant + stiffness * rate).
#[derive(Debug, Clone, Copy)]
pub struct LinearInOne {
    /// Part that does not depend on the rate.
    pub constant: f64,
    /// Slope.
    pub stiffness: f64,
}

impl GearMode {
    /// The law about this mode under the limit torque `limit`: its secant or Newton's linearisation.
    #[inline]
    pub fn linear(self, limit: f64, band: f64, secant: bool) -> LinearInOne {
        let (constant, stiffness) = match self {
            Self::Stick => (0.0, limit / band),
            Self::Slide(rate) if secant => (0.0, limit / rate.abs()),
            Self::Slide(rate) => (limit.copysign(rate), 0.0),
        };
        LinearInOne { constant, stiffness }
    }

    /// The mode for the `rate` of a solution with this mode, and whether the mode has changed.
    #[inline]
    pub fn next(self, rate: f64, band: f64) -> (Self, bool) {
        let found = if rate.abs() <= band {
            Self::Stick
        } else {
            Self::Slide(rate)
        };
        match (self, found) {
            // The rate reversed within the step, so the slip ended on the way.
            (Self::Slide(before), _) if before * rate < 0.0 => (Self::Stick, true),
            (Self::Stick, Self::Stick) | (Self::Slide(_), Self::Slide(_)) => (found, false),
            _ => (found, true),
        }
    }
}

impl Linear {
    /// The force of the law at a slip.
    #[inline]
    pub fn force(&self, slip: [f64; 2]) -> [f64; 2] {
        let [xx, xy, yy] = self.stiffness;
        [
            -(self.constant[0] + xx * slip[0] + xy * slip[1]),
            -(self.constant[1] + xy * slip[0] + yy * slip[1]),
        ]
    }
}
