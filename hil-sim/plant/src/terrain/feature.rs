//! Features of the ground above the plane, and the locus of a wheel's centre over each feature.

use core::f64::consts::TAU;

use model::real::Real;

use super::error::{TerrainError, check};

/// Height of a wheel's centre, and the slope of its path.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct WheelPath {
    /// Height of the centre above its height on the bare plane, in m.
    pub height_m: f64,
    /// Rise of the centre's path per metre along x.
    pub slope: f64,
}

impl WheelPath {
    pub(super) fn plus(self, other: Self) -> Self {
        Self {
            height_m: self.height_m + other.height_m,
            slope: self.slope + other.slope,
        }
    }
}

/// Largest height of a step, as a share of the wheel's radius.
const STEP_MAX: f64 = 0.3;

/// A feature of the profile along x.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Feature {
    /// Another slope between two places. The slope starts over `transition_m` from `from_m` and ends
    /// over `transition_m` before `from_m + length_m`. Beyond the ramp the ground keeps its final
    /// height.
    Ramp {
        /// Place where the slope begins to change.
        from_m: f64,
        /// Length, both transitions included; longer than twice `transition_m`.
        length_m: f64,
        /// Slope between the transitions, relative to the plane, in rad, -0.8 to 0.8.
        slope_rad: f64,
        /// Length over which the slope changes, > 0.
        transition_m: f64,
    },
    /// Waves from `from_m` on: `height_m/2 (1 - cos(2 pi (x - from_m)/wavelength_m))`.
    Sine {
        /// Place where the first wave begins (in its trough).
        from_m: f64,
        /// Length of a wave.
        wavelength_m: f64,
        /// Trough to crest.
        height_m: f64,
        /// Number of waves.
        waves: u32,
    },
    /// A kerb: from `at_m` on the ground is `height_m` higher (lower if negative), by at most 0.3 of
    /// the wheel's radius.
    Edge {
        /// Place of the edge.
        at_m: f64,
        /// Height, positive up.
        height_m: f64,
    },
    /// Rail joints: a gap of `gap_m` every `rail_length_m`, into which the wheel dips.
    Joints {
        /// Middle of the first gap.
        from_m: f64,
        /// Distance from joint to joint.
        rail_length_m: f64,
        /// Width of the gap.
        gap_m: f64,
        /// Number of joints.
        count: u32,
    },
}

impl Feature {
    /// Checks every number of the feature called `table`.
    pub(super) fn check(&self, table: &str) -> Result<(), TerrainError> {
        let at = |key: &str| format!("{table}.{key}");
        match *self {
            Self::Ramp {
                from_m,
                length_m,
                slope_rad,
                transition_m,
            } => {
                check(at("from_m"), from_m, -1e6, 1e6)?;
                check(at("transition_m"), transition_m, 0.001, 1e5)?;
                check(at("length_m"), length_m, 2.0 * transition_m, 1e6)?;
                check(at("slope_rad"), slope_rad, -0.8, 0.8)
            }
            Self::Sine {
                from_m,
                wavelength_m,
                height_m,
                waves,
            } => {
                check(at("from_m"), from_m, -1e6, 1e6)?;
                check(at("wavelength_m"), wavelength_m, 0.001, 1e5)?;
                check(at("height_m"), height_m, 0.0, 100.0)?;
                check(at("waves"), f64::from(waves), 1.0, 1e6)
            }
            Self::Edge { at_m, height_m } => {
                check(at("at_m"), at_m, -1e6, 1e6)?;
                // The bound by the wheel's radius follows in `Locus::new`.
                check(at("height_m"), height_m, -10.0, 10.0)
            }
            Self::Joints {
                from_m,
                rail_length_m,
                gap_m,
                count,
            } => {
                check(at("from_m"), from_m, -1e6, 1e6)?;
                check(at("rail_length_m"), rail_length_m, 0.01, 1e5)?;
                check(at("gap_m"), gap_m, 0.0, 0.5 * rail_length_m)?;
                check(at("count"), f64::from(count), 1.0, 1e6)
            }
        }
    }
}

/// A feature prepared for one wheel radius.
#[derive(Debug, Clone, Copy)]
pub(super) struct Locus {
    feature: Feature,
    radius: f64,
    /// Tangent of a ramp's slope, wave number of a sine, or distance ahead of a step at which the
    /// wheel touches its corner.
    derived: f64,
}

/// Height, slope and curvature of a profile.
type Shape = [f64; 3];

impl Locus {
    /// Prepares `feature`, number `index` of the profile, for wheels of `radius`.
    pub(super) fn new(feature: &Feature, index: usize, radius: f64) -> Result<Self, TerrainError> {
        let hollow = |curvature: f64| {
            if curvature * radius < 0.999 {
                Ok(())
            } else {
                Err(TerrainError::NarrowHollow {
                    index,
                    hollow_m: 1.0 / curvature,
                    radius_m: radius,
                })
            }
        };
        let within_wheel = |name: &str, value: f64, min: f64, max: f64| {
            // Written so that NaN is refused.
            if value >= min && value <= max {
                Ok(())
            } else {
                Err(TerrainError::BeyondWheel {
                    field: format!("profile[{index}].{name}"),
                    value,
                    min,
                    max,
                    radius_m: radius,
                })
            }
        };
        let derived = match *feature {
            Feature::Ramp {
                slope_rad,
                transition_m,
                ..
            } => {
                let (sin, cos) = Real::sin_cos(slope_rad);
                let rise = sin / cos;
                // The slope changes fastest in the middle of a transition; one of the two transitions
                // is hollow.
                hollow(1.5 * rise.abs() / transition_m)?;
                rise
            }
            Feature::Sine {
                wavelength_m, height_m, ..
            } => {
                let wave_number = TAU / wavelength_m;
                hollow(0.5 * height_m * wave_number * wave_number)?;
                wave_number
            }
            Feature::Edge { height_m, .. } => {
                let limit = STEP_MAX * radius;
                within_wheel("height_m", height_m, -limit, limit)?;
                let drop = radius - height_m.abs();
                (radius * radius - drop * drop).sqrt()
            }
            Feature::Joints { gap_m, .. } => {
                within_wheel("gap_m", gap_m, 0.0, radius)?;
                0.5 * gap_m
            }
        };
        Ok(Self {
            feature: *feature,
            radius,
            derived,
        })
    }

