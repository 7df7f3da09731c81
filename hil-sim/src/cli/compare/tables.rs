//! The comparison as tables, in the terminal and on a page.

use std::fmt::Write as _;

use report::html::{document, escaped};
use report::plot::{Chart, Series};

use super::contenders::Contender;
use super::flight::Flight;
use super::planar::{PlanarStep, PlanarSteps};

/// Columns of the steps on the planar vehicle.
const PLANAR: [&str; 6] = [
    "law",
    "settles, time units",
    "overshoot, %",
    "undershoot, %",
    "arm, deg",
    "grip needed",
];
/// Columns of the flights.
const FLIGHT: [&str; 10] = [
    "law",
    "settles, s",
    "overshoot, %",
    "drives, m",
    "too fast, m/s",
    "rolls back, m",
    "arm, deg",
    "spar, deg",
    "slides, s",
    "energy, J",
];

/// A table: its heading, its columns and its rows.
struct ComparisonTable {
    heading: String,
    columns: &'static [&'static str],
    rows: Vec<Vec<String>>,
}

fn tables(planar: &PlanarSteps, flights: &[Flight]) -> Vec<ComparisonTable> {
    let mut tables = vec![ComparisonTable {
        heading: format!(
            "Planar vehicle, step from rest to {:.2} m/s on {:.1} deg, one tick of delay",
            planar.target_m_s,
            planar.slope_rad.to_degrees()
        ),
        columns: &PLANAR,
        rows: planar.steps.iter().map(planar_row).collect(),
    }];
    for course in by_course(flights) {
        tables.push(ComparisonTable {
            heading: course[0].course.clone(),
            columns: &FLIGHT,
            rows: course.iter().map(flight_row).collect(),
        });
    }
    tables
}

/// The flights of each course.
fn by_course(flights: &[Flight]) -> impl Iterator<Item = &[Flight]> {
    flights.chunk_by(|one, next| one.course == next.course)
}

fn planar_row(step: &PlanarStep) -> Vec<String> {
    let ends = if step.whirled {
        "whirls".to_owned()
    } else {
        step.settling
            .time
            .map_or("never".to_owned(), |time| format!("{time:.2}"))
    };
    vec![
        step.law.to_owned(),
        ends,
        format!("{:.1}", 100.0 * step.settling.overshoot),
        format!("{:.1}", 100.0 * step.settling.undershoot),
        format!("{:.1}", step.arm_peak_deg),
        format!("{:.2}", step.grip_needed),
    ]
}

fn flight_row(flight: &Flight) -> Vec<String> {
    let settling = flight.settling.as_ref();
    let ends = match (&flight.stopped, settling) {
        (Some(reason), _) => reason.clone(),
        (None, _) if !flight.finished => flight.faults.clone(),
        (None, None) => "-".to_owned(),
        (None, Some(settling)) => settling.time.map_or("never".to_owned(), |time| format!("{time:.2}")),
    };
    let or_none = |value: Option<f64>, digits: usize| value.map_or("-".to_owned(), |value| format!("{value:.digits$}"));
    vec![
        flight.law.to_owned(),
        ends,
        or_none(settling.map(|settling| 100.0 * settling.overshoot), 1),
        format!("{:.2}", flight.drives_m),
        format!("{:.2}", flight.overspeed_m_s),
        format!("{:.2}", flight.roll_back_m),
        format!("{:.1}", flight.arm_peak_deg),
        or_none(flight.spar_peak_deg, 1),
        format!("{:.2}", flight.sliding_s),
        format!("{:.0}", flight.energy_j),
    ]
}

/// Notes on the basis of the tables.
fn notes(planar: &PlanarSteps) -> String {
    let least = planar.least_to_rest.map_or("no time".to_owned(), |time| {
        format!("{time:.2} time units of {:.4} s", planar.time_unit_s)
    });
    format!(
        "Momentum allows no vehicle to come from rest to rest in itself at that speed in less than {least}. The best step \
         found knows everything and keeps to the file's grip, current, voltage and arm limit."
    )
}

