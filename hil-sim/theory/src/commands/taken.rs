//! The numbers that a command took because neither a flag nor the vehicle file gives them.

use std::fmt;

use report::output::Report;
use serde::Serialize;

/// Where a number of the thesis's vehicle comes from.
pub const THESIS: &str = "the thesis's vehicle";

/// A number that nobody gave.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Taken {
    /// The flag that gives it.
    pub flag: &'static str,
    /// What was taken.
    pub value: f64,
    /// Where it comes from.
    pub from: String,
}

impl Taken {
    /// `value`, which the flag would have given, from elsewhere.
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

/// The report with a line for the numbers that nobody gave, if there are any.
#[must_use]
pub fn told<'a, R: Serialize>(report: Report<'a, R>, taken: &[Taken]) -> Report<'a, R> {
    if taken.is_empty() {
        return report;
    }
    let all: Vec<String> = taken.iter().map(Taken::to_string).collect();
    report.line("not given, taken", all.join(", "))
}
