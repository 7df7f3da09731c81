//! One scenario with many seeds: the spread of its metrics.

use std::fmt::Write as _;
use std::ops::RangeInclusive;

use rayon::prelude::*;
use report::colour::bad;
use report::error::CommandError;
use report::output::{print_coloured, print_json, progress_bar};
use report::visible::visible_line;
use serde::Serialize;
use virtual_board::scenario::{self, JudgedRun, RunVerdict, VirtualBackend, run_judged};

use super::arguments::{Arguments, file_name, load_run};

/// Largest number of seeds of one call; a campaign takes more.
const SEEDS_MAX: u64 = 10_000;

/// A metric's values over all seeds.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Spread {
    /// The metric.
    pub name: &'static str,
    /// Smallest value.
    pub least: f64,
    /// Median value.
    pub median: f64,
    /// Largest value.
    pub most: f64,
    /// For a metric whose values have names: the names of each value that occurred, once.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub named: Vec<Vec<&'static str>>,
    /// The scenario's bounds of this metric, if any.
    pub bounds: Option<[f64; 2]>,
    /// Number of runs beyond the bounds.
    pub out_of_bounds: u64,
}

/// Summary of all runs.
#[derive(Debug, Serialize)]
pub struct Spreads {
    /// The scenario's title.
    pub scenario: String,
    /// First and last seed.
    pub seeds: [u64; 2],
    /// Number of runs.
    pub runs: u64,
    /// Number of runs that passed.
    pub passed: u64,
    /// Number of runs that left their bounds.
    pub failed: u64,
    /// Number of runs that the plant could not simulate to their end.
    pub stopped: u64,
    /// Seed and reasons of each run that failed or stopped.
    pub failures: Vec<(u64, Vec<String>)>,
    /// The metrics that are a number in any run.
    pub metrics: Vec<Spread>,
}

/// Runs `drive --seeds`.
///
/// # Errors
/// [`CommandError::Input`] on a bad scenario or vehicle file, [`CommandError::Checks`] when a run leaves its bounds or
/// cannot go on.
pub fn run(arguments: &Arguments, seeds: RangeInclusive<u64>) -> Result<(), CommandError> {
    let spreads = spreads(arguments, seeds)?;
    if arguments.json {
        print_json(&spreads)?;
    } else {
        print_coloured(&table(&spreads))?;
    }
    match spreads.failures.first() {
        None => Ok(()),
        Some((seed, reasons)) => Err(CommandError::Checks(format!(
            "{}: {} of {} runs failed or stopped, the first with seed {seed}: {}",
            file_name(arguments),
            spreads.failed + spreads.stopped,
            spreads.runs,
            reasons.join("; ")
        ))),
    }
}

/// Runs the scenario once with each seed, on all cores.
///
/// # Errors
/// [`CommandError::Input`] on a bad scenario or vehicle file.
pub fn spreads(arguments: &Arguments, seeds: RangeInclusive<u64>) -> Result<Spreads, CommandError> {
    let (scenario, vehicle, simulated) = load_run(arguments)?;
    let (first, last) = (*seeds.start(), *seeds.end());
    if last - first >= SEEDS_MAX {
        return Err(CommandError::Input(format!(
            "--seeds {first}:{last}: at most {SEEDS_MAX} seeds; `hil-sim campaign run` takes more"
        )));
    }
    let bar = progress_bar((last - first + 1) as usize, "runs");
    let runs: Result<Vec<(u64, JudgedRun)>, CommandError> = (first..=last)
        .into_par_iter()
        .map(|seed| {
            let mut scenario = scenario.clone();
            scenario.seed = seed;
            let plant = scenario
                .plant(&simulated)
                .map_err(|error| CommandError::Input(error.to_string()))?;
            let mut backend =
                VirtualBackend::boot(&vehicle, plant).map_err(|error| CommandError::Input(error.to_string()))?;
            let run = run_judged(&scenario, &mut backend);
            bar.inc(1);
            Ok((seed, run))
        })
        .collect();
    bar.finish_and_clear();
    let runs = runs?;
    let count = |verdict| runs.iter().filter(|(_, run)| run.verdict == verdict).count() as u64;
    Ok(Spreads {
        scenario: visible_line(&scenario.title).into_owned(),
        seeds: [first, last],
        runs: runs.len() as u64,
        passed: count(RunVerdict::Passed),
        failed: count(RunVerdict::Failed),
        stopped: count(RunVerdict::Stopped),
        failures: runs
            .iter()
            .filter(|(_, run)| !run.reasons.is_empty())
            .map(|(seed, run)| (*seed, run.reasons.clone()))
            .collect(),
        metrics: scenario::metrics::NAMES
            .iter()
            .filter_map(|name| {
                let values = runs.iter().flat_map(|(_, run)| &run.metrics);
                let values = values.filter(|metric| metric.name == *name).map(|metric| metric.value);
                spread(name, values.collect(), scenario.metrics.get(*name).copied())
            })
            .collect(),
    })
}

