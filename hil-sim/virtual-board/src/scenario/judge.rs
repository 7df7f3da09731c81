//! Compares the metrics of a run with its scenario's bounds.

use serde::Serialize;

use super::bounds_of::BoundsOf;
use super::file::Scenario;
use super::metrics::{MetricKind, MetricValue, kind, measure};
use super::outcome::DriveOutcome;

/// A metric, its bounds and the result of their comparison.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Check {
    /// The metric.
    pub name: String,
    /// The metric's value.
    pub value: f64,
    /// Least allowed.
    pub least: f64,
    /// Most allowed.
    pub most: f64,
    /// Whether the value is within the bounds.
    pub ok: bool,
}

impl std::fmt::Display for Check {
    /// Formats why the metric is out of bounds.
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { name, value, .. } = self;
        let value = words(name, *value).unwrap_or_else(|| value.to_string());
        write!(f, "{name} = {value} is not within {}", self.bounds())
    }
}

impl Check {
    /// The bounds, by name where the metric's values have names.
    pub fn bounds(&self) -> String {
        let Self { name, least, most, .. } = self;
        let named = words(name, *least).filter(|_| least == most);
        named.unwrap_or_else(|| format!("{least} to {most}"))
    }
}

/// The value of the metric `name` as a person reads it: faults and modes by their names, what is counted without a fraction.
pub fn shown(name: &str, value: f64) -> String {
    words(name, value).unwrap_or_else(|| match kind(name) {
        Some(MetricKind::Count) => format!("{value:.0}"),
        _ => format!("{value:.4}"),
    })
}

/// The names that a metric's value stands for; nothing if its values have none.
fn words(name: &str, value: f64) -> Option<String> {
    let names = kind(name)?.names_of(value)?;
    Some(if names.is_empty() {
        "none".to_owned()
    } else {
        names.join(", ")
    })
}

/// How a run ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum RunVerdict {
    /// Every metric lies within its bounds.
    Passed,
    /// A metric lies outside its bounds.
    Failed,
    /// The simulated vehicle left the range in which the plant's equations are valid.
    Stopped,
    /// The scenario states no bounds, or its bounds apply to another vehicle and none of the bounds for every
    /// vehicle is violated.
    NotJudged,
}

impl RunVerdict {
    /// The verdict on a complete run of `scenario`. No vehicle passes by the bounds of another vehicle.
    pub fn of(scenario: &Scenario, checks: &[Check]) -> Self {
        if checks.iter().any(|check| !check.ok) {
            Self::Failed
        } else if checks.is_empty() || scenario.bounds_of == BoundsOf::AnotherVehicle {
            Self::NotJudged
        } else {
            Self::Passed
        }
    }

    /// The verdict in words.
    pub fn name(self) -> &'static str {
        match self {
            Self::Passed => "passed",
            Self::Failed => "failed",
            Self::Stopped => "stopped",
            Self::NotJudged => "not judged",
        }
    }
}

/// The reason of each metric that is out of bounds.
pub fn failures(checks: &[Check]) -> Vec<String> {
    checks.iter().filter(|check| !check.ok).map(Check::to_string).collect()
}

/// Compares the run with the scenario's bounds. A metric that is NaN fails.
pub fn evaluate(scenario: &Scenario, outcome: &DriveOutcome) -> Vec<Check> {
    judge(scenario, &measure(outcome))
}

/// Compares the values of a run's metrics with the scenario's bounds. A metric that is NaN fails.
pub fn judge(scenario: &Scenario, values: &[MetricValue]) -> Vec<Check> {
    scenario
        .metrics
        .iter()
        .map(|(name, [least, most])| {
            let value = values.iter().find(|m| m.name == name).map_or(f64::NAN, |m| m.value);
            Check {
                name: name.clone(),
                value,
                least: *least,
                most: *most,
                ok: *least <= value && value <= *most,
            }
        })
        .collect()
}
