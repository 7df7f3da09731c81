//! The page of a run: what it was judged by, its plots, the firmware's log.

use std::fmt::Write as _;

use report::html::{document, escaped};
use report::plot::{Chart, Columns, Series};
use virtual_board::scenario::trace::{COLUMNS, Row, Trace, Value};
use virtual_board::scenario::{Check, MetricValue, Scenario};

/// The page. `charts` are SVG documents; `log` is the firmware's.
pub fn page(
    scenario: &Scenario,
    values: &[MetricValue],
    checks: &[Check],
    charts: &[String],
    log: &[String],
) -> String {
    let ok = checks.iter().all(|check| check.ok);
    let (class, word) = if ok {
        ("confirmed", "passed")
    } else {
        ("refuted", "failed")
    };
    let mut body = format!(
        "<header>\n<h1>{}</h1>\n<p><span class=\"verdict {class}\">{word}</span> seed {}, {} s simulated</p>\n</header>\n<main>\n",
        escaped(&scenario.title),
        scenario.seed,
        scenario.duration_s
    );
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

/// The whole trace as a table.
pub fn columns(trace: &Trace) -> Columns {
    COLUMNS.iter().fold(Columns::new(), |columns, (name, value)| {
        columns.with(*name, trace.values(value))
    })
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
];

/// The charts of the report: file name and chart.
pub fn charts(trace: &Trace) -> Vec<(&'static str, Chart)> {
    let t = trace.values(Row::time_s);
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
            "camera",
            over_time(
                "Camera spar",
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
