//! The page of a run: its bounds and metrics, its plots, the firmware's log.

use std::fmt::Write as _;

use model::supervise::codes::Limit;
use model::vehicle::Vehicle;
use report::html::escaped;
use report::interactive::{InteractivePage, Scene, StripEvent, TIME_LABEL};
use report::plot::{Chart, Series};
use virtual_board::scenario::trace::{Trace, TraceRow, Value};
use virtual_board::scenario::{BoundsOf, Check, GAP_S, MetricValue, RunStory, RunVerdict, Scenario, StoryEvent, shown};

use super::rows::ChartRows;
use super::terms::{SPAR_TERMS, SPEED_TERMS, STEERING_TERMS};

/// The files and the command of a run, in a form for people.
#[derive(Debug, Clone)]
pub struct RunOrigin {
    /// The scenario's file or name.
    pub scenario: String,
    /// The vehicle's file or name.
    pub vehicle: String,
    /// The command line.
    pub command: String,
}

/// Summary of a run.
#[derive(Debug, Clone, Copy)]
pub struct RunSummary<'a> {
    /// The scenario.
    pub scenario: &'a Scenario,
    /// The simulated vehicle.
    pub vehicle: &'a Vehicle<f64>,
    /// The run's origin.
    pub origin: &'a RunOrigin,
    /// Every metric.
    pub values: &'a [MetricValue],
    /// The metrics that have bounds.
    pub checks: &'a [Check],
    /// What happened.
    pub told: &'a RunStory,
    /// The firmware's log.
    pub log: &'a [String],
    /// Where the page finds the record of every tick, if there is one: an address from the page's folder.
    pub record: Option<&'a str>,
}

impl RunSummary<'_> {
    /// Whether the vehicle has what the metric `name` measures.
    pub fn has(&self, name: &str) -> bool {
        name != "spar_peak_deg" || self.vehicle.parameters().spar.is_some()
    }

    /// Whether the vehicle has what the chart `name` draws.
    fn draws(&self, name: &str) -> bool {
        !name.starts_with("spar") || self.vehicle.parameters().spar.is_some()
    }
}

/// The page of a run, drawn from the stored rows.
///
/// # Errors
/// The encoder's message.
pub fn page(summary: &RunSummary<'_>, rows: &ChartRows) -> Result<String, String> {
    let RunSummary { scenario, told, .. } = *summary;
    let trace = &rows.trace;
    let page = InteractivePage {
        title: &scenario.title,
        head: head(summary, rows.stride),
        time: trace.values(TraceRow::time_s),
        events: told.events.iter().map(strip_event).chain(limits(rows)).collect(),
        scene: Some(scene(summary.vehicle, trace)),
        // The path is part of the two views.
        charts: drawn(summary, trace)
            .filter(|(name, _)| *name != "path")
            .map(|(_, chart)| chart)
            .collect(),
        tail: tail(summary),
    };
    page.to_html()
}

/// Verdict, origin and files.
fn head(summary: &RunSummary<'_>, stride: usize) -> String {
    let verdict = RunVerdict::of(summary.scenario, summary.checks);
    let class = match verdict {
        RunVerdict::Passed => "confirmed",
        RunVerdict::NotJudged => "added",
        RunVerdict::Failed | RunVerdict::Stopped => "refuted",
    };
    let mut head = format!(
        "<p><span class=\"verdict {class}\">{}</span> seed {}, {} s simulated</p>\n\
         <p class=\"quiet\">Scenario {}, vehicle {}, hil-sim {}<br><code>{}</code></p>\n<p class=\"files\">",
        verdict.name(),
        summary.scenario.seed,
        summary.scenario.duration_s,
        escaped(&summary.origin.scenario),
        escaped(&summary.origin.vehicle),
        env!("CARGO_PKG_VERSION"),
        escaped(&summary.origin.command),
    );
    for file in ["trace.csv", "firmware.log"] {
        _ = write!(head, "<a href=\"{file}\">{file}</a>");
    }
    if let Some(record) = summary.record {
        let name = record.rsplit('/').next().unwrap_or_default();
        _ = write!(head, "<a href=\"{}\">{}</a>", escaped(record), escaped(name));
    }
    for (name, _) in drawn(summary, &Trace::default()) {
        _ = write!(head, "<a href=\"{name}.svg\">{name}.svg</a>");
    }
    head.push_str("</p>\n");
    if stride > 1 {
        _ = writeln!(
            head,
            "<p>A long run: the charts show every {stride}th row, trace.csv holds all.</p>"
        );
    }
    head
}

