//! A figure of the thesis with its comparison.

use report::plot::{Chart, Columns, Series};

/// The verdict on the thesis's claim.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Verdict {
    /// The claim holds, to the precision of the print.
    Confirmed,
    /// The claim holds in part, or with other numbers.
    Corrected,
    /// The claim does not hold.
    Refuted,
    /// The thesis has no such figure; the figure supports a correction.
    Added,
}

impl Verdict {
    /// The word on the page.
    pub fn word(self) -> &'static str {
        match self {
            Self::Confirmed => "confirmed",
            Self::Corrected => "corrected",
            Self::Refuted => "refuted",
            Self::Added => "added",
        }
    }
}

/// One number of the comparison.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Number {
    /// What the number measures.
    pub name: String,
    /// What the thesis prints; empty if it prints no such number.
    pub thesis: String,
    /// The value computed here.
    pub ours: String,
}

/// A figure with its comparison.
#[derive(Debug, Clone)]
pub struct Figure {
    /// Number of the figure: "3.2"; figures that the thesis lacks have a letter: "4.2a".
    pub id: &'static str,
    /// What the figure shows.
    pub title: String,
    /// The thesis's claim, paraphrased.
    pub claim: String,
    /// The numbers side by side.
    pub numbers: Vec<Number>,
    /// The verdict on the claim.
    pub verdict: Verdict,
    /// Why, in a sentence or two, with the erratum's number.
    pub finding: String,
    /// The charts; each chart is written as SVG, the series of all charts as one CSV file.
    pub charts: Vec<Chart>,
}

impl Figure {
    /// A figure without numbers and charts.
    pub fn new(id: &'static str, title: impl Into<String>, verdict: Verdict) -> Self {
        let (claim, finding) = (String::new(), String::new());
        Self {
            id,
            title: title.into(),
            claim,
            numbers: Vec::new(),
            verdict,
            finding,
            charts: Vec::new(),
        }
    }

    /// With the thesis's claim.
    #[must_use]
    pub fn claim(mut self, claim: impl Into<String>) -> Self {
        self.claim = claim.into();
        self
    }

    /// With the finding.
    #[must_use]
    pub fn finding(mut self, finding: impl Into<String>) -> Self {
        self.finding = finding.into();
        self
    }

    /// With one more number; `thesis` is empty if the thesis prints none.
    #[must_use]
    pub fn number(mut self, name: impl Into<String>, thesis: impl Into<String>, ours: impl Into<String>) -> Self {
        self.numbers.push(Number {
            name: name.into(),
            thesis: thesis.into(),
            ours: ours.into(),
        });
        self
    }

    /// With one more chart.
    #[must_use]
    pub fn chart(mut self, chart: Chart) -> Self {
        self.charts.push(chart);
        self
    }

    /// The stem of its files: "figure-3-2".
    pub fn stem(&self) -> String {
        format!("figure-{}", self.id.replace('.', "-"))
    }

    /// Every series of every chart, as two columns each.
    pub fn columns(&self) -> Columns {
        let series = self
            .charts
            .iter()
            .flat_map(|chart| chart.series.iter().map(move |s| (chart, s)));
        series.fold(Columns::new(), |columns, (chart, series)| {
            let Series { name, points } = series;
            let name = if name.is_empty() {
                chart.title.as_str()
            } else {
                name.as_str()
            };
            let (x, y): (Vec<f64>, Vec<f64>) = points.iter().copied().unzip();
            columns
                .with(quoted(&format!("{name}: {}", chart.x_label)), x)
                .with(quoted(&format!("{name}: {}", chart.y_label)), y)
        })
    }
}

/// A CSV header that may contain commas.
fn quoted(text: &str) -> String {
    format!("\"{}\"", text.replace('"', "'"))
}

/// Why a figure could not be made.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct FigureError(pub String);

impl FigureError {
    /// Wraps any error of the analysis; for `map_err`.
    pub fn from_error(error: impl std::fmt::Display) -> Self {
        Self(error.to_string())
    }
}

/// A figure before it is computed.
#[derive(Debug, Clone, Copy)]
pub struct Entry {
    /// The figure's number, as in [`Figure::id`].
    pub id: &'static str,
    /// Computes the figure.
    pub make: fn() -> Result<Figure, FigureError>,
}

impl Entry {
    /// The figure `id`, which `make` computes.
    pub const fn new(id: &'static str, make: fn() -> Result<Figure, FigureError>) -> Self {
        Self { id, make }
    }
}
