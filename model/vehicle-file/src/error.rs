//! Errors in a vehicle file.

use model::vehicle::ParameterError;

use crate::place::TextPlace;

/// An error in a vehicle file. Every message names the file, and the field with its allowed range if the
/// error concerns a field.
#[derive(Debug, thiserror::Error)]
pub enum VehicleFileError {
    /// The file cannot be read.
    #[error("{file}: {reason}")]
    Unreadable {
        /// The file.
        file: String,
        /// Why.
        reason: String,
    },
    /// The file is not TOML.
    #[error("{file}: {reason}")]
    Syntax {
        /// The file.
        file: String,
        /// Where and why.
        reason: String,
    },
    /// The file is a scenario.
    #[error("{file}: this is a scenario, not a vehicle file: `hil-sim drive {file}` drives it")]
    Scenario {
        /// The file.
        file: String,
    },
    /// A table is missing.
    #[error("{file}: table [{table}] is missing")]
    MissingTable {
        /// The file.
        file: String,
        /// The table.
        table: &'static str,
    },
    /// A value that should be a table is not a table.
    #[error("{file}: {table} = {value} is not a table: its fields stand below [{table}]")]
    NotATable {
        /// The file.
        file: String,
        /// The table.
        table: &'static str,
        /// The value in the file.
        value: String,
    },
    /// A field is missing.
    #[error("{file}: {table}.{name} is missing: allowed is {min} to {max}")]
    MissingField {
        /// The file.
        file: String,
        /// The table.
        table: &'static str,
        /// The field.
        name: &'static str,
        /// Smallest allowed value.
        min: f64,
        /// Largest allowed value.
        max: f64,
    },
    /// Several fields are missing, in one table or in several.
    #[error("{file}: {count} fields are missing; vehicles/small.toml is a whole file to start from:\n{skeleton}")]
    MissingFields {
        /// The file.
        file: String,
        /// Number of missing fields.
        count: usize,
        /// The fields under their tables, each with its range and meaning.
        skeleton: String,
    },
    /// A field is not a number.
    #[error("{file}: {table}.{name} = {value} is not a number: allowed is {min} to {max}")]
    NotANumber {
        /// The file.
        file: String,
        /// The table.
        table: &'static str,
        /// The field.
        name: &'static str,
        /// The value.
        value: String,
        /// Smallest allowed value.
        min: f64,
        /// Largest allowed value.
        max: f64,
    },
    /// A field that is a choice is missing or has another value.
    #[error("{file}: {table}.{name} {}: allowed is {}", given(value.as_deref()), quoted(choices))]
    NotAChoice {
        /// The file.
        file: String,
        /// The table.
        table: &'static str,
        /// The field.
        name: &'static str,
        /// The value; `None` if the field is missing.
        value: Option<String>,
        /// The choices.
        choices: &'static [&'static str],
    },
    /// An unknown name.
    #[error("{file}: unknown name `{name}`: allowed here is {allowed}")]
    Unknown {
        /// The file.
        file: String,
        /// The name with its table.
        name: String,
        /// The names that are known in this table.
        allowed: String,
    },
    /// A value out of range, or values that contradict each other.
    #[error("{file}: {error}")]
    Parameter {
        /// The file.
        file: String,
        /// The field, its value and what is allowed.
        error: ParameterError,
    },
    /// One of the other errors, with its place in the file.
    #[error("{error} ({place})")]
    At {
        /// What is wrong.
        error: Box<Self>,
        /// The place.
        place: TextPlace,
    },
}

impl VehicleFileError {
    pub(crate) fn of_parameter(file: &str, error: ParameterError) -> Self {
        let file = file.to_owned();
        Self::Parameter { file, error }
    }

    /// The error with the place in `text` of its field or table, if the text contains that.
    pub(crate) fn placed(self, text: &str) -> Self {
        match self.path().and_then(|path| TextPlace::find(text, &path)) {
            Some(place) => Self::At {
                error: Box::new(self),
                place,
            },
            None => self,
        }
    }

    /// The field or table that the error concerns, as a path in the file.
    fn path(&self) -> Option<String> {
        Some(match self {
            Self::NotATable { table, .. } => (*table).to_owned(),
            Self::MissingField { table, name, .. }
            | Self::NotANumber { table, name, .. }
            | Self::NotAChoice { table, name, .. } => format!("{table}.{name}"),
            Self::Unknown { name, .. } => name.clone(),
            Self::Parameter { error, .. } => {
                let (group, field) = error.place();
                format!("{group}.{field}")
            }
            Self::Unreadable { .. }
            | Self::Syntax { .. }
            | Self::Scenario { .. }
            | Self::MissingTable { .. }
            | Self::MissingFields { .. }
            | Self::At { .. } => return None,
        })
    }
}

/// The field's value as the file gives it.
fn given(value: Option<&str>) -> String {
    value.map_or("is missing".to_owned(), |value| format!("= {value}"))
}

/// Names as TOML writes them, separated by commas.
pub(crate) fn quoted(names: &[&str]) -> String {
    let names: Vec<String> = names.iter().map(|name| format!("{name:?}")).collect();
    names.join(", ")
}