/// Events, judged metrics, other metrics, and the log.
fn tail(summary: &RunSummary<'_>) -> String {
    let RunSummary {
        scenario,
        values,
        checks,
        told,
        log,
        ..
    } = *summary;
    let mut tail = format!("<h2>What happened</h2>\n{}", events(told));
    tail.push_str("<div class=\"grid\">\n<section class=\"card\"><h3>Judged by</h3>\n");
    if scenario.bounds_of == BoundsOf::AnotherVehicle {
        tail.push_str(
            "<p>The scenario's bounds are another vehicle's: only those that hold of any vehicle are asked of this one.</p>\n",
        );
    } else if checks.is_empty() {
        tail.push_str("<p>Nothing: the scenario states no bounds.</p>\n");
    }
    if !checks.is_empty() {
        tail.push_str("<table><tr><th>metric</th><th>value</th><th>bounds</th></tr>\n");
        for check in checks {
            let mark = if check.ok { "" } else { " FAILED" };
            _ = writeln!(
                tail,
                "<tr><td>{}</td><td>{}</td><td>{}{mark}</td></tr>",
                escaped(&check.name),
                shown(&check.name, check.value),
                check.bounds()
            );
        }
        tail.push_str("</table>\n");
    }
    tail.push_str(
        "</section>\n<section class=\"card\"><h3>Also measured</h3>\n<table><tr><th>metric</th><th>value</th></tr>\n",
    );
    let judged = |name: &str| checks.iter().any(|check| check.name == name);
    for metric in values
        .iter()
        .filter(|metric| metric.value.is_finite() && !judged(metric.name) && summary.has(metric.name))
    {
        _ = writeln!(
            tail,
            "<tr><td>{}</td><td>{}</td></tr>",
            escaped(metric.name),
            shown(metric.name, metric.value)
        );
    }
    tail.push_str("</table></section>\n</div>\n<h2>The firmware's log</h2>\n<section class=\"card\"><pre>");
    for line in log {
        _ = writeln!(tail, "{}", escaped(line));
    }
    tail.push_str("</pre></section>\n");
    tail
}

fn strip_event(event: &StoryEvent) -> StripEvent {
    StripEvent {
        at_s: event.at_s,
        for_s: event.for_s,
        kind: event.kind.name(),
        text: event.text.clone(),
        trouble: event.kind.is_trouble(),
    }
}

/// When each limit was in force, except the limits that the story reports as events.
fn limits(rows: &ChartRows) -> impl Iterator<Item = StripEvent> {
    let trace = &rows.trace;
    // For a long run only every stride-th row is stored.
    let apart_s = match trace.rows.as_slice() {
        [first, second, ..] => second.time_s() - first.time_s(),
        _ => 0.0,
    };
    let gap_s = GAP_S.max(1.5 * apart_s);
    let untold = Limit::ALL
        .iter()
        .filter(|limit| !matches!(limit, Limit::Stall | Limit::Freed | Limit::SlopeLimit));
    untold.flat_map(move |limit| {
        let mut spells: Vec<StripEvent> = Vec::new();
        let rows = trace.rows.iter().filter(|row| row.status.limits.contains(*limit));
        for at_s in rows.map(TraceRow::time_s) {
            match spells.last_mut() {
                Some(spell) if at_s - spell.at_s - spell.for_s.unwrap_or(0.0) < gap_s => {
                    spell.for_s = Some(at_s - spell.at_s);
                }
                _ => spells.push(StripEvent {
                    at_s,
                    for_s: None,
                    kind: limit.name(),
                    text: format!("limit {}", limit.name()),
                    trouble: false,
                }),
            }
        }
        spells
    })
}

/// The vehicle's dimensions and its motion.
fn scene(vehicle: &Vehicle<f64>, trace: &Trace) -> Scene {
    let p = vehicle.parameters();
    let spar = p.spar.as_ref().map(|(spar, _)| spar);
    Scene {
        wheel_radius_m: p.body.wheel_radius_m,
        arm_length_m: p.body.arm_length_m,
        camera_m: spar.map_or(0.0, |spar| spar.spar_length_m),
        motor_m: spar.map_or(0.0, |spar| spar.motor_distance_m),
        ballast_m: spar.map_or(0.0, |spar| spar.ballast_distance_m),
        x: trace.values(|r| r.truth.x_m),
        y: trace.values(|r| r.truth.y_m),
        estimated_x: trace.values(|r| f64::from(r.status.estimate.x_m)),
        estimated_y: trace.values(|r| f64::from(r.status.estimate.y_m)),
        heading: trace.values(|r| r.truth.heading_rad),
        slope: trace.values(|r| r.truth.slope_rad),
        phi: trace.values(|r| r.truth.phi_rad),
        spar: trace.values(|r| r.truth.spar_rad),
        ballast: trace.values(|r| r.truth.ballast_rad),
    }
}

