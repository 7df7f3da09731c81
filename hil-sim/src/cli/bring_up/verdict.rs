//! Results of the steps, as text and as JSON.

use std::fmt::Write as _;

use report::colour::{bad, doubtful, good};
use serde::Serialize;

/// Result of one step.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum StepVerdict {
    /// The required result was seen.
    Passed,
    /// Another result was seen.
    Failed,
    /// No result: the step was skipped, not tried, or cannot be shown on this board.
    NotShown,
    /// The step is about a part that the vehicle does not have.
    NotNeeded,
}

impl StepVerdict {
    /// The verdict in words.
    pub fn name(self) -> &'static str {
        match self {
            Self::Passed => "passed",
            Self::Failed => "FAILED",
            Self::NotShown => "not shown",
            Self::NotNeeded => "not needed",
        }
    }

    /// The verdict in words, in its colour.
    pub fn coloured(self) -> String {
        match self {
            Self::Passed | Self::NotNeeded => good(self.name()),
            Self::Failed => bad(self.name()),
            Self::NotShown => doubtful(self.name()),
        }
    }
}

/// A verdict, and its basis.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Finding {
    /// The verdict.
    pub verdict: StepVerdict,
    /// What was seen.
    pub seen: String,
}

impl Finding {
    /// Passed.
    pub fn passed(seen: impl Into<String>) -> Self {
        Self::new(StepVerdict::Passed, seen)
    }

    /// Failed.
    pub fn failed(seen: impl Into<String>) -> Self {
        Self::new(StepVerdict::Failed, seen)
    }

    /// Not shown.
    pub fn not_shown(why: impl Into<String>) -> Self {
        Self::new(StepVerdict::NotShown, why)
    }

    /// Not needed.
    pub fn not_needed(why: impl Into<String>) -> Self {
        Self::new(StepVerdict::NotNeeded, why)
    }

    /// Passed if `good`, otherwise failed.
    pub fn of(good: bool, seen: impl Into<String>) -> Self {
        if good { Self::passed(seen) } else { Self::failed(seen) }
    }

    /// Whether the step leaves nothing open.
    pub fn is_settled(&self) -> bool {
        matches!(self.verdict, StepVerdict::Passed | StepVerdict::NotNeeded)
    }

    fn new(verdict: StepVerdict, seen: impl Into<String>) -> Self {
        Self {
            verdict,
            seen: seen.into(),
        }
    }
}

/// One step in the report.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct StepLine {
    /// Number of the step, from 1.
    pub number: usize,
    /// A few words.
    pub title: &'static str,
    /// The step's result.
    #[serde(flatten)]
    pub finding: Finding,
}

/// The whole procedure.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize)]
pub struct BringUpReport {
    /// The firmware; empty if no board has sent its identity.
    pub board: String,
    /// Whether the board is simulated.
    pub simulated: bool,
    /// The steps, in order.
    pub steps: Vec<StepLine>,
}

impl BringUpReport {
    /// Number of steps with this verdict.
    pub fn count(&self, verdict: StepVerdict) -> usize {
        let of = |line: &&StepLine| line.finding.verdict == verdict;
        self.steps.iter().filter(of).count()
    }

    /// The report as lines.
    pub fn text(&self) -> String {
        let kind = if self.simulated { "simulated board" } else { "board" };
        let mut text = format!("{kind}: {}\n", self.board);
        for StepLine { number, title, finding } in &self.steps {
            let _ = writeln!(
                text,
                "{number:>2} {title}: {}: {}",
                finding.verdict.name(),
                finding.seen
            );
        }
        let _ = writeln!(text, "{}", self.summary());
        text
    }

    /// The numbers of the verdicts.
    pub fn summary(&self) -> String {
        let count = |verdict| format!("{} {}", self.count(verdict), verdict.name().to_lowercase());
        let needed = [StepVerdict::Passed, StepVerdict::Failed, StepVerdict::NotShown]
            .map(count)
            .join(", ");
        if self.count(StepVerdict::NotNeeded) == 0 {
            return needed;
        }
        format!("{needed}, {}", count(StepVerdict::NotNeeded))
    }
}
