//! Charts as SVG, for `--out` and for the figures.

use plotters::coord::ranged1d::{AsRangedCoord, ValueFormatter};
use plotters::prelude::*;

pub use crate::columns::Columns;
use crate::meaning::{self, Rgb};

/// The size of every chart in px without its legend; a page scales the chart to the available width.
const SIZE: (u32, u32) = (620, 430);

/// Area for the curves that title, labels and margins leave, px: measured on a drawn chart.
const PLOT_SIZE: (f64, f64) = (530.0, 334.0);

/// Points drawn per series at most: the extremes of each bucket are kept.
const DRAWN_POINTS: usize = 1600;

/// Half the width of a mark, px.
const MARK_SIZE: i32 = 6;

/// One curve.
#[derive(Debug, Clone, Default)]
pub struct Series {
    /// Name in the legend.
    pub name: String,
    /// The points; a point that is not finite (or, on a logarithmic axis, not positive) interrupts the curve.
    pub points: Vec<(f64, f64)>,
}

impl Series {
    /// A curve of `y` over `x`.
    pub fn new(name: impl Into<String>, x: &[f64], y: &[f64]) -> Self {
        Self {
            name: name.into(),
            points: x.iter().copied().zip(y.iter().copied()).collect(),
        }
    }

    /// A curve through `points`.
    pub fn from_points(name: impl Into<String>, points: Vec<(f64, f64)>) -> Self {
        Self {
            name: name.into(),
            points,
        }
    }
}

/// A chart: curves over one pair of axes.
#[derive(Debug, Clone, Default)]
pub struct Chart {
    /// Heading.
    pub title: String,
    /// Horizontal axis with its unit.
    pub x_label: String,
    /// Vertical axis with its unit.
    pub y_label: String,
    /// Whether the vertical axis is logarithmic.
    pub log_y: bool,
    /// The vertical range; `None` takes the range from the data.
    pub y_range: Option<(f64, f64)>,
    /// Whether both axes have the same scale, as on a map.
    pub equal_axes: bool,
    /// Whether the points are marks, which no line joins.
    pub marks: bool,
    /// The curves, drawn in order.
    pub series: Vec<Series>,
}

impl Chart {
    /// An empty chart with linear axes.
    pub fn new(title: impl Into<String>, x_label: impl Into<String>, y_label: impl Into<String>) -> Self {
        Self {
            title: title.into(),
            x_label: x_label.into(),
            y_label: y_label.into(),
            ..Self::default()
        }
    }

    /// The chart with one more curve.
    #[must_use]
    pub fn with(mut self, series: Series) -> Self {
        self.series.push(series);
        self
    }

    /// The chart with a logarithmic vertical axis.
    #[must_use]
    pub fn logarithmic(mut self) -> Self {
        self.log_y = true;
        self
    }

    /// The chart with its vertical axis from `low` to `high`.
    #[must_use]
    pub fn y_range(mut self, low: f64, high: f64) -> Self {
        self.y_range = Some((low, high));
        self
    }

    /// The chart with the same scale on both axes.
    #[must_use]
    pub fn equal_axes(mut self) -> Self {
        self.equal_axes = true;
        self
    }

    /// The chart with marks in place of curves.
    #[must_use]
    pub fn marks(mut self) -> Self {
        self.marks = true;
        self
    }

    /// The chart as one SVG document.
    ///
    /// # Errors
    /// The drawing library's message.
    pub fn to_svg(&self) -> Result<String, String> {
        let usable = |p: &(f64, f64)| p.0.is_finite() && p.1.is_finite() && (!self.log_y || p.1 > 0.0);
        let points = || self.series.iter().flat_map(|s| s.points.iter().copied()).filter(usable);
        let (mut x0, mut x1) = widened(points().map(|p| p.0), false, 0.0);
        let (mut y0, mut y1) = self
            .y_range
            .unwrap_or_else(|| widened(points().map(|p| p.1), self.log_y, 0.04));
        if self.equal_axes {
            let unit = ((x1 - x0) / PLOT_SIZE.0).max((y1 - y0) / PLOT_SIZE.1);
            (x0, x1) = about(0.5 * (x0 + x1), unit * PLOT_SIZE.0);
            (y0, y1) = about(0.5 * (y0 + y1), unit * PLOT_SIZE.1);
        }
        let mut text = String::new();
        {
            let legend = self.legend();
            let height = SIZE.1 + legend.last().map_or(0, |e| e.y + LEGEND_ROW);
            let root = SVGBackend::with_string(&mut text, (SIZE.0, height)).into_drawing_area();
            root.fill(&WHITE).map_err(|e| e.to_string())?;
            let (plot, below) = root.split_vertically(SIZE.1);
            if self.log_y {
                self.draw(&plot, x0..x1, (y0..y1).log_scale())?;
            } else {
                self.draw(&plot, x0..x1, y0..y1)?;
            }
            draw_legend(&below, &legend)?;
            root.present().map_err(|e| e.to_string())?;
        }
        Ok(text)
    }

