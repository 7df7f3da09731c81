//! The steps of a scenario, each with its time and action.

use serde::Deserialize;
use toml::Spanned;
use toml::de::{DeTable, DeValue, ValueDeserializer};

use super::nearest::nearest;
use super::sensor::Sensor;
use super::wire::{LinkStep, WireDirection};
use super::world::{MotorName, WorldStep};
use plant::body::PushedBody;
use plant::fault::SensorFault;

/// Something that happens at a time.
#[derive(Debug, Clone, PartialEq)]
pub struct Step {
    /// Time of the step, s.
    pub at_s: f64,
    /// Action of the step.
    pub action: Action,
}

/// Why a table of a file is not a valid step.
pub(super) enum NoStep {
    /// A field is wrong, in the words of the file.
    Field {
        /// The field's name.
        name: &'static str,
        /// The field's value; `None` if it is missing.
        value: Option<String>,
        /// The allowed values.
        allowed: String,
    },
    /// The parser's error about the action's fields.
    Reader(toml::de::Error),
}

impl Step {
    /// Reads the table of one step.
    ///
    /// Written by hand, because for a table whose `action` decides its fields serde reports neither the wrong field
    /// nor its place.
    pub(super) fn read(table: Spanned<DeTable<'_>>) -> Result<Self, NoStep> {
        let span = table.span();
        let mut table = table.into_inner();
        let at_s = match take(&mut table, "at_s").map(Spanned::into_inner) {
            Some(DeValue::Float(number)) => number.as_str().parse().ok(),
            Some(DeValue::Integer(number)) => number.as_str().parse().ok(),
            _ => None,
        };
        let at_s = at_s.ok_or_else(|| NoStep::Field {
            name: "at_s",
            value: None,
            allowed: "a step needs at_s, a time in s".to_owned(),
        })?;
        let name = take(&mut table, "action");
        let Some(name) = name
            .as_ref()
            .and_then(|value| value.get_ref().as_str())
            .map(str::to_owned)
        else {
            return Err(NoStep::Field {
                name: "action",
                value: None,
                allowed: format!("a step needs an action: allowed is {}", Action::all_names().join(", ")),
            });
        };
        if Action::PLAIN.contains(&name.as_str())
            && let Some((unknown, _)) = table.iter().next()
        {
            let name = &*unknown.get_ref().clone();
            return Err(NoStep::Field {
                name: "action",
                value: None,
                allowed: format!("unknown name `{name}`: allowed beside this action is at_s alone"),
            });
        }
        // Wraps the fields in the action's name, the form in which serde reads an enum.
        let fields = Spanned::new(span.clone(), DeValue::Table(table));
        let mut named = DeTable::new();
        named.insert(Spanned::new(span.clone(), name.clone().into()), fields);
        let reader = || ValueDeserializer::from(Spanned::new(span, DeValue::Table(named)));
        let action = if WorldStep::NAMES.contains(&name.as_str()) {
            WorldStep::deserialize(reader()).map(Action::World)
        } else if LinkStep::NAMES.contains(&name.as_str()) {
            LinkStep::deserialize(reader()).map(Action::Link)
        } else if Action::NAMES.contains(&name.as_str()) {
            Action::deserialize(reader())
        } else {
            let names = Action::all_names();
            return Err(NoStep::Field {
                name: "action",
                value: Some(format!("{name:?}")),
                allowed: format!(
                    "unknown action{}; allowed is {}",
                    nearest(&name, &names),
                    names.join(", ")
                ),
            });
        };
        action.map(|action| Self { at_s, action }).map_err(NoStep::Reader)
    }

    /// The field of this step that needs a vehicle with a spar, and the part that it needs.
    pub(super) fn of_spar(&self) -> Option<(&'static str, &'static str)> {
        match self.action {
            Action::SensorFault { sensor, .. } => match sensor {
                Sensor::SparImu => Some(("sensor", "IMU on a spar")),
                Sensor::BallastEncoder => Some(("sensor", "encoder of a ballast motor")),
                Sensor::ArmImu | Sensor::LeftEncoder | Sensor::RightEncoder => None,
            },
            Action::World(world) => match world {
                WorldStep::Push {
                    on: PushedBody::Spar, ..
                } => Some(("on", "spar to push")),
                WorldStep::EncoderLoss { motor, .. }
                | WorldStep::MotorLeads { motor, .. }
                | WorldStep::HalfBridge { motor, .. } => {
                    (motor == MotorName::Ballast).then_some(("motor", "ballast motor"))
                }
                _ => None,
            },
            _ => None,
        }
    }
}

/// Takes a field out of a table.
fn take<'t>(table: &mut DeTable<'t>, name: &str) -> Option<Spanned<DeValue<'t>>> {
    let key = table.keys().find(|key| key.get_ref().as_ref() == name)?.clone();
    table.remove(&key)
}

/// The vocabulary of scenarios.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub enum Action {
    /// The operator asks to arm.
    Arm,
    /// The operator asks to disarm.
    Disarm,
    /// The operator clears latched faults.
    ClearFaults,
    /// The operator sends this command from now on.
    Drive {
        /// Speed, m/s.
        #[serde(default)]
        speed_m_s: f64,
        /// Yaw rate, rad/s, to the left positive.
        #[serde(default)]
        yaw_rate_rad_s: f64,
    },
    /// The operator stops sending drive commands.
    Silence,
    /// The operator sends drive commands again, starting with standstill.
    Speak,
    /// The emergency stop is pressed or released.
    EmergencyStop {
        /// Whether the stop is pressed.
        pressed: bool,
    },
    /// A sensor fails or, with `fault = "none"`, works again.
    SensorFault {
        /// The sensor.
        sensor: Sensor,
        /// How.
        fault: SensorFault,
    },
    /// The battery's open-circuit voltage changes.
    Battery {
        /// The new voltage, V.
        open_circuit_v: f64,
    },
    /// Noise on the serial line, from the scenario's seed.
    LinkNoise {
        /// Number of bytes.
        bytes: u32,
    },
    /// Chocks are put to the wheels or taken away.
    Chocks {
        /// Whether the chocks are in place.
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
    /// Whether the action delays or loses what the board sends.
    pub fn faults_the_way_back(&self) -> bool {
        matches!(self, Self::Link(LinkStep::Link { direction, .. }) if *direction != WireDirection::ToBoard)
    }

    /// The names of all steps.
    fn all_names() -> Vec<&'static str> {
        [&Self::NAMES[..], &WorldStep::NAMES, &LinkStep::NAMES].concat()
    }

    /// The names in files of the steps that belong neither to the world nor to the link.
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
    /// The steps without fields.
    const PLAIN: [&'static str; 5] = ["arm", "disarm", "clear-faults", "silence", "speak"];
}
