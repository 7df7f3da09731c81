//! Summary of a run for the terminal.

use std::fmt::Write as _;

use report::colour::{bad, doubtful, good};
use report::visible::visible_line;
use virtual_board::scenario::{BoundsOf, Check, EventKind, RunVerdict, shown};

use super::page::RunSummary;

/// Largest number of events in the terminal; the page shows all events.
const EVENTS_SHOWN: usize = 24;

/// Quantities of the short table: label and metric.
const TABLE: &[(&str, &str)] = &[
    ("speed error, rms        m/s", "speed_error_rms_m_s"),
    ("phi, peak               deg", "phi_peak_deg"),
    ("phi estimate error, rms deg", "phi_estimate_error_rms_deg"),
    ("camera spar, peak       deg", "spar_peak_deg"),
    ("motor current, peak     A", "current_peak_a"),
    ("hold drift in 2 s       m", "hold_drift_m"),
    ("distance                m", "distance_m"),
    ("dead-reckoning drift    m", "dead_reckoning_drift_m"),
];

/// The table of a run: its metrics with their bounds, the verdict, and the events.
pub fn table(summary: &RunSummary<'_>) -> String {
    let RunSummary {
        scenario,
        values,
        checks,
        told,
        ..
    } = *summary;
    let mut text = format!("{} (seed {})\n\n", visible_line(&scenario.title), scenario.seed);
    let mut line = |label: &str, name: &str, value: f64| {
        let _ = writeln!(text, "{label:<30} {:>10}{}", shown(name, value), bounds(checks, name));
    };
    for (label, name) in TABLE.iter().filter(|(_, name)| summary.has(name)) {
        let value = values.iter().find(|m| m.name == *name).map_or(f64::NAN, |m| m.value);
        line(label, name, value);
    }
    for check in checks
        .iter()
        .filter(|check| TABLE.iter().all(|(_, name)| *name != check.name))
    {
        line(&check.name, &check.name, check.value);
    }
    let verdict = RunVerdict::of(scenario, checks);
    let why = match verdict {
        RunVerdict::NotJudged if scenario.bounds_of == BoundsOf::AnotherVehicle => {
            ": the scenario's bounds are another vehicle's, and of those that hold of any vehicle none is broken"
        }
        RunVerdict::NotJudged => ": the scenario states no bounds",
        _ => "",
    };
    _ = writeln!(text, "\n{}{why}", coloured(verdict));
    if told.events.is_empty() {
        return text;
    }
    text.push_str("\nwhat happened\n");
    let most = told.events.len().min(EVENTS_SHOWN);
    for event in &told.events[..most] {
        _ = match event.kind {
            EventKind::Fault | EventKind::Whirl => writeln!(text, "{}", bad(event)),
            EventKind::Mode | EventKind::Freed => writeln!(text, "{event}"),
            _ => writeln!(text, "{}", doubtful(event)),
        };
    }
    let more = (told.events.len() - most) as u64 + told.dropped;
    if more > 0 {
        _ = writeln!(text, "{more:>9} more on the page");
    }
    text
}

/// The verdict in words, in its colour.
fn coloured(verdict: RunVerdict) -> String {
    match verdict {
        RunVerdict::Passed => good(verdict.name()),
        RunVerdict::Failed | RunVerdict::Stopped => bad(verdict.name()),
        RunVerdict::NotJudged => doubtful(verdict.name()),
    }
}

fn bounds(checks: &[Check], name: &str) -> String {
    checks
        .iter()
        .find(|check| check.name == name)
        .map_or_else(String::new, |check| {
            let verdict = if check.ok { good("ok") } else { bad("FAILED") };
            format!("   {verdict}, bounds {}", check.bounds())
        })
}
