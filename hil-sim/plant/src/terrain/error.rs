//! What a terrain is refused for.

use thiserror::Error;

/// Why a terrain is refused.
#[derive(Debug, Error, PartialEq)]
pub enum TerrainError {
    /// A number is out of its range or not a number.
    #[error("terrain: {field} = {value}: allowed is {min} to {max}")]
    OutOfRange {
        /// Table and key.
        field: String,
        /// The refused value.
        value: f64,
        /// Smallest allowed value.
        min: f64,
        /// Largest allowed value.
        max: f64,
    },
    /// A number is out of the range that the wheels can follow.
    #[error("terrain: {field} = {value}: allowed is {min} to {max} for wheels of {radius_m} m radius")]
    BeyondWheel {
        /// Table and key.
        field: String,
        /// The refused value.
        value: f64,
        /// Smallest allowed value.
        min: f64,
        /// Largest allowed value.
        max: f64,
        /// The wheels' radius.
        radius_m: f64,
    },
    /// A field of a feature's kind is missing.
    #[error("terrain: {field} is missing")]
    Missing {
        /// Table and key.
        field: String,
    },
    /// A field of another kind of feature.
    #[error("terrain: {field}: a feature of this kind has no such field")]
    NotOfKind {
        /// Table and key.
        field: String,
    },
    /// An interval is empty.
    #[error("terrain: {field}: to_m = {to_m} must be greater than from_m = {from_m}")]
    EmptyInterval {
        /// Table.
        field: String,
        /// Start.
        from_m: f64,
        /// End.
        to_m: f64,
    },
    /// A hollow is narrower than the wheel.
    #[error(
        "terrain: profile[{index}]: its sharpest hollow has radius {hollow_m:.4} m, the wheel {radius_m} m: \
         the wheel would touch it in two places; make it longer or lower"
    )]
    NarrowHollow {
        /// Number of the feature.
        index: usize,
        /// Smallest radius of curvature of the hollow.
        hollow_m: f64,
        /// The wheel's radius.
        radius_m: f64,
    },
}

impl TerrainError {
    /// Table and key of the error.
    pub fn field(&self) -> String {
        match self {
            Self::OutOfRange { field, .. }
            | Self::BeyondWheel { field, .. }
            | Self::Missing { field }
            | Self::NotOfKind { field }
            | Self::EmptyInterval { field, .. } => field.clone(),
            Self::NarrowHollow { index, .. } => format!("profile[{index}]"),
        }
    }
}

/// Refuses a value outside its range, NaN included.
pub(super) fn check(field: impl Into<String>, value: f64, min: f64, max: f64) -> Result<(), TerrainError> {
    if value >= min && value <= max {
        Ok(())
    } else {
        Err(TerrainError::OutOfRange {
            field: field.into(),
            value,
            min,
            max,
        })
    }
}
