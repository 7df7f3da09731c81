//! The tables of a scenario file, except its steps.

use std::collections::BTreeMap;
use std::path::PathBuf;

use serde::Deserialize;
use serde::de::IgnoredAny;

use super::bound::Bound;
use plant::settings::PlantSettings;
use plant::terrain::TerrainFile;

/// A scenario file's contents, except its steps.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct ScenarioFile {
    pub(super) title: String,
    pub(super) duration_s: f64,
    #[serde(default = "default_seed")]
    pub(super) seed: u64,
    pub(super) vehicle: Option<PathBuf>,
    #[serde(default)]
    pub(super) chocked_until_armed: bool,
    #[serde(default)]
    pub(super) terrain: TerrainFile,
    #[serde(default)]
    pub(super) plant: PlantSettings,
    /// The steps are read separately. This field adds their name to the list of allowed names.
    #[serde(default, rename = "step")]
    _steps: IgnoredAny,
    #[serde(default)]
    pub(super) metrics: BTreeMap<String, Bound>,
}

const fn default_seed() -> u64 {
    1
}
