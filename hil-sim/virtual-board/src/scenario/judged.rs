//! A run with its verdict, for callers that make many runs.

use super::backend::Backend;
use super::file::Scenario;
use super::judge::{RunVerdict, failures, judge};
use super::metrics::{MetricValue, Metrics};
use super::run::run_into;

/// The verdict and the metrics of a run.
#[derive(Debug, Clone, PartialEq)]
pub struct JudgedRun {
    /// How the run ended.
    pub verdict: RunVerdict,
    /// The metrics out of bounds, or why the run stopped.
    pub reasons: Vec<String>,
    /// Every metric; empty for a run that stopped.
    pub metrics: Vec<MetricValue>,
}

/// Runs `scenario` and judges the run, with memory use that does not grow with the run.
pub fn run_judged(scenario: &Scenario, backend: &mut dyn Backend) -> JudgedRun {
    let mut metrics = Metrics::default();
    match run_into(scenario, backend, |row| metrics.add(row), |_| {}) {
        Err(error) => JudgedRun {
            verdict: RunVerdict::Stopped,
            reasons: vec![error.to_string()],
            metrics: Vec::new(),
        },
        Ok(end) => {
            let metrics = metrics.values(&end.counts);
            let checks = judge(scenario, &metrics);
            JudgedRun {
                verdict: RunVerdict::of(scenario, &checks),
                reasons: failures(&checks),
                metrics,
            }
        }
    }
}