    /// The named curves, laid out in rows below the axes, so that no curve is covered.
    fn legend(&self) -> Vec<LegendEntry<'_>> {
        let (mut x, mut y) = (LEGEND_LEFT, 0);
        let mut entries = Vec::new();
        for (k, series) in self.series.iter().enumerate().filter(|(_, s)| !s.name.is_empty()) {
            let width = 40 + 8 * series.name.chars().count() as u32;
            if x > LEGEND_LEFT && x + width > SIZE.0 {
                (x, y) = (LEGEND_LEFT, y + LEGEND_ROW);
            }
            entries.push(LegendEntry {
                x,
                y,
                name: &series.name,
                colour: rgb(meaning::colour(&series.name, k)),
            });
            x += width;
        }
        entries
    }

    fn draw<Y>(&self, root: &Area<'_>, x: std::ops::Range<f64>, y: Y) -> Result<(), String>
    where
        Y: AsRangedCoord<Value = f64>,
        Y::CoordDescType: ValueFormatter<f64>,
    {
        let fail = |e: &dyn std::fmt::Display| e.to_string();
        let mut chart = ChartBuilder::on(root)
            .caption(&self.title, ("sans-serif", 20))
            .margin(12)
            .x_label_area_size(46)
            .y_label_area_size(66)
            .build_cartesian_2d(x, y)
            .map_err(|e| fail(&e))?;
        chart
            .configure_mesh()
            .light_line_style(RGBColor(244, 244, 244))
            .bold_line_style(RGBColor(222, 222, 222))
            .x_desc(&self.x_label)
            .y_desc(&self.y_label)
            .x_label_formatter(&|v| short_number(*v))
            .y_label_formatter(&|v| short_number(*v))
            .label_style(("sans-serif", 16))
            .axis_desc_style(("sans-serif", 17))
            .draw()
            .map_err(|e| fail(&e))?;
        for (i, series) in self.series.iter().enumerate() {
            let style = rgb(meaning::colour(&series.name, i)).stroke_width(2);
            if self.marks {
                let marks = { series.points.iter() }.map(|point| Cross::new(*point, MARK_SIZE, style));
                chart.draw_series(marks).map_err(|e| fail(&e))?;
                continue;
            }
            for run in runs(&series.points, self.log_y) {
                chart
                    .draw_series(LineSeries::new(thinned(run), style))
                    .map_err(|e| fail(&e))?;
            }
        }
        Ok(())
    }
}

fn rgb((red, green, blue): Rgb) -> RGBColor {
    RGBColor(red, green, blue)
}

/// Where the legend's rows begin, in px.
const LEGEND_LEFT: u32 = 30;
/// Height of a row of the legend, in px.
const LEGEND_ROW: u32 = 22;

/// A name of the legend and its position.
#[derive(Debug)]
struct LegendEntry<'a> {
    x: u32,
    y: u32,
    name: &'a str,
    colour: RGBColor,
}

fn draw_legend(area: &Area<'_>, entries: &[LegendEntry<'_>]) -> Result<(), String> {
    for entry in entries {
        let (x, y) = (entry.x.cast_signed(), entry.y.cast_signed());
        let line = PathElement::new(vec![(x, y + 7), (x + 22, y + 7)], entry.colour.stroke_width(3));
        area.draw(&line).map_err(|e| e.to_string())?;
        let name = Text::new(entry.name.to_owned(), (x + 28, y), ("sans-serif", 15));
        area.draw(&name).map_err(|e| e.to_string())?;
    }
    Ok(())
}

type Area<'a> = DrawingArea<SVGBackend<'a>, plotters::coord::Shift>;

/// The range of this width centred on `middle`.
fn about(middle: f64, width: f64) -> (f64, f64) {
    (middle - 0.5 * width, middle + 0.5 * width)
}

/// The range of `values` with a margin of `margin` of its width; never empty.
fn widened(values: impl Iterator<Item = f64>, log: bool, margin: f64) -> (f64, f64) {
    let (low, high) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| (a.min(v), b.max(v)));
    if low > high {
        return if log { (0.1, 10.0) } else { (0.0, 1.0) };
    }
    if log {
        return (low / 1.3, high * 1.3);
    }
    let width = high - low;
    if width <= 1e-12 * (low.abs() + high.abs()) {
        let half = if low == 0.0 { 1.0 } else { 0.1 * low.abs() };
        return (low - half, high + half);
    }
    (low - margin * width, high + margin * width)
}

