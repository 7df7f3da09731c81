//! What is wrong with a scenario file.

use plant::settings::SettingsError;
use plant::terrain::TerrainError;
use thiserror::Error;
use vehicle_file::place::TextPlace;

/// Checks one number of a step: its name, value, least and most.
pub type Within<'a> = &'a dyn Fn(&str, f64, f64, f64) -> Result<(), ScenarioError>;

/// What is wrong with a scenario file.
#[derive(Debug, Error)]
pub enum ScenarioError {
    /// The file cannot be read.
    #[error("{file}: {reason}")]
    Unreadable {
        /// The file.
        file: String,
        /// Why.
        reason: String,
    },
    /// It is not TOML, a name is unknown or missing, or a value is of the wrong kind.
    #[error("{file}: {reason}")]
    Syntax {
        /// The file.
        file: String,
        /// Where and why.
        reason: String,
    },
    /// It is a vehicle file.
    #[error("{file}: this is a vehicle file, not a scenario: `hil-sim drive --vehicle {file}` drives it")]
    Vehicle {
        /// The file.
        file: String,
    },
    /// A setting of `[plant]` is wrong.
    #[error("{file}: {error}")]
    Plant {
        /// The file.
        file: String,
        /// The field, its value and what is allowed.
        error: SettingsError,
    },
    /// The terrain is none, or the vehicle's wheels cannot follow it.
    #[error("{file}: {error}")]
    Terrain {
        /// The file.
        file: String,
        /// The field, its value and what is allowed.
        error: TerrainError,
    },
    /// One of the others, with its place in the file.
    #[error("{error} ({place})")]
    At {
        /// What is wrong.
        error: Box<Self>,
        /// Where it stands.
        place: TextPlace,
    },
    /// A value is out of range.
    #[error("{file}: {field} = {value}: {allowed}")]
    Value {
        /// The file.
        file: String,
        /// Which value.
        field: String,
        /// The value.
        value: String,
        /// What is allowed.
        allowed: String,
    },
}

impl ScenarioError {
    /// With this place, if there is one.
    pub(super) fn at(self, place: Option<TextPlace>) -> Self {
        match place {
            Some(place) => Self::At {
                error: Box::new(self),
                place,
            },
            None => self,
        }
    }
}
