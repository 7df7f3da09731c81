//! The page of a run: what it was judged by, its plots, the firmware's log.

use std::fmt::Write as _;
use std::io;

use report::html::{document, escaped};
use report::plot::{Chart, Series};
use virtual_board::scenario::trace::{COLUMNS, Trace, TraceRow, Value};
use virtual_board::scenario::{Check, MetricValue, RunStory, RunVerdict, Scenario};

/// What a run came to.
#[derive(Debug, Clone, Copy)]
pub struct RunSummary<'a> {
    /// What ran.
    pub scenario: &'a Scenario,
    /// Every metric.
    pub values: &'a [MetricValue],
    /// The metrics that have bounds.
    pub checks: &'a [Check],
    /// What happened.
    pub told: &'a RunStory,
    /// The firmware's log.
    pub log: &'a [String],
}

/// The page. `charts` are SVG documents of every `chart_stride`th row.
pub fn page(summary: &RunSummary<'_>, charts: &[String], chart_stride: usize) -> String {
    let RunSummary {
        scenario,
        values,
        checks,
        told,
        log,
    } = *summary;
    let verdict = RunVerdict::of(checks);
    let class = match verdict {
        RunVerdict::Passed => "confirmed",
        RunVerdict::NotJudged => "added",
        RunVerdict::Failed | RunVerdict::Stopped => "refuted",
    };
    let word = verdict.name();
    let mut body = format!(
        "<header>\n<h1>{}</h1>\n<p><span class=\"verdict {class}\">{word}</span> seed {}, {} s simulated</p>\n</header>\n<main>\n",
        escaped(&scenario.title),
        scenario.seed,
        scenario.duration_s
    );
    if chart_stride > 1 {
        _ = writeln!(
            body,
            "<p>A long run: the charts show every {chart_stride}th row, trace.csv holds all.</p>"
        );
    }
    body.push_str("<h2>What happened</h2>\n");
    body.push_str(&events(told));
    for pair in charts.chunks(2) {
        body.push_str("<article>\n");
        for chart in pair {
            _ = writeln!(body, "<div>{chart}</div>");
        }
        body.push_str("</article>\n");
    }
    body.push_str("<article>\n<div><h3>Judged by</h3>\n<table><tr><th>metric</th><th>value</th><th>bounds</th></tr>\n");
    for check in checks {
        let mark = if check.ok { "" } else { " FAILED" };
        _ = writeln!(
            body,
            "<tr><td>{}</td><td>{:.4}</td><td>{} to {}{mark}</td></tr>",
            escaped(&check.name),
            check.value,
            check.least,
            check.most
        );
    }
    body.push_str("</table></div>\n<div><h3>Also measured</h3>\n<table><tr><th>metric</th><th>value</th></tr>\n");
    let judged = |name: &str| checks.iter().any(|check| check.name == name);
    for metric in values
        .iter()
        .filter(|metric| metric.value.is_finite() && !judged(metric.name))
    {
        _ = writeln!(
            body,
            "<tr><td>{}</td><td>{:.4}</td></tr>",
            escaped(metric.name),
            metric.value
        );
    }
    body.push_str("</table></div>\n</article>\n<h2>The firmware's log</h2>\n<pre>");
    for line in log {
        _ = writeln!(body, "{}", escaped(line));
    }
    body.push_str("</pre>\n</main>\n");
    document(&scenario.title, &body)
}

/// The table of what happened.
fn events(told: &RunStory) -> String {
    if told.events.is_empty() {
        return "<p>Nothing.</p>\n".to_owned();
    }
    let mut text =
        "<article><table class=\"events\"><tr><th>at, s</th><th>for, s</th><th>what</th><th></th></tr>\n".to_owned();
    for event in &told.events {
        let length = event.for_s.map_or_else(String::new, |for_s| format!("{for_s:.2}"));
        _ = writeln!(
            text,
            "<tr><td>{:.2}</td><td>{length}</td><td>{}</td><td>{}</td></tr>",
            event.at_s,
            event.kind.name(),
            escaped(&event.text)
        );
    }
    text.push_str("</table></article>\n");
    if told.dropped > 0 {
        _ = writeln!(text, "<p>And {} more.</p>", told.dropped);
    }
    text
}

/// Writes the first line of a trace as CSV: the columns' names.
///
/// # Errors
/// Those of `out`.
pub fn write_header(out: &mut impl io::Write) -> io::Result<()> {
    let names: Vec<&str> = COLUMNS.iter().map(|(name, _)| *name).collect();
    writeln!(out, "{}", names.join(","))
}

