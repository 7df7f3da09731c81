//! Scenario files.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use serde::Deserialize;

use super::error::ScenarioError;
use super::metrics;
use super::nearest::nearest;
use super::sensor::{FaultName, Sensor};
use super::wire::LinkStep;
use super::world::WorldStep;
use plant::fault::SensorFault;
use plant::settings::PlantSettings;
use plant::terrain::Terrain;

/// One scenario.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Scenario {
    /// One line: what it shows.
    pub title: String,
    /// Length in s.
    pub duration_s: f64,
    /// Seed of every sensor's noise.
    #[serde(default = "default_seed")]
    pub seed: u64,
    /// Vehicle file, from the scenario's folder; the reference vehicle if left out.
    pub vehicle: Option<PathBuf>,
    /// Chocks hold the wheels until the vehicle is armed.
    #[serde(default)]
    pub chocked_until_armed: bool,
    /// The ground.
    #[serde(default)]
    pub terrain: Terrain,
    /// How the simulated vehicle differs from the vehicle file.
    #[serde(default)]
    pub plant: PlantSettings,
    /// What happens, in order of time.
    #[serde(default, rename = "step")]
    pub steps: Vec<Step>,
    /// Bounds of the metrics, `name = [least, most]`.
    #[serde(default)]
    pub metrics: BTreeMap<String, [f64; 2]>,
}

const fn default_seed() -> u64 {
    1
}

/// Something that happens at a time.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(try_from = "toml::Table")]
pub struct Step {
    /// When, s.
    pub at_s: f64,
    /// What.
    pub action: Action,
}

impl TryFrom<toml::Table> for Step {
    type Error = String;

    /// By hand: serde cannot refuse unknown names in a flattened enum.
    fn try_from(mut table: toml::Table) -> Result<Self, String> {
        let at_s = match table.remove("at_s") {
            Some(toml::Value::Float(at_s)) => at_s,
            Some(toml::Value::Integer(at_s)) => at_s as f64,
            _ => return Err("a step needs at_s, a time in s".to_owned()),
        };
        let name = table.get("action").and_then(toml::Value::as_str).unwrap_or_default();
        let action = if WorldStep::NAMES.contains(&name) {
            table.clone().try_into().map(Action::World)
        } else if LinkStep::NAMES.contains(&name) {
            table.clone().try_into().map(Action::Link)
        } else if Action::NAMES.contains(&name) {
            table.clone().try_into::<Action>()
        } else {
            let names = [&Action::NAMES[..], &WorldStep::NAMES, &LinkStep::NAMES].concat();
            let meant = nearest(name, &names);
            return Err(format!(
                "unknown action `{name}` at {at_s} s{meant}; allowed is {}",
                names.join(", ")
            ));
        };
        let action = action.map_err(|error| error.message().to_owned())?;
        // A variant without values ignores what stands beside it.
        if !matches!(
            action,
            Action::Drive { .. }
                | Action::EmergencyStop { .. }
                | Action::SensorFault { .. }
                | Action::Battery { .. }
                | Action::LinkNoise { .. }
                | Action::Chocks { .. }
                | Action::World(_)
                | Action::Link(_)
        ) && let Some(name) = table.keys().find(|name| *name != "action")
        {
            return Err(format!("unknown name `{name}` in a step"));
        }
        Ok(Self { at_s, action })
    }
}

/// The vocabulary of scenarios.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(tag = "action", rename_all = "kebab-case", deny_unknown_fields)]
pub enum Action {
    /// The operator asks to arm.
    Arm,
    /// The operator asks to disarm.
    Disarm,
    /// The operator clears latched faults.
    ClearFaults,
    /// The operator commands this from now on.
    Drive {
        /// Speed, m/s.
        #[serde(default)]
        speed_m_s: f64,
        /// Yaw rate, rad/s, to the left positive.
        #[serde(default)]
        yaw_rate_rad_s: f64,
    },
    /// The operator falls silent: no more drive commands.
    Silence,
    /// The operator speaks again, standing still.
    Speak,
    /// The emergency stop is pressed or released.
    EmergencyStop {
        /// Pressed.
        pressed: bool,
    },
    /// A sensor fails, or works again (`fault = "none"`).
    SensorFault {
        /// Which.
        sensor: Sensor,
        /// How.
        fault: FaultName,
    },
    /// The battery's open-circuit voltage changes.
    Battery {
        /// To this, V.
        open_circuit_v: f64,
    },
    /// Noise on the serial line, from the scenario's seed.
    LinkNoise {
        /// How many bytes.
        bytes: u32,
    },
    /// Chocks are put to the wheels or taken away.
    Chocks {
        /// In place.
        chocked: bool,
    },
    /// Something happens to the vehicle.
    #[serde(skip)]
    World(WorldStep),
    /// Something happens to the link.
    #[serde(skip)]
    Link(LinkStep),
}

impl Action {
    /// The names of the steps that are neither the world's nor the link's, as in files.
    pub const NAMES: [&'static str; 11] = [
        "arm",
        "disarm",
        "clear-faults",
        "drive",
        "silence",
        "speak",
        "emergency-stop",
        "sensor-fault",
        "battery",
        "link-noise",
        "chocks",
    ];
}

/// The scenario that `cargo run` shows.
pub const DEFAULT: &str = include_str!("../../../../tests/scenarios/slope-drive.toml");
/// Its name in messages.
pub const DEFAULT_NAME: &str = "tests/scenarios/slope-drive.toml";