/// The table of events.
fn events(told: &RunStory) -> String {
    if told.events.is_empty() {
        return "<p>Nothing.</p>\n".to_owned();
    }
    let mut text =
        "<section class=\"card\"><table class=\"events\"><tr><th>at, s</th><th>for, s</th><th>what</th><th></th></tr>\n".to_owned();
    for event in &told.events {
        let length = event.for_s.map_or_else(String::new, |for_s| format!("{for_s:.2}"));
        _ = writeln!(
            text,
            "<tr><td><button type=\"button\" data-at=\"{0}\">{0:.2}</button></td><td>{length}</td><td>{1}</td><td>{2}</td></tr>",
            event.at_s,
            event.kind.name(),
            escaped(&event.text)
        );
    }
    text.push_str("</table></section>\n");
    if told.dropped > 0 {
        _ = writeln!(text, "<p>And {} more.</p>", told.dropped);
    }
    text
}

/// The charts of the report that say something of this vehicle: file name and chart.
pub fn drawn(summary: &RunSummary<'_>, trace: &Trace) -> impl Iterator<Item = (&'static str, Chart)> {
    charts(trace).into_iter().filter(|(name, _)| summary.draws(name))
}

fn charts(trace: &Trace) -> Vec<(&'static str, Chart)> {
    let t = trace.values(TraceRow::time_s);
    let over_time = |title: &str, unit: &str, curves: &[(&str, Value)]| {
        curves
            .iter()
            .fold(Chart::new(title, TIME_LABEL, unit), |chart, (name, value)| {
                chart.with(Series::new(*name, &t, &trace.values(value)))
            })
    };
    vec![
        (
            "speed",
            over_time(
                "Speed",
                "m/s",
                &[
                    ("commanded", |r| r.commanded[0]),
                    ("reference", |r| f64::from(r.status.speed_reference_m_s)),
                    ("true", |r| r.truth.speed_m_s),
                ],
            ),
        ),
        (
            "phi",
            over_time(
                "Arm angle phi from the vertical",
                "deg",
                &[
                    ("true", |r| r.truth.phi_rad.to_degrees()),
                    ("estimated", |r| f64::from(r.status.estimate.phi_rad).to_degrees()),
                    ("slope, true", |r| r.truth.slope_rad.to_degrees()),
                    ("slope, estimated", |r| {
                        f64::from(r.status.estimate.slope_rad).to_degrees()
                    }),
                ],
            ),
        ),
        (
            "spar",
            over_time(
                "Spar and ballast",
                "deg",
                &[
                    ("spar, true", |r| r.truth.spar_rad.to_degrees()),
                    ("spar, estimated", |r| {
                        f64::from(r.status.estimate.spar_rad).to_degrees()
                    }),
                    ("ballast from the vertical", |r| {
                        (r.truth.spar_rad + r.truth.ballast_rad).to_degrees()
                    }),
                ],
            ),
        ),
        (
            "yaw-rate",
            over_time(
                "Yaw rate",
                "rad/s",
                &[
                    ("commanded", |r| r.commanded[1]),
                    ("true", |r| r.truth.yaw_rate_rad_s),
                    ("estimated", |r| f64::from(r.status.estimate.yaw_rate_rad_s)),
                ],
            ),
        ),
        (
            "current",
            over_time(
                "Motor currents",
                "A",
                &[
                    ("left", |r| r.truth.current_a[0]),
                    ("right", |r| r.truth.current_a[1]),
                    ("ballast", |r| r.truth.current_a[2]),
                ],
            ),
        ),
        ("speed-terms", over_time("Terms of the speed law", "V", SPEED_TERMS)),
        (
            "steering-terms",
            over_time("Terms of the steering law", "V", STEERING_TERMS),
        ),
        ("spar-terms", over_time("Terms of the spar law", "V", SPAR_TERMS)),
        (
            "path",
            Chart::new("Path on the plane", "x, m", "y, m")
                .equal_axes()
                .with(Series::new(
                    "true",
                    &trace.values(|r| r.truth.x_m),
                    &trace.values(|r| r.truth.y_m),
                ))
                .with(Series::new(
                    "dead reckoning",
                    &trace.values(|r| f64::from(r.status.estimate.x_m)),
                    &trace.values(|r| f64::from(r.status.estimate.y_m)),
                )),
        ),
    ]
}

#[cfg(test)]
mod tests {
    use super::super::rows::tests::row;
    use super::*;

    /// A limit in force in every row except a short gap is one spell, also if only every 32nd row is
    /// stored. A long gap splits the spell.
    #[test]
    fn a_limit_is_one_spell_at_any_stride() {
        for apart_ms in [10, 320] {
            let mut rows = ChartRows::default();
            for n in 0..60_u64 {
                let mut row = row();
                row.status.time_us = n * apart_ms * 1000;
                row.status.limits.set(Limit::Reference, !(20..50).contains(&n));
                rows.add(&row);
            }
            let spells: Vec<StripEvent> = limits(&rows).collect();
            assert_eq!(spells.len(), 2, "{apart_ms} ms: {spells:?}");
            let length_s = 0.001 * 19.0 * apart_ms as f64;
            assert!((spells[0].for_s.unwrap_or(0.0) - length_s).abs() < 1e-9, "{spells:?}");
        }
    }
}
