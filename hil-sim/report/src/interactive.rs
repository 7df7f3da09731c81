//! Interactive pages: charts with zoom and one cursor, a strip of events, the vehicle to scale, a scrubber.
//!
//! A page is one file without external resources. uPlot (MIT), from the console's folder, draws the charts.

use std::fmt::Write as _;

use serde::Serialize;

use crate::html::escaped;
use crate::plot::Chart;
use crate::visible::visible_json;

/// An event, for the strip.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct StripEvent {
    /// Start of the event, s.
    pub at_s: f64,
    /// Duration of the event, s.
    pub for_s: Option<f64>,
    /// Its kind: the lane's name.
    pub kind: &'static str,
    /// What happened.
    pub text: String,
    /// Whether the event is a problem.
    pub trouble: bool,
}

/// The vehicle's dimensions, and its motion row by row, for the two views.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct Scene {
    /// Wheel radius, m.
    pub wheel_radius_m: f64,
    /// The arm's length, m.
    pub arm_length_m: f64,
    /// Height of the camera above the axle, m; 0 without a spar.
    pub camera_m: f64,
    /// Distance of the ballast's motor below the axle, m.
    pub motor_m: f64,
    /// Distance of the ballast from its motor, m.
    pub ballast_m: f64,
    /// Place along x, m.
    #[serde(serialize_with = "short")]
    pub x: Vec<f64>,
    /// Place along y, m.
    #[serde(serialize_with = "short")]
    pub y: Vec<f64>,
    /// Place along x by dead reckoning, m.
    #[serde(serialize_with = "short")]
    pub estimated_x: Vec<f64>,
    /// Place along y by dead reckoning, m.
    #[serde(serialize_with = "short")]
    pub estimated_y: Vec<f64>,
    /// Heading, rad.
    #[serde(serialize_with = "short")]
    pub heading: Vec<f64>,
    /// Slope under the wheels, rad.
    #[serde(serialize_with = "short")]
    pub slope: Vec<f64>,
    /// Arm angle, rad.
    #[serde(serialize_with = "short")]
    pub phi: Vec<f64>,
    /// Spar angle, rad.
    #[serde(serialize_with = "short")]
    pub spar: Vec<f64>,
    /// Ballast angle from the spar, rad.
    #[serde(serialize_with = "short")]
    pub ballast: Vec<f64>,
}

/// A page.
#[derive(Debug, Clone, Default)]
pub struct InteractivePage<'a> {
    /// Its title.
    pub title: &'a str,
    /// Markup below the title.
    pub head: String,
    /// The time of every row, s, if the page shows a run: the x values of the charts over time.
    pub time: Vec<f64>,
    /// What happened.
    pub events: Vec<StripEvent>,
    /// The views of the vehicle.
    pub scene: Option<Scene>,
    /// The charts. On a page with `time`, a chart whose x label is [`TIME_LABEL`] must have a point for every row.
    pub charts: Vec<Chart>,
    /// Markup below the charts.
    pub tail: String,
}

/// Label of the horizontal axis of the charts that share the cursor.
pub const TIME_LABEL: &str = "time, s";

const PAGE_STYLE: &str = include_str!("interactive/page.css");
const SCRIPT: &str = include_str!("interactive/page.js");
/// uPlot 1.6, MIT. Its licence is in the same folder and in the page.
const PLOT_SCRIPT: &str = include_str!("../../console/page/vendor/uPlot.iife.min.js");
const PLOT_STYLE: &str = include_str!("../../console/page/vendor/uPlot.min.css");
const PLOT_LICENCE: &str = include_str!("../../console/page/vendor/uPlot-LICENSE");

#[derive(Serialize)]
struct Data<'a> {
    time: Option<Vec<Rounded>>,
    events: &'a [StripEvent],
    scene: Option<&'a Scene>,
    charts: Vec<ChartData<'a>>,
}

