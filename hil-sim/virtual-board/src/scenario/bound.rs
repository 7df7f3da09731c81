//! A scenario's bounds of a metric: two numbers, or the names of its only allowed value.

use core::fmt;

use serde::Deserialize;

use super::metrics::MetricKind;

/// Bounds as written in a file.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(untagged)]
pub(super) enum Bound {
    /// `["BridgeBreak", "EmergencyStop"]`: exactly these faults; `["armed"]`: this mode; `[]`: no fault.
    Names(Vec<String>),
    /// `[least, most]`, once checked.
    Numbers(Vec<f64>),
    /// Any other value.
    Other(toml::Value),
}

impl Bound {
    /// The least and the most of a metric of this kind.
    ///
    /// # Errors
    /// The allowed values.
    pub(super) fn of(&self, kind: MetricKind) -> Result<[f64; 2], String> {
        let [least, most] = match self {
            Self::Names(names) => return named(names, kind).map(|value| [value; 2]),
            Self::Numbers(numbers) => numbers[..].try_into().map_err(|_| allowed(kind))?,
            Self::Other(_) => return Err(allowed(kind)),
        };
        if least.is_nan() || most.is_nan() || least > most {
            return Err("the least must not exceed the most".to_owned());
        }
        match kind {
            MetricKind::Faults if least != most => Err(format!(
                "a bound on faults is exact, for between two sets lie others: {}",
                allowed(kind)
            )),
            MetricKind::Faults | MetricKind::Mode
                if [least, most].iter().any(|value| kind.names_of(*value).is_none()) =>
            {
                Err(format!("no such value: {}", allowed(kind)))
            }
            _ => Ok([least, most]),
        }
    }
}

/// The value with these names.
fn named(names: &[String], kind: MetricKind) -> Result<f64, String> {
    kind.value_of(names).map_err(|wrong| {
        let known = kind.names();
        if known.is_empty() || known.contains(&wrong) || names.is_empty() {
            allowed(kind)
        } else {
            format!("`{wrong}` is none: allowed is {}", known.join(", "))
        }
    })
}

impl fmt::Display for Bound {
    /// Formats the bounds as in a file.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Names(names) => write!(f, "{names:?}"),
            Self::Numbers(numbers) => {
                f.write_str("[")?;
                for (place, number) in numbers.iter().enumerate() {
                    f.write_str(if place == 0 { "" } else { ", " })?;
                    number.fmt(f)?;
                }
                f.write_str("]")
            }
            Self::Other(value) => value.fmt(f),
        }
    }
}

/// The text that a file may contain for a metric of this kind.
fn allowed(kind: MetricKind) -> String {
    match kind {
        MetricKind::Measured | MetricKind::Count => "allowed is [least, most], two numbers".to_owned(),
        MetricKind::Mode => format!(
            "allowed is one of {} in brackets, or [least, most]",
            kind.names().join(", ")
        ),
        MetricKind::Faults => {
            "allowed is the names of exactly these faults (docs/safety.md), [] for none, or their bits \
                               as least and most"
                .to_owned()
        }
    }
}