/// The stretches of drawable points.
fn runs(points: &[(f64, f64)], log: bool) -> impl Iterator<Item = &[(f64, f64)]> {
    points
        .split(move |p| !(p.0.is_finite() && p.1.is_finite() && (!log || p.1 > 0.0)))
        .filter(|run| !run.is_empty())
}

/// At most about [`DRAWN_POINTS`] of the points, with the extremes of every bucket.
fn thinned(points: &[(f64, f64)]) -> Vec<(f64, f64)> {
    if points.len() <= DRAWN_POINTS {
        return points.to_vec();
    }
    let bucket = points.len().div_ceil(DRAWN_POINTS / 2);
    let mut kept = Vec::with_capacity(DRAWN_POINTS + 2);
    for chunk in points.chunks(bucket) {
        let by_y = |a: &&(f64, f64), b: &&(f64, f64)| a.1.total_cmp(&b.1);
        if let (Some(low), Some(high)) = (chunk.iter().min_by(by_y), chunk.iter().max_by(by_y)) {
            kept.extend(if low.0 <= high.0 { [*low, *high] } else { [*high, *low] });
        }
    }
    kept.extend(points.last());
    kept
}

/// A number for an axis: few digits, no trailing zeros.
fn short_number(v: f64) -> String {
    // Rounding gives the axis tick at 0 as about 1e-16.
    if v.abs() < 1e-12 {
        return "0".into();
    }
    if v.abs() < 1e-3 || v.abs() >= 1e5 {
        return format!("{v:.0e}");
    }
    let text = format!("{v:.3}");
    let text = text.trim_end_matches('0').trim_end_matches('.');
    if text == "-0" { "0".into() } else { text.to_owned() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_chart_shows_its_curves_names_and_axes() {
        let x: Vec<f64> = (0..5000).map(|k| f64::from(k) * 0.01).collect();
        let y: Vec<f64> = x.iter().map(|t| t.sin()).collect();
        let chart = Chart::new("Title", "time", "angle").with(Series::new("swing", &x, &y));
        let svg = chart.to_svg().unwrap();
        for part in [
            "<svg", "viewBox", "Title", "time", "angle", "swing", "polyline", "</svg>",
        ] {
            assert!(svg.contains(part), "{part}");
        }
        assert!(svg.len() < 60_000, "{}", svg.len());
    }

    #[test]
    fn a_gap_and_a_logarithm_do_not_hide_the_rest() {
        let points = vec![(0.0, 1.0), (1.0, f64::NAN), (2.0, 0.0), (3.0, 100.0), (4.0, 1000.0)];
        let svg = Chart::new("t", "x", "y")
            .logarithmic()
            .with(Series::from_points("a", points))
            .to_svg()
            .unwrap();
        assert!(svg.contains("1000") && !svg.contains("NaN"));
        assert!(Chart::new("empty", "x", "y").to_svg().unwrap().contains("empty"));
    }

    #[test]
    fn marks_are_crosses_and_no_line_joins_them() {
        let chart = Chart::new("t", "x", "y").with(Series::new("poles", &[1.0, 2.0, 3.0], &[5.0, 6.0, 9.0]));
        let lines = |chart: &Chart| chart.to_svg().expect("draws").matches("<line").count();
        let curves = |chart: &Chart| chart.to_svg().expect("draws").matches("<polyline").count();
        let marked = chart.clone().marks();
        assert_eq!(
            (lines(&marked) - lines(&chart), curves(&chart) - curves(&marked)),
            (6, 1)
        );
    }

    #[test]
    fn thinning_keeps_the_extremes() {
        let points: Vec<(f64, f64)> = (0..100_000)
            .map(|k| (f64::from(k), if k == 54_321 { 9.0 } else { 0.0 }))
            .collect();
        let kept = thinned(&points);
        assert!(kept.len() <= DRAWN_POINTS + 2 && kept.contains(&(54_321.0, 9.0)) && kept.contains(&(99_999.0, 0.0)));
        assert!(kept.windows(2).all(|w| w[0].0 <= w[1].0));
    }

    #[test]
    fn csv_keeps_every_digit() {
        let csv = Columns::new()
            .with("t", vec![0.1, 1.0 / 3.0])
            .with("x", vec![2.0])
            .to_csv();
        assert_eq!(csv, "t,x\n0.1,2\n0.3333333333333333,\n");
    }
}
