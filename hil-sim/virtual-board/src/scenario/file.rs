//! Scenario files.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::bounds_of::BoundsOf;
use super::error::ScenarioError;
use super::metrics;
use super::nearest::nearest;
use super::reading;
use super::step::{Action, Step};
use model::command::DriveCommand;
use plant::fault::SensorFault;
use plant::settings::PlantSettings;
use plant::terrain::Terrain;
use vehicle_file::place::TextPlace;

/// One scenario.
#[derive(Debug, Clone)]
pub struct Scenario {
    /// What the scenario shows, in one line.
    pub title: String,
    /// Length in s.
    pub duration_s: f64,
    /// Seed of every sensor's noise.
    pub seed: u64,
    /// Vehicle file, relative to the scenario's folder; `None` means the reference vehicle.
    pub vehicle: Option<PathBuf>,
    /// Whether chocks hold the wheels until the vehicle is armed.
    pub chocked_until_armed: bool,
    /// The ground.
    pub terrain: Terrain,
    /// Differences between the simulated vehicle and the vehicle file.
    pub plant: PlantSettings,
    /// The steps, in order of time.
    pub steps: Vec<Step>,
    /// Bounds of the metrics, `name = [least, most]`.
    pub metrics: BTreeMap<String, [f64; 2]>,
    /// The vehicle to which the bounds apply.
    pub bounds_of: BoundsOf,
    /// The file of the scenario, for messages; the default names no file.
    pub source: ScenarioSource,
}

/// A scenario's file. Messages give its name and the place in its text.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct ScenarioSource {
    file: String,
    text: Arc<str>,
}

impl ScenarioSource {
    /// `error` with the place of `path` in the text.
    pub(super) fn placed(&self, error: ScenarioError, path: &str) -> ScenarioError {
        error.at(TextPlace::find(&self.text, path))
    }

    /// The file's name.
    pub(super) fn file(&self) -> String {
        self.file.clone()
    }

    /// The error for a part that the vehicle does not have, with its place.
    pub(super) fn none_here(&self, path: &str, why: impl Into<String>) -> ScenarioError {
        let error = ScenarioError::Syntax {
            file: self.file(),
            reason: format!("{path}: {}", why.into()),
        };
        self.placed(error, path)
    }

    /// The error for a value that is not allowed, with its place.
    pub(super) fn value(&self, path: &str, value: &dyn std::fmt::Display, allowed: impl Into<String>) -> ScenarioError {
        let error = ScenarioError::Value {
            file: self.file(),
            field: path.to_owned(),
            value: value.to_string(),
            allowed: allowed.into(),
        };
        self.placed(error, path)
    }
}

/// The scenario that `cargo run` drives.
pub const DEFAULT: &str = include_str!("../../../../tests/scenarios/slope-drive.toml");
/// Name of the default scenario in messages.
pub const DEFAULT_NAME: &str = "tests/scenarios/slope-drive.toml";

const DURATION_MAX_S: f64 = 3600.0;
/// Largest number of steps of a scenario.
const STEPS_MAX: usize = 10_000;
/// Largest number of noise bytes of all steps of a scenario together.
const NOISE_MAX_BYTES: u32 = 1_000_000;

impl Scenario {
    /// Reads and checks the scenario at `path`.
    ///
    /// # Errors
    /// The first error, with file, field and the allowed values.
    pub fn read(path: &Path) -> Result<Self, ScenarioError> {
        let file = path.display().to_string();
        let text = vehicle_file::read_text(path).map_err(|reason| ScenarioError::Unreadable {
            file: file.clone(),
            reason,
        })?;
        let mut scenario = Self::parse(&file, &text)?;
        if let (Some(vehicle), Some(folder)) = (&mut scenario.vehicle, path.parent()) {
            *vehicle = folder.join(&vehicle);
        }
        Ok(scenario)
    }

    /// Checks a scenario's text; `file` is its name in messages.
    ///
    /// # Errors
    /// The first error.
    pub fn parse(file: &str, text: &str) -> Result<Self, ScenarioError> {
        let source = ScenarioSource {
            file: file.to_owned(),
            text: text.into(),
        };
        let (read, steps) = reading::read(&source.file, text)?;
        let terrain = Terrain::try_from(read.terrain);
        let terrain = terrain.map_err(|error| source.terrain(error))?;
        let mut metrics = BTreeMap::new();
        for (name, bound) in read.metrics {
            let path = format!("metrics.{name}");
            let Some(kind) = metrics::kind(&name) else {
                let near = nearest(&name, &metrics::NAMES);
                let allowed = format!("unknown metric{near}; `drive --json` lists them all");
                return Err(source.value(&path, &"[..]", allowed));
            };
            let bounds = bound.of(kind);
            let bounds = bounds.map_err(|allowed| source.value(&path, &bound, allowed))?;
            metrics.insert(name, bounds);
        }
        let scenario = Self {
            title: read.title,
            duration_s: read.duration_s,
            seed: read.seed,
            vehicle: read.vehicle,
            chocked_until_armed: read.chocked_until_armed,
            terrain,
            plant: read.plant,
            steps,
            metrics,
            bounds_of: BoundsOf::default(),
            source,
        };
        scenario.check()?;
        Ok(scenario)
    }

    fn check(&self) -> Result<(), ScenarioError> {
        let within = |field: String, value: f64, min: f64, max: f64| {
            // Written so that NaN is refused.
            if value >= min && value <= max {
                Ok(())
            } else {
                Err(self.source.value(&field, &value, format!("allowed is {min} to {max}")))
            }
        };
        within("duration_s".into(), self.duration_s, 0.1, DURATION_MAX_S)?;
        let settings = self.plant.check();
        settings.map_err(|error| self.source.settings(error))?;
        within("number of steps".into(), self.steps.len() as f64, 0.0, STEPS_MAX as f64)?;
        let mut last_s = 0.0;
        let mut noise_left = NOISE_MAX_BYTES;
        for (i, step) in self.steps.iter().enumerate() {
            within(format!("step[{i}].at_s"), step.at_s, last_s, self.duration_s)?;
            last_s = step.at_s;
            let of_step = |name: &str, value, min, max| within(format!("step[{i}].{name}"), value, min, max);
            match step.action {
                Action::World(world) => world.check(&of_step)?,
                Action::Link(link) => link.check(&of_step)?,
                Action::LinkNoise { bytes } => {
                    of_step("bytes", f64::from(bytes), 0.0, f64::from(noise_left))?;
                    noise_left -= bytes;
                }
                Action::Drive {
                    speed_m_s,
                    yaw_rate_rad_s,
                } => {
                    let largest = DriveCommand::largest();
                    let [speed_max, yaw_max] = [largest.speed_m_s, largest.yaw_rate_rad_s].map(f64::from);
                    of_step("speed_m_s", speed_m_s, -speed_max, speed_max)?;
                    of_step("yaw_rate_rad_s", yaw_rate_rad_s, -yaw_max, yaw_max)?;
                }
                Action::Battery { open_circuit_v } => {
                    within(format!("step[{i}].open_circuit_v"), open_circuit_v, 0.0, 100.0)?;
                }
                Action::SensorFault { sensor, fault } if fault == SensorFault::NoForce && !sensor.is_imu() => {
                    return Err(self.source.value(
                        &format!("step[{i}].fault"),
                        &"no-force",
                        "an encoder measures no force: allowed with arm-imu and spar-imu",
                    ));
                }
                _ => {}
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests;
