//! The ground: an inclined plane, features along the plane, and friction by side and place.
//!
//! A terrain is a TOML table (a file of its own, or `[terrain]` of a scenario):
//!
//! ```
//! let terrain: plant::terrain::Terrain = toml::from_str(r#"
//!     [plane]
//!     slope_x_rad = 0.0873      # uphill along x: beta_x of (6.5)
//!     slope_y_rad = 0.0         # positive downhill to the left: beta_y of (6.5)
//!
//!     [friction]                # coefficient under each wheel
//!     left = 0.8
//!     right = 0.8
//!
//!     [[patch]]                 # friction between two places, the last patch that covers a place wins
//!     from_m = 4.0
//!     to_m = 6.0
//!     left = 0.6
//!     right = 0.1
//!
//!     [[profile]]               # features that rise above the plane
//!     kind = "step"
//!     at_m = 8.0
//!     height_m = 0.03
//! "#).unwrap();
//! assert_eq!(terrain.friction_at(5.0).right, 0.1);
//! ```
//!
//! Every key is optional. A missing plane is level, and the default friction is 0.8. Features vary only with
//! x, like a cylinder across the path; each wheel meets a feature at its own x.
//!
//! # What the wheels see
//! The wheels' centres follow the locus of the centre of a rigid wheel that rolls over the profile. [`Ground`]
//! computes the locus exactly for circle and corner (a step, the edges of a rail joint) and for smooth shapes
//! (the parallel curve). A hollow with a sharper curvature than the wheel's is refused. The loci of
//! overlapping features add up, which is exact only where at most one of the features is not level.

use model::real::Real;
use model::vehicle::GRAVITY_M_S2;
use serde::Deserialize;

mod error;
mod feature;
mod file;
mod surface;
#[cfg(test)]
mod tests;

pub use error::TerrainError;
use error::check;
use feature::Locus;
pub use feature::{Feature, WheelPath};
pub use file::TerrainFile;
pub use surface::{Friction, Patch, Plane};

/// A checked terrain, independent of the vehicle that drives on it.
#[derive(Debug, Clone, PartialEq, Default, Deserialize)]
#[serde(try_from = "TerrainFile")]
pub struct Terrain {
    plane: Plane,
    friction: Friction,
    patches: Vec<Patch>,
    profile: Vec<Feature>,
}

impl Terrain {
    /// Checks a terrain.
    ///
    /// # Errors
    /// The first value that is out of range.
    pub fn new(
        plane: Plane,
        friction: Friction,
        patches: Vec<Patch>,
        profile: Vec<Feature>,
    ) -> Result<Self, TerrainError> {
        check("plane.slope_x_rad", plane.slope_x_rad, -1.2, 1.2)?;
        check("plane.slope_y_rad", plane.slope_y_rad, -1.2, 1.2)?;
        check("friction.right", friction.right, 0.0, 5.0)?;
        check("friction.left", friction.left, 0.0, 5.0)?;
        for (index, patch) in patches.iter().enumerate() {
            let table = format!("patch[{index}]");
            check(format!("{table}.from_m"), patch.from_m, -1e6, 1e6)?;
            check(format!("{table}.to_m"), patch.to_m, -1e6, 1e6)?;
            check(format!("{table}.right"), patch.right, 0.0, 5.0)?;
            check(format!("{table}.left"), patch.left, 0.0, 5.0)?;
            if patch.to_m <= patch.from_m {
                return Err(TerrainError::EmptyInterval {
                    field: table,
                    from_m: patch.from_m,
                    to_m: patch.to_m,
                });
            }
        }
        for (index, feature) in profile.iter().enumerate() {
            feature.check(&format!("profile[{index}]"))?;
        }
        Ok(Self {
            plane,
            friction,
            patches,
            profile,
        })
    }

    /// A slope: a plane inclined by `slope_x_rad` along x, with one friction coefficient.
    ///
    /// # Errors
    /// A value out of range.
    pub fn slope(slope_x_rad: f64, friction: f64) -> Result<Self, TerrainError> {
        let plane = Plane {
            slope_x_rad,
            slope_y_rad: 0.0,
        };
        let friction = Friction {
            left: friction,
            right: friction,
        };
        Self::new(plane, friction, Vec::new(), Vec::new())
    }

    /// The base plane.
    pub fn plane(&self) -> Plane {
        self.plane
    }

    /// The friction coefficients at `x_m` (the wheels' own x may differ while turning).
    pub fn friction_at(&self, x_m: f64) -> Friction {
        let covering = |patch: &&Patch| x_m >= patch.from_m && x_m < patch.to_m;
        self.patches
            .iter()
            .rev()
            .find(covering)
            .map_or(self.friction, |patch| Friction {
                left: patch.left,
                right: patch.right,
            })
    }
}

/// A terrain for wheels of one radius.
#[derive(Debug, Clone)]
pub struct Ground {
    terrain: Terrain,
    loci: Vec<Locus>,
    /// g times the unit vector that points up, in the plane's axes.
    up_m_s2: [f64; 3],
}

impl Ground {
    /// Computes the loci of the centre of a wheel of `radius_m`.
    ///
    /// # Errors
    /// A step higher than 0.3 of the radius, or a hollow narrower than the wheel.
    pub fn new(terrain: Terrain, radius_m: f64) -> Result<Self, TerrainError> {
        let loci = terrain
            .profile
            .iter()
            .enumerate()
            .map(|(index, feature)| Locus::new(feature, index, radius_m))
            .collect::<Result<_, _>>()?;
        let (sin_x, cos_x) = Real::sin_cos(terrain.plane.slope_x_rad);
        let (sin_y, cos_y) = Real::sin_cos(terrain.plane.slope_y_rad);
        let g = GRAVITY_M_S2;
        Ok(Self {
            terrain,
            loci,
            up_m_s2: [g * sin_x, -g * sin_y * cos_x, g * cos_y * cos_x],
        })
    }

    /// The terrain.
    pub fn terrain(&self) -> &Terrain {
        &self.terrain
    }

    /// g times the unit vector that points up, in the plane's axes: minus (6.6).
    pub fn up_m_s2(&self) -> [f64; 3] {
        self.up_m_s2
    }

    /// Path of the centre of a wheel at `x_m`.
    #[inline]
    pub fn wheel(&self, x_m: f64) -> WheelPath {
        if self.loci.is_empty() {
            WheelPath::default()
        } else {
            self.rise(x_m)
        }
    }

    /// Path over the features.
    // Not inlined: nearly every substep needs only the bare plane.
    #[inline(never)]
    fn rise(&self, x_m: f64) -> WheelPath {
        self.loci
            .iter()
            .fold(WheelPath::default(), |sum, locus| sum.plus(locus.at(x_m)))
    }

    /// Friction coefficient under the right wheel at `x_m`.
    #[inline]
    pub fn friction_right(&self, x_m: f64) -> f64 {
        if self.terrain.patches.is_empty() {
            self.terrain.friction.right
        } else {
            self.terrain.friction_at(x_m).right
        }
    }

    /// Friction coefficient under the left wheel at `x_m`.
    #[inline]
    pub fn friction_left(&self, x_m: f64) -> f64 {
        if self.terrain.patches.is_empty() {
            self.terrain.friction.left
        } else {
            self.terrain.friction_at(x_m).left
        }
    }
}
