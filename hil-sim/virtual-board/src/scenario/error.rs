//! An error in a scenario file.

use plant::settings::SettingsError;
use plant::terrain::TerrainError;
use thiserror::Error;
use vehicle_file::place::TextPlace;

/// Checks one number of a step: its name, value, least and most.
pub type Within<'a> = &'a dyn Fn(&str, f64, f64, f64) -> Result<(), ScenarioError>;

/// An error in a scenario file.
#[derive(Debug, Error)]
pub enum ScenarioError {
    /// The file cannot be read.
    #[error("{file}: {reason}")]
    Unreadable {
        /// The file.
        file: String,
        /// The reason.
        reason: String,
    },
    /// The text is not TOML, a name is unknown or missing, or a value is of the wrong kind.
    #[error("{file}: {reason}")]
    Syntax {
        /// The file.
        file: String,
        /// The place and the reason.
        reason: String,
    },
    /// The file is a vehicle file.
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
        /// The field, its value and the allowed values.
        error: SettingsError,
    },
    /// The terrain is invalid, or the vehicle's wheels cannot follow it.
    #[error("{file}: {error}")]
    Terrain {
        /// The file.
        file: String,
        /// The field, its value and the allowed values.
        error: TerrainError,
    },
    /// One of the other errors, with its place in the file.
    #[error("{error} ({place})")]
    At {
        /// The error.
        error: Box<Self>,
        /// The place of the error.
        place: TextPlace,
    },
    /// A value is out of range.
    #[error("{file}: {field} = {value}: {allowed}")]
    Value {
        /// The file.
        file: String,
        /// The name of the value.
        field: String,
        /// The value.
        value: String,
        /// The allowed values.
        allowed: String,
    },
}

impl ScenarioError {
    /// The error with this place, if the place is known.
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