#[derive(Serialize)]
struct ChartData<'a> {
    x_label: &'a str,
    y_label: &'a str,
    log_y: bool,
    y_range: Option<(f64, f64)>,
    over_time: bool,
    marks: bool,
    x: Vec<Rounded>,
    series: Vec<SeriesData<'a>>,
}

#[derive(Serialize)]
struct SeriesData<'a> {
    name: &'a str,
    values: Vec<Rounded>,
}

/// A number with the six digits that a screen can show. A value that is not finite becomes a gap.
struct Rounded(f64);

impl Serialize for Rounded {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        if !self.0.is_finite() {
            return serializer.serialize_none();
        }
        let short = format!("{:.5e}", self.0);
        serializer.serialize_f64(short.parse().unwrap_or(self.0))
    }
}

fn short<S: serde::Serializer>(values: &[f64], serializer: S) -> Result<S::Ok, S::Error> {
    serializer.collect_seq(values.iter().map(|value| Rounded(*value)))
}

fn rounded(values: impl IntoIterator<Item = f64>) -> Vec<Rounded> {
    values.into_iter().map(Rounded).collect()
}

impl InteractivePage<'_> {
    /// The page as one HTML document.
    ///
    /// # Errors
    /// The encoder's message.
    pub fn to_html(&self) -> Result<String, String> {
        let data = Data {
            time: (!self.time.is_empty()).then(|| rounded(self.time.iter().copied())),
            events: &self.events,
            scene: self.scene.as_ref(),
            charts: self.charts.iter().map(|chart| self.chart(chart)).collect(),
        };
        let json = serde_json::to_string(&data).map_err(|error| error.to_string())?;
        // Nothing in the data may end the element that contains it.
        let json = visible_json(&json).replace('<', "\\u003c");
        let mut body = format!(
            "<header>\n<h1>{}</h1>\n{}\n</header>\n<main>\n",
            escaped(self.title),
            self.head
        );
        if let Some(scene) = &self.scene {
            let spar = if scene.camera_m > 0.0 { ", spar and ballast" } else { "" };
            _ = writeln!(
                body,
                "<div class=\"grid\">\n<section class=\"card\"><h3>From its right: wheel, arm{spar}</h3>\
                 <canvas class=\"scene\" id=\"side\" role=\"img\" aria-label=\"The vehicle from its right, to scale\"></canvas></section>\n\
                 <section class=\"card\"><h3>Path from above: by dead reckoning, and true (dashes and dots)</h3>\
                 <canvas class=\"scene\" id=\"above\" role=\"img\" aria-label=\"The vehicle's path from above, to scale\"></canvas></section>\n</div>"
            );
        }
        if !self.time.is_empty() {
            body.push_str(
                "<h2>What happened when</h2>\n<section class=\"card\"><div class=\"strip\" id=\"strip\"></div></section>\n\
                 <p class=\"quiet\">Drag over a chart, or press + and \u{2212}, to zoom; double-click or <em>Whole run</em> shows all.</p>\n",
            );
        }
        body.push_str("<div class=\"grid\">\n");
        for (k, chart) in self.charts.iter().enumerate() {
            _ = writeln!(
                body,
                "<section class=\"card\"><h3>{}</h3><div data-chart=\"{k}\"></div></section>",
                escaped(&chart.title)
            );
        }
        _ = writeln!(body, "</div>\n{}\n</main>", self.tail);
        if !self.time.is_empty() {
            body.push_str(
                "<div class=\"scrub\"><button type=\"button\" class=\"play\" id=\"play\">Play</button>\
                 <input type=\"range\" id=\"time\" min=\"0\" value=\"0\" aria-label=\"Time\">\
                 <output id=\"now\"></output>\
                 <button type=\"button\" id=\"closer\" aria-label=\"Zoom in\">+</button>\
                 <button type=\"button\" id=\"wider\" aria-label=\"Zoom out\">\u{2212}</button>\
                 <button type=\"button\" id=\"whole\">Whole run</button></div>\n",
            );
        }
        Ok(format!(
            "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
             <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
             <title>{}</title>\n<style>{PLOT_STYLE}\n{PAGE_STYLE}</style>\n</head>\n<body>\n{body}\
             <script type=\"application/json\" id=\"data\">{json}</script>\n\
             <script>/*\n{PLOT_LICENCE}*/\n{PLOT_SCRIPT}</script>\n<script>{SCRIPT}</script>\n</body>\n</html>\n",
            escaped(self.title)
        ))
    }

    fn chart<'b>(&self, chart: &'b Chart) -> ChartData<'b> {
        let over_time = !self.time.is_empty()
            && chart.x_label == TIME_LABEL
            && chart.series.iter().all(|series| series.points.len() == self.time.len());
        let (x, values): (Vec<f64>, Vec<Vec<f64>>) = if over_time {
            let values = |k: usize| chart.series[k].points.iter().map(|point| point.1).collect();
            (Vec::new(), (0..chart.series.len()).map(values).collect())
        } else {
            aligned(chart)
        };
        ChartData {
            x_label: &chart.x_label,
            y_label: &chart.y_label,
            log_y: chart.log_y,
            y_range: chart.y_range,
            over_time,
            marks: chart.marks,
            x: rounded(x),
            series: chart
                .series
                .iter()
                .zip(values)
                .map(|(series, values)| SeriesData {
                    name: &series.name,
                    values: rounded(values),
                })
                .collect(),
        }
    }
}

