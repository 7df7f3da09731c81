//! The base plane, and the friction on it.

use serde::Deserialize;

/// Inclination of the base plane (6.5).
#[derive(Debug, Clone, Copy, PartialEq, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Plane {
    /// Slope along x in rad, positive uphill, -1.2 to 1.2.
    pub slope_x_rad: f64,
    /// Slope about x in rad, positive downhill along y (to the left), -1.2 to 1.2.
    pub slope_y_rad: f64,
}

/// Friction coefficient under each wheel, 0 to 5.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Friction {
    /// Under the left wheel.
    pub left: f64,
    /// Under the right wheel.
    pub right: f64,
}

impl Default for Friction {
    /// Rubber on dry concrete.
    fn default() -> Self {
        Self { left: 0.8, right: 0.8 }
    }
}

/// Different friction between two places.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Patch {
    /// Start along x, in m.
    pub from_m: f64,
    /// End along x, in m.
    pub to_m: f64,
    /// Coefficient under the left wheel, 0 to 5.
    pub left: f64,
    /// Coefficient under the right wheel, 0 to 5.
    pub right: f64,
}