/// The comparison for the terminal.
pub fn text(laws: &[Contender], planar: &PlanarSteps, flights: &[Flight]) -> String {
    let mut text = String::new();
    for law in laws {
        _ = writeln!(text, "{:<24} {}", law.name, law.how);
    }
    for table in tables(planar, flights) {
        let all =
            || std::iter::once(table.columns.iter().map(|name| (*name).to_owned()).collect()).chain(table.rows.clone());
        let widths: Vec<usize> = (0..table.columns.len())
            .map(|column| {
                all()
                    .map(|row: Vec<String>| row[column].chars().count())
                    .max()
                    .unwrap_or(0)
            })
            .collect();
        _ = writeln!(text, "\n{}", table.heading);
        for row in all() {
            let cells: Vec<String> = row
                .iter()
                .zip(&widths)
                .enumerate()
                .map(|(column, (cell, &width))| {
                    if column == 0 {
                        format!("{cell:<width$}")
                    } else {
                        format!("{cell:>width$}")
                    }
                })
                .collect();
            _ = writeln!(text, "  {}", cells.join("  ").trim_end());
        }
    }
    _ = writeln!(text, "\n{}", notes(planar));
    text
}

/// The cost of a tick under each law relative to the first law, for the terminal.
pub fn costs(laws: &[Contender], costs: &[f64]) -> String {
    let mut text = format!(
        "\nWhat a whole tick costs on this host, over that of {} (least of some replays in this run)\n",
        laws.first().map_or("none", |law| law.name)
    );
    for (law, cost) in laws.iter().zip(costs) {
        _ = writeln!(text, "  {:<24} {cost:.2}", law.name);
    }
    text
}

/// The comparison as a page.
///
/// # Errors
/// The drawing library's message.
pub fn page(laws: &[Contender], planar: &PlanarSteps, flights: &[Flight]) -> Result<String, String> {
    let mut body = String::from("<header>\n<h1>The laws compared</h1>\n");
    body.push_str("<table><tr><th>law</th><th>what it is</th></tr>\n");
    for law in laws {
        _ = writeln!(
            body,
            "<tr><td>{}</td><td>{}</td></tr>",
            escaped(law.name),
            escaped(&law.how)
        );
    }
    _ = writeln!(body, "</table>\n<p>{}</p>\n</header>\n<main>", escaped(&notes(planar)));
    let charts = charts(planar, flights);
    for (table, chart) in tables(planar, flights).iter().zip(charts) {
        _ = writeln!(
            body,
            "<article class=\"stacked\">\n<div><h3>{}</h3>\n<div class=\"wide\"><table class=\"numbers\">",
            escaped(&table.heading)
        );
        row(&mut body, "th", table.columns.iter().copied());
        for cells in &table.rows {
            row(&mut body, "td", cells.iter().map(String::as_str));
        }
        _ = writeln!(
            body,
            "</table></div></div>\n<div class=\"wide\">{}</div>\n</article>",
            chart.to_svg()?
        );
    }
    body.push_str("</main>\n");
    Ok(document("The laws compared", &body))
}

/// One row of a table on the page.
fn row<'a>(body: &mut String, tag: &str, cells: impl Iterator<Item = &'a str>) {
    body.push_str("<tr>");
    for cell in cells {
        _ = write!(body, "<{tag}>{}</{tag}>", escaped(cell));
    }
    body.push_str("</tr>\n");
}

/// One chart for each table: the speed over time.
fn charts(planar: &PlanarSteps, flights: &[Flight]) -> Vec<Chart> {
    let mut first = Chart::new("Speed on the planar vehicle", "time, time units", "speed, speed units");
    for step in &planar.steps {
        first = first.with(Series::new(step.law, &step.speed.0, &step.speed.1));
    }
    let mut charts = vec![first.y_range(-1.0, 2.0)];
    for course in by_course(flights) {
        let chart = Chart::new("True speed", "time, s", "m/s");
        charts.push(course.iter().fold(chart, |chart, flight| {
            chart.with(Series::new(flight.law, &flight.speed.0, &flight.speed.1))
        }));
    }
    charts
}