/// The spread of a metric's `values`; `None` if no value is a number.
fn spread(name: &'static str, mut values: Vec<f64>, bounds: Option<[f64; 2]>) -> Option<Spread> {
    let within = |value: f64, [least, most]: [f64; 2]| least <= value && value <= most;
    let out_of_bounds = bounds.map_or(0, |bounds| {
        values.iter().filter(|value| !within(**value, bounds)).count() as u64
    });
    values.retain(|value| value.is_finite());
    values.sort_by(f64::total_cmp);
    let (least, most) = (*values.first()?, *values.last()?);
    let middle = values.len() / 2;
    let median = if values.len().is_multiple_of(2) {
        0.5 * (values[middle - 1] + values[middle])
    } else {
        values[middle]
    };
    let kind = scenario::metrics::kind(name);
    let mut named: Vec<_> = values
        .iter()
        .filter_map(|value| kind.and_then(|kind| kind.names_of(*value)))
        .collect();
    named.dedup();
    Some(Spread {
        name,
        least,
        median,
        most,
        named,
        bounds,
        out_of_bounds,
    })
}

/// The table of spreads in the terminal.
pub fn table(spreads: &Spreads) -> String {
    let mut text = format!(
        "{} (seeds {} to {})\n\n{:<30} {:>11} {:>11} {:>11}   bounds\n",
        visible_line(&spreads.scenario),
        spreads.seeds[0],
        spreads.seeds[1],
        "metric",
        "least",
        "median",
        "most"
    );
    for Spread {
        name,
        least,
        median,
        most,
        named,
        bounds,
        out_of_bounds,
    } in &spreads.metrics
    {
        _ = write!(text, "{name:<30} {least:>11.4} {median:>11.4} {most:>11.4}");
        if let Some([from, to]) = bounds {
            _ = write!(text, "   {from} to {to}");
        }
        let named: Vec<String> = named
            .iter()
            .filter(|names| !names.is_empty())
            .map(|names| names.join(", "))
            .collect();
        if !named.is_empty() {
            _ = write!(text, "   {}", named.join(" or "));
        }
        if *out_of_bounds > 0 {
            _ = write!(text, "   {} in {out_of_bounds} of {}", bad("FAILED"), spreads.runs);
        }
        text.push('\n');
    }
    let not_judged = spreads.runs - spreads.passed - spreads.failed - spreads.stopped;
    _ = writeln!(
        text,
        "\n{} runs: {} passed, {} failed, {} stopped, {not_judged} not judged",
        spreads.runs, spreads.passed, spreads.failed, spreads.stopped
    );
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_spread_has_the_middle_and_counts_what_is_out_of_bounds() {
        let values = vec![3.0, f64::NAN, 1.0, 2.0, 10.0];
        let spread = spread("armed_s", values, Some([1.5, 5.0])).expect("numbers");
        assert_eq!((spread.least, spread.median, spread.most), (1.0, 2.5, 10.0));
        // The values 1 and 10, and the NaN.
        assert_eq!(spread.out_of_bounds, 3);
        assert_eq!(super::spread("armed_s", vec![f64::NAN], None), None);
    }
}