    /// The centre's path at `x`.
    #[inline]
    pub(super) fn at(&self, x: f64) -> WheelPath {
        match self.feature {
            Feature::Ramp {
                from_m,
                length_m,
                transition_m,
                ..
            } => {
                let shape = |x: f64| ramp(x - from_m, length_m, transition_m, self.derived);
                self.parallel(x, shape)
            }
            Feature::Sine {
                from_m,
                wavelength_m,
                height_m,
                waves,
            } => {
                let end = wavelength_m * f64::from(waves);
                let shape = |x: f64| {
                    let ahead = x - from_m;
                    if ahead <= 0.0 || ahead >= end {
                        return [0.0; 3];
                    }
                    let (sin, cos) = Real::sin_cos(self.derived * ahead);
                    let half = 0.5 * height_m;
                    let slope = half * self.derived;
                    [half * (1.0 - cos), slope * sin, slope * self.derived * cos]
                };
                if x < from_m - self.radius || x > from_m + end + self.radius {
                    WheelPath::default()
                } else {
                    self.parallel(x, shape)
                }
            }
            Feature::Edge { at_m, height_m } => {
                // A step down is a step up that the wheel approaches backwards from its upper side.
                let (ahead, base) = if height_m >= 0.0 {
                    (x - at_m, 0.0)
                } else {
                    (at_m - x, height_m)
                };
                let mut path = self.corner(ahead, height_m.abs());
                if height_m < 0.0 {
                    path.slope = -path.slope;
                }
                path.height_m += base;
                path
            }
            Feature::Joints {
                from_m,
                rail_length_m,
                count,
                ..
            } => {
                let nearest = ((x - from_m) / rail_length_m).round().clamp(0.0, f64::from(count - 1));
                let offset = x - from_m - nearest * rail_length_m;
                let inside = self.derived - offset.abs();
                if inside <= 0.0 {
                    return WheelPath::default();
                }
                // The centre turns about the nearer edge until the wheel touches the other edge.
                let height = (self.radius * self.radius - inside * inside).sqrt();
                WheelPath {
                    height_m: height - self.radius,
                    slope: inside / height * offset.signum(),
                }
            }
        }
    }

    /// The centre of a wheel `ahead` of the edge of a step up.
    #[inline]
    fn corner(&self, ahead: f64, step: f64) -> WheelPath {
        if ahead >= 0.0 {
            WheelPath {
                height_m: step,
                slope: 0.0,
            }
        } else if -ahead >= self.derived {
            WheelPath::default()
        } else {
            // The centre turns about the edge.
            let above = (self.radius * self.radius - ahead * ahead).sqrt();
            WheelPath {
                height_m: step + above - self.radius,
                slope: -ahead / above,
            }
        }
    }

    /// The parallel curve of a smooth profile: the wheel touches at `c` where
    /// `x = c - r h'(c) / sqrt(1 + h'(c)^2)`, and its centre's path has the slope of the ground there.
    #[inline]
    fn parallel(&self, x: f64, shape: impl Fn(f64) -> Shape) -> WheelPath {
        let mut c = x;
        let [mut h, mut slope, mut curvature] = shape(c);
        let mut norm = (1.0 + slope * slope).sqrt();
        // Newton's method, which ends at once on a level profile.
        for _ in 0..8 {
            let error = c - self.radius * slope / norm - x;
            if error.abs() < 1e-12 {
                break;
            }
            c -= error / (1.0 - self.radius * curvature / (norm * norm * norm)).max(0.1);
            [h, slope, curvature] = shape(c);
            norm = (1.0 + slope * slope).sqrt();
        }
        WheelPath {
            height_m: h + self.radius / norm - self.radius,
            slope,
        }
    }
}

/// A ramp's profile: its slope is `rise` times a smooth step in and a smooth step out.
#[inline]
fn ramp(ahead: f64, length: f64, transition: f64, rise: f64) -> Shape {
    if ahead <= 0.0 {
        return [0.0; 3];
    }
    let top = rise * (length - transition);
    // Height, slope and curvature over rise of a transition after `s` of its length.
    let into = |s: f64| {
        [
            transition * s * s * s * (1.0 - 0.5 * s),
            s * s * (3.0 - 2.0 * s),
            6.0 * s * (1.0 - s) / transition,
        ]
    };
    if ahead < transition {
        let [h, d, c] = into(ahead / transition);
        [rise * h, rise * d, rise * c]
    } else if ahead < length - transition {
        [rise * (ahead - 0.5 * transition), rise, 0.0]
    } else if ahead < length {
        // The end of the ramp mirrors its start.
        let [h, d, c] = into((length - ahead) / transition);
        [top - rise * h, rise * d, -rise * c]
    } else {
        [top, 0.0, 0.0]
    }
}