/// Writes one row of a trace as CSV, every number with all its digits.
///
/// # Errors
/// Those of `out`.
pub fn write_row(out: &mut impl io::Write, row: &TraceRow) -> io::Result<()> {
    for (i, (_, value)) in COLUMNS.iter().enumerate() {
        let separator = if i == 0 { "" } else { "," };
        write!(out, "{separator}{}", value(row))?;
    }
    writeln!(out)
}

/// Most rows that the charts are drawn from.
const CHART_ROWS_MAX: usize = 16_384;

/// The rows that the charts are drawn from: all of them up to `CHART_ROWS_MAX`, which is 160 s; of a longer run every
/// second, fourth, ... row, so that memory does not grow with the run.
#[derive(Debug)]
pub struct ChartRows {
    /// The rows kept.
    pub trace: Trace,
    /// One of this many is kept.
    pub stride: usize,
    seen: usize,
}

impl Default for ChartRows {
    fn default() -> Self {
        Self {
            trace: Trace::default(),
            stride: 1,
            seen: 0,
        }
    }
}

impl ChartRows {
    /// Takes the next row of the run.
    pub fn add(&mut self, row: &TraceRow) {
        if self.seen.is_multiple_of(self.stride) {
            if self.trace.rows.len() == CHART_ROWS_MAX {
                let mut index = 0;
                self.trace.rows.retain(|_| {
                    index += 1;
                    index % 2 == 1
                });
                self.stride *= 2;
            }
            if self.seen.is_multiple_of(self.stride) {
                self.trace.rows.push(*row);
            }
        }
        self.seen += 1;
    }
}

/// The terms of the speed law, by the names of the chart.
const SPEED_TERMS: &[(&str, Value)] = &[
    ("feed-forward", |r| f64::from(r.status.terms.speed.feed_forward_v)),
    ("weight", |r| f64::from(r.status.terms.speed.weight_v)),
    ("speed feedback", |r| f64::from(r.status.terms.speed.speed_feedback_v)),
    ("swing rate", |r| f64::from(r.status.terms.speed.swing_rate_v)),
    ("swing damping", |r| f64::from(r.status.terms.speed.swing_damping_v)),
    ("friction", |r| f64::from(r.status.terms.speed.friction_v)),
    ("guard", |r| f64::from(r.status.terms.speed.guard_v)),
    ("trim", |r| f64::from(r.status.terms.speed.trim_v)),
    ("governed", |r| f64::from(r.status.terms.speed.governed_v)),
];

/// The charts of the report: file name and chart.
pub fn charts(trace: &Trace) -> Vec<(&'static str, Chart)> {
    let t = trace.values(TraceRow::time_s);
    let over_time = |title: &str, unit: &str, curves: &[(&str, Value)]| {
        curves
            .iter()
            .fold(Chart::new(title, "time, s", unit), |chart, (name, value)| {
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
            "path",
            Chart::new("Path on the plane", "x, m", "y, m")
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
    use report::plot::Columns;
    use virtual_board::scenario::{VirtualBackend, run};

    use super::*;

    /// A row of a real run.
    fn row() -> TraceRow {
        let scenario = Scenario::parse("row", "title = \"row\"\nduration_s = 0.5").expect("good");
        let vehicle = vehicle_file::reference().expect("good");
        let plant = scenario.plant(&vehicle).expect("drivable");
        let mut backend = VirtualBackend::boot(&vehicle, plant).expect("boots");
        let outcome = run(&scenario, &mut backend, |_| {}).expect("valid");
        *outcome.trace.rows.last().expect("rows")
    }

    #[test]
    fn the_rows_of_a_long_run_are_thinned_evenly_and_bounded() {
        let mut rows = ChartRows::default();
        let count = 3 * CHART_ROWS_MAX;
        let mut row = row();
        for index in 0..count {
            row.status.tick = index as u32;
            rows.add(&row);
            assert!(rows.trace.rows.len() <= CHART_ROWS_MAX);
        }
        assert_eq!(rows.stride, 4);
        let ticks: Vec<u32> = rows.trace.rows.iter().map(|row| row.status.tick).collect();
        let expected: Vec<u32> = (0..count as u32).step_by(4).collect();
        assert_eq!(ticks, expected);
    }

    #[test]
    fn rows_written_one_by_one_are_the_whole_table() {
        let trace = Trace { rows: vec![row(); 3] };
        let mut text = Vec::new();
        write_header(&mut text).expect("memory");
        for row in &trace.rows {
            write_row(&mut text, row).expect("memory");
        }
        let whole = COLUMNS.iter().fold(Columns::new(), |columns, (name, value)| {
            columns.with(*name, trace.values(value))
        });
        assert_eq!(String::from_utf8(text).expect("text"), whole.to_csv());
    }
}
