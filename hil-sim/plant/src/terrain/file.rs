//! A terrain as read from a file, not yet checked.

use serde::Deserialize;

use super::{Feature, Friction, Patch, Plane, Terrain, TerrainError};

/// The tables of a terrain.
#[derive(Debug, Clone, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct TerrainFile {
    plane: Plane,
    friction: Friction,
    patch: Vec<Patch>,
    profile: Vec<FeatureFile>,
}

impl TryFrom<TerrainFile> for Terrain {
    type Error = TerrainError;

    fn try_from(file: TerrainFile) -> Result<Self, TerrainError> {
        let profile = file.profile.into_iter().enumerate();
        let profile = profile.map(|(index, feature)| feature.feature(&format!("profile[{index}]")));
        Self::new(
            file.plane,
            file.friction,
            file.patch,
            profile.collect::<Result<_, _>>()?,
        )
    }
}

/// The kind of a feature.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(rename_all = "kebab-case")]
enum FeatureKind {
    Ramp,
    Sine,
    /// An edge, a `step` of the ground in files.
    #[serde(rename = "step")]
    Edge,
    Joints,
}

/// A feature with any fields that a file gives, read into one flat struct so that an error can
/// name its field.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
struct FeatureFile {
    kind: FeatureKind,
    from_m: Option<f64>,
    length_m: Option<f64>,
    slope_rad: Option<f64>,
    transition_m: Option<f64>,
    wavelength_m: Option<f64>,
    height_m: Option<f64>,
    waves: Option<u32>,
    at_m: Option<f64>,
    rail_length_m: Option<f64>,
    gap_m: Option<f64>,
    count: Option<u32>,
}

impl FeatureFile {
    /// The feature called `table`, with exactly the fields of its kind.
    fn feature(mut self, table: &str) -> Result<Feature, TerrainError> {
        /// Takes the value of a field of the kind.
        fn take<T>(table: &str, name: &str, value: &mut Option<T>) -> Result<T, TerrainError> {
            value.take().ok_or_else(|| TerrainError::Missing {
                field: format!("{table}.{name}"),
            })
        }
        let feature = match self.kind {
            FeatureKind::Ramp => Feature::Ramp {
                from_m: take(table, "from_m", &mut self.from_m)?,
                length_m: take(table, "length_m", &mut self.length_m)?,
                slope_rad: take(table, "slope_rad", &mut self.slope_rad)?,
                transition_m: take(table, "transition_m", &mut self.transition_m)?,
            },
            FeatureKind::Sine => Feature::Sine {
                from_m: take(table, "from_m", &mut self.from_m)?,
                wavelength_m: take(table, "wavelength_m", &mut self.wavelength_m)?,
                height_m: take(table, "height_m", &mut self.height_m)?,
                waves: take(table, "waves", &mut self.waves)?,
            },
            FeatureKind::Edge => Feature::Edge {
                at_m: take(table, "at_m", &mut self.at_m)?,
                height_m: take(table, "height_m", &mut self.height_m)?,
            },
            FeatureKind::Joints => Feature::Joints {
                from_m: take(table, "from_m", &mut self.from_m)?,
                rail_length_m: take(table, "rail_length_m", &mut self.rail_length_m)?,
                gap_m: take(table, "gap_m", &mut self.gap_m)?,
                count: take(table, "count", &mut self.count)?,
            },
        };
        match self.left() {
            None => Ok(feature),
            Some(name) => Err(TerrainError::NotOfKind {
                field: format!("{table}.{name}"),
            }),
        }
    }

    /// The first field that was not taken.
    fn left(&self) -> Option<&'static str> {
        let numbers = [
            ("from_m", self.from_m),
            ("length_m", self.length_m),
            ("slope_rad", self.slope_rad),
            ("transition_m", self.transition_m),
            ("wavelength_m", self.wavelength_m),
            ("height_m", self.height_m),
            ("waves", self.waves.map(f64::from)),
            ("at_m", self.at_m),
            ("rail_length_m", self.rail_length_m),
            ("gap_m", self.gap_m),
            ("count", self.count.map(f64::from)),
        ];
        numbers.iter().find(|(_, value)| value.is_some()).map(|(name, _)| *name)
    }
}