const DURATION_MAX_S: f64 = 3600.0;
const SPEED_MAX_M_S: f64 = 20.0;
/// Most steps of a scenario.
const STEPS_MAX: usize = 10_000;
/// Most bytes of noise of all steps of a scenario together.
const NOISE_MAX_BYTES: u32 = 1_000_000;

impl Scenario {
    /// Reads and checks the scenario at `path`.
    ///
    /// # Errors
    /// The first thing wrong with it, with file, field and what is allowed.
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
    /// The first thing wrong with it.
    pub fn parse(file: &str, text: &str) -> Result<Self, ScenarioError> {
        let scenario: Self = toml::from_str(text).map_err(|error| {
            let file = file.to_owned();
            if is_vehicle(text) {
                return ScenarioError::Vehicle { file };
            }
            // The reader shows the place of the first step, whichever is wrong.
            let reason = wrong_step(text).unwrap_or_else(|| error.to_string().trim_end().replace('\n', "\n  "));
            ScenarioError::Syntax { file, reason }
        })?;
        scenario.check(file).map_err(|error| error.at_line_of_step(text))?;
        Ok(scenario)
    }

    fn check(&self, file: &str) -> Result<(), ScenarioError> {
        let within = |field: String, value: f64, min: f64, max: f64| {
            // Written so that NaN is refused.
            if value >= min && value <= max {
                Ok(())
            } else {
                Err(ScenarioError::Value {
                    file: file.to_owned(),
                    field,
                    value: value.to_string(),
                    allowed: format!("allowed is {min} to {max}"),
                })
            }
        };
        within("duration_s".into(), self.duration_s, 0.1, DURATION_MAX_S)?;
        self.plant.check().map_err(|error| ScenarioError::Plant {
            file: file.to_owned(),
            error,
        })?;
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
                    within(format!("step[{i}].speed_m_s"), speed_m_s, -SPEED_MAX_M_S, SPEED_MAX_M_S)?;
                    within(
                        format!("step[{i}].yaw_rate_rad_s"),
                        yaw_rate_rad_s,
                        -SPEED_MAX_M_S,
                        SPEED_MAX_M_S,
                    )?;
                }
                Action::Battery { open_circuit_v } => {
                    within(format!("step[{i}].open_circuit_v"), open_circuit_v, 0.0, 100.0)?;
                }
                Action::SensorFault { sensor, fault } if fault.0 == SensorFault::NoForce && !sensor.is_imu() => {
                    return Err(ScenarioError::Value {
                        file: file.to_owned(),
                        field: format!("step[{i}].fault"),
                        value: fault.0.name().to_owned(),
                        allowed: "an encoder measures no force: allowed with arm-imu and spar-imu".to_owned(),
                    });
                }
                _ => {}
            }
        }
        for (name, [least, most]) in &self.metrics {
            let value = |value: String, allowed: String| ScenarioError::Value {
                file: file.to_owned(),
                field: format!("metrics.{name}"),
                value,
                allowed,
            };
            if !metrics::NAMES.contains(&name.as_str()) {
                return Err(value(
                    String::from("[..]"),
                    format!(
                        "unknown metric{}; `drive --json` lists them all",
                        nearest(name, &metrics::NAMES)
                    ),
                ));
            }
            if least.is_nan() || most.is_nan() || least > most {
                return Err(value(
                    format!("[{least}, {most}]"),
                    "the least must not exceed the most".into(),
                ));
            }
        }
        Ok(())
    }
}

/// The steps of a scenario, as they stand in its text.
fn raw_steps(text: &str) -> Option<Vec<toml::Spanned<toml::Table>>> {
    #[derive(Deserialize)]
    struct Raw {
        #[serde(default)]
        step: Vec<toml::Spanned<toml::Table>>,
    }
    Some(toml::from_str::<Raw>(text).ok()?.step)
}

/// The line in which a step begins, from 1.
fn line_of(text: &str, step: &toml::Spanned<toml::Table>) -> Option<usize> {
    Some(1 + text.get(..step.span().start)?.matches('\n').count())
}

impl ScenarioError {
    /// With the line of the step that it is about, if it is about one.
    fn at_line_of_step(mut self, text: &str) -> Self {
        if let Self::Value { field, .. } = &mut self
            && let Some((number, _)) = field.strip_prefix("step[").and_then(|rest| rest.split_once(']'))
            && let Ok(number) = number.parse::<usize>()
            && let Some(line) = raw_steps(text).and_then(|steps| line_of(text, steps.get(number)?))
        {
            *field = format!("line {line}: {field}");
        }
        self
    }
}

/// What is wrong with the first step that is none, with its line and its place among the steps.
fn wrong_step(text: &str) -> Option<String> {
    raw_steps(text)?.into_iter().enumerate().find_map(|(i, step)| {
        let line = line_of(text, &step)?;
        let reason = Step::try_from(step.into_inner()).err()?;
        Some(format!("line {line}: step[{i}]: {reason}"))
    })
}

/// Whether a text is a vehicle file, given in place of a scenario.
fn is_vehicle(text: &str) -> bool {
    text.parse::<toml::Table>()
        .is_ok_and(|root| ["body", "planar"].iter().any(|table| root.contains_key(*table)))
}

#[cfg(test)]
mod tests;
