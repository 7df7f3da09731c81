//! Every figure of the thesis, computed afresh, beside what the thesis claims of it.
//!
//! A chapter's file lists its figures in a `FIGURES` constant; [`all`] joins the chapters. A figure is
//! made by a function without arguments, so that the figures can be made in parallel, and is written
//! as SVG and CSV and onto one page.

mod chapter_3;
mod chapter_4;
mod chapter_5;
mod chapter_6;
mod chapter_7;
mod chapter_8;
mod page;

use std::path::Path;

use rayon::prelude::*;

use report::error::CommandError;
use report::output::{create_directory, write_file};
use report::plot::{Chart, Columns, Series};

/// What comes of the thesis's claim.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Verdict {
    /// It holds, to the precision of the print.
    Confirmed,
    /// It holds in part, or with other numbers.
    Corrected,
    /// It does not hold.
    Refuted,
    /// The thesis has no such figure: it supports a correction.
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
    /// What it is.
    pub name: String,
    /// What the thesis prints; empty if it prints none.
    pub thesis: String,
    /// What is found here.
    pub ours: String,
}

/// A figure with its comparison.
#[derive(Debug, Clone)]
pub struct Figure {
    /// Its number: "3.2"; figures that the thesis lacks have a letter: "4.2a".
    pub id: &'static str,
    /// What it shows.
    pub title: String,
    /// What the thesis claims, in our words.
    pub claim: String,
    /// The numbers side by side.
    pub numbers: Vec<Number>,
    /// What comes of the claim.
    pub verdict: Verdict,
    /// Why, in a sentence or two, with the erratum's number.
    pub finding: String,
    /// What is drawn; each chart is written as SVG, all their series as one CSV file.
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

    /// With what was found.
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
    fn columns(&self) -> Columns {
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

/// A figure not yet made.
#[derive(Debug, Clone, Copy)]
pub struct Entry {
    /// Its number, as in [`Figure::id`].
    pub id: &'static str,
    /// Makes it.
    pub make: fn() -> Result<Figure, FigureError>,
}

/// Every figure, in the order of the thesis.
pub fn all() -> Vec<Entry> {
    [
        chapter_3::FIGURES,
        chapter_4::FIGURES,
        chapter_5::FIGURES,
        chapter_6::FIGURES,
        chapter_7::FIGURES,
        chapter_8::FIGURES,
    ]
    .concat()
}

/// Makes the figures on all cores and writes them and `index.html` into `directory`; `done` is called
/// after each figure.
///
/// # Errors
/// [`CommandError::Other`] naming the figure or the file that failed.
pub fn write_all(entries: &[Entry], directory: &Path, done: impl Fn() + Sync) -> Result<Vec<Figure>, CommandError> {
    create_directory(directory)?;
    let made: Vec<(Figure, Vec<String>)> = entries
        .par_iter()
        .map(|entry| {
            let fail = |e: &dyn std::fmt::Display| CommandError::Other(format!("figure {}: {e}", entry.id));
            let figure = (entry.make)().map_err(|e| fail(&e))?;
            let svgs = figure
                .charts
                .iter()
                .map(Chart::to_svg)
                .collect::<Result<Vec<_>, _>>()
                .map_err(|e| fail(&e))?;
            for (k, svg) in svgs.iter().enumerate() {
                let part = if svgs.len() == 1 {
                    String::new()
                } else {
                    format!("-{}", k + 1)
                };
                write_file(directory, &format!("{}{part}.svg", figure.stem()), svg)?;
            }
            write_file(directory, &format!("{}.csv", figure.stem()), &figure.columns().to_csv())?;
            done();
            Ok((figure, svgs))
        })
        .collect::<Result<_, CommandError>>()?;
    write_file(directory, "index.html", &page::page(&made))?;
    Ok(made.into_iter().map(|(figure, _)| figure).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_figure_has_its_own_number_in_order_of_chapters() {
        let ids: Vec<&str> = all().iter().map(|e| e.id).collect();
        for (k, id) in ids.iter().enumerate() {
            assert!(!ids[..k].contains(id), "{id} twice");
            assert!(
                k == 0 || ids[k - 1].as_bytes()[0] <= id.as_bytes()[0],
                "{id} out of order"
            );
        }
    }

    #[test]
    fn a_figure_is_written_with_its_page() {
        let make: fn() -> Result<Figure, FigureError> = || {
            let chart = Chart::new("A < B", "t", "x").with(Series::new("s, 1", &[0.0, 1.0], &[2.0, 3.0]));
            Ok(Figure::new("9.9", "A & B", Verdict::Refuted)
                .claim("c")
                .number("n", "1", "2")
                .finding("f")
                .chart(chart))
        };
        let directory = std::env::temp_dir().join(format!("hil-sim-figures-{}", std::process::id()));
        let entries = [Entry { id: "9.9", make }];
        write_all(&entries, &directory, || ()).unwrap();
        let read = |name: &str| std::fs::read_to_string(directory.join(name)).unwrap();
        assert_eq!(read("figure-9-9.csv"), "\"s, 1: t\",\"s, 1: x\"\n0,2\n1,3\n");
        assert!(read("figure-9-9.svg").starts_with("<svg"));
        let page = read("index.html");
        for part in ["A &amp; B", "refuted", "figure-9-9.csv", "<svg", "viewport"] {
            assert!(page.contains(part), "{part}");
        }
        std::fs::remove_dir_all(&directory).unwrap();
    }
}
