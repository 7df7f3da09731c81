//! Tables of numbers with ranges and defaults: the basis for reading, checking and documenting
//! settings.

use model::vehicle::ParameterError;
use thiserror::Error;

/// One number of a settings table.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Setting {
    /// Name of the field, unit included.
    pub name: &'static str,
    /// Meaning of the field.
    pub meaning: &'static str,
    /// Smallest allowed value.
    pub min: f64,
    /// Largest allowed value.
    pub max: f64,
    /// Value if a file leaves the field out.
    pub default: f64,
}

/// Why settings are refused.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum SettingsError {
    /// A value is out of its range or not a number.
    #[error("{field} = {value}: allowed is {min} to {max}")]
    OutOfRange {
        /// Table and name.
        field: String,
        /// The value.
        value: f64,
        /// Smallest allowed value.
        min: f64,
        /// Largest allowed value.
        max: f64,
    },
    /// A name in `[plant.vehicle]` that does not belong to the simulated vehicle.
    #[error("plant.vehicle.{name}: unknown name: allowed are the fields of {allowed}, where the vehicle has them")]
    UnknownField {
        /// Table and field.
        name: String,
        /// The allowed tables.
        allowed: String,
    },
    /// The changed parameters do not describe a vehicle.
    #[error("plant.vehicle.{0}")]
    Vehicle(ParameterError),
    /// The curve of the open-circuit voltage is invalid.
    #[error("plant.battery.open_circuit_v: {0}")]
    Curve(&'static str),
}

impl SettingsError {
    /// The field that the error is about, as a path in the scenario.
    pub fn field(&self) -> String {
        match self {
            Self::OutOfRange { field, .. } => field.clone(),
            Self::UnknownField { name, .. } => format!("plant.vehicle.{name}"),
            Self::Vehicle(error) => {
                let (group, field) = error.place();
                format!("plant.vehicle.{group}.{field}")
            }
            Self::Curve(_) => "plant.battery.open_circuit_v".to_owned(),
        }
    }
}

/// Refuses a value outside its range, NaN included.
pub(crate) fn within(field: impl Into<String>, value: f64, min: f64, max: f64) -> Result<(), SettingsError> {
    if value >= min && value <= max {
        Ok(())
    } else {
        Err(SettingsError::OutOfRange {
            field: field.into(),
            value,
            min,
            max,
        })
    }
}

/// Defines a table of numbers with their meanings, ranges and defaults.
macro_rules! settings_table {
    (
        $(#[doc = $doc:literal])*
        $name:ident {
            $( $(#[doc = $meaning:literal])+ $field:ident: $min:literal to $max:literal = $default:literal, )+
        }
    ) => {
        $(#[doc = $doc])*
        #[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
        #[serde(deny_unknown_fields, default)]
        pub struct $name {
            $( $(#[doc = $meaning])+ #[doc = concat!("\n\nAllowed: ", stringify!($min), " to ", stringify!($max), ".")] pub $field: f64, )+
        }

        impl Default for $name {
            fn default() -> Self {
                Self { $($field: $default),+ }
            }
        }

        impl $name {
            /// The fields, in order.
            pub const FIELDS: &'static [Setting] = &[
                $( Setting {
                    name: stringify!($field),
                    meaning: concat!($($meaning),+),
                    min: $min,
                    max: $max,
                    default: $default,
                }, )+
            ];

            /// Checks every value; `table` is the table's name in messages.
            ///
            /// # Errors
            /// The first value out of its range.
            pub fn check(&self, table: &str) -> Result<(), SettingsError> {
                $( within(format!("{table}.{}", stringify!($field)), self.$field, $min, $max)?; )+
                Ok(())
            }
        }
    };
}
pub(crate) use settings_table;