/// The curves of a chart over all x values in order. A curve has a gap where it has no point.
fn aligned(chart: &Chart) -> (Vec<f64>, Vec<Vec<f64>>) {
    let mut x: Vec<f64> = chart
        .series
        .iter()
        .flat_map(|series| series.points.iter().map(|point| point.0))
        .filter(|x| x.is_finite())
        .collect();
    x.sort_by(f64::total_cmp);
    x.dedup();
    let columns = chart.series.iter().map(|series| {
        let mut column = vec![f64::NAN; x.len()];
        for (at, y) in &series.points {
            if let Ok(row) = x.binary_search_by(|x| x.total_cmp(at)) {
                column[row] = *y;
            }
        }
        column
    });
    let columns = columns.collect();
    (x, columns)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plot::Series;

    #[test]
    fn curves_over_different_x_share_one_axis_with_gaps() {
        let chart = Chart::new("c", "x", "y")
            .with(Series::new("a", &[0.0, 2.0], &[1.0, 3.0]))
            .with(Series::new("b", &[1.0, 2.0], &[5.0, f64::NAN]));
        let (x, columns) = aligned(&chart);
        assert_eq!(x, [0.0, 1.0, 2.0]);
        assert!(columns[0][0] == 1.0 && columns[0][1].is_nan() && columns[0][2] == 3.0);
        assert!(columns[1][0].is_nan() && columns[1][1] == 5.0 && columns[1][2].is_nan());
    }

    #[test]
    fn nothing_in_the_data_ends_its_element() {
        let page = InteractivePage {
            title: "</title><script>",
            time: vec![0.0],
            events: vec![StripEvent {
                at_s: 0.0,
                for_s: None,
                kind: "fault",
                text: "</script><b>\u{1b}".to_owned(),
                trouble: true,
            }],
            ..InteractivePage::default()
        };
        let html = page.to_html().expect("encodes");
        let data = html
            .split("id=\"data\">")
            .nth(1)
            .expect("data")
            .split("</script>")
            .next()
            .expect("ends");
        assert!(
            data.contains("\\u003c/script>\\u003cb>") && !data.contains('\u{1b}'),
            "{data}"
        );
        let read: serde_json::Value = serde_json::from_str(data).expect("JSON");
        assert_eq!(read["events"][0]["text"], "</script><b>\u{1b}");
        assert!(html.contains("<h1>&lt;/title&gt;&lt;script&gt;</h1>"));
    }

    #[test]
    fn numbers_are_short_and_gaps_are_null() {
        let text = serde_json::to_string(&rounded([1.0 / 3.0, f64::INFINITY, 2.0])).expect("encodes");
        assert_eq!(text, "[0.333333,null,2.0]");
    }
}
