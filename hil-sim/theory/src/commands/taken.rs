//! The default numbers that a command used because neither a flag nor the vehicle file gives them.

use std::fmt;

use report::output::Report;
use serde::Serialize;

/// Source of a number of the thesis's vehicle.
pub const THESIS: &str = "the thesis's vehicle";

/// A number that the user did not give.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Taken {
    /// The flag that gives it.
    pub flag: &'static str,
    /// The value used.
    pub value: f64,
    /// The value's source.
    pub from: String,
}

impl Taken {
    /// The `value` for the flag, from another source.
    pub fn new(flag: &'static str, value: f64, from: impl Into<String>) -> Self {
        let from = from.into();
        Self { flag, value, from }
    }
}

impl fmt::Display for Taken {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} {} ({})", self.flag, self.value, self.from)
    }
}

/// The report with a line for the numbers that the user did not give, if any.
#[must_use]
pub fn told<'a, R: Serialize>(report: Report<'a, R>, taken: &[Taken]) -> Report<'a, R> {
    if taken.is_empty() {
        return report;
    }
    let all: Vec<String> = taken.iter().map(Taken::to_string).collect();
    report.line("not given, taken", all.join(", "))
}
