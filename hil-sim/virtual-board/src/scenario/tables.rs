//! The tables of a scenario, but for its steps, as a file writes them.

use std::collections::BTreeMap;
use std::path::PathBuf;

use serde::Deserialize;
use serde::de::IgnoredAny;

use super::bound::Bound;
use plant::settings::PlantSettings;
use plant::terrain::TerrainFile;

/// A scenario as a file writes it, but for its steps.
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
    /// Read by themselves; here for the list of names that are allowed.
    #[serde(default, rename = "step")]
    _steps: IgnoredAny,
    #[serde(default)]
    pub(super) metrics: BTreeMap<String, Bound>,
}

const fn default_seed() -> u64 {
    1
}
