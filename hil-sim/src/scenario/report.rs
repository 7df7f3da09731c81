//! The page of a run: what it was judged by, its plots, the firmware's log.

use std::fmt::Write as _;

use super::{Check, MetricValue, Scenario};
use crate::html::{document, escaped};

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
