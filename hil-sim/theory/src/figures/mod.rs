//! Every figure of the thesis, recomputed, beside the thesis's claim.
//!
//! The file of each chapter lists its figures in a `FIGURES` constant; [`all`] joins the chapters. Functions
//! without arguments make the figures, in parallel, and [`write_all`] writes each figure as SVG and CSV and
//! onto one page.

mod chapter_3;
mod chapter_4;
mod chapter_5;
mod chapter_6;
mod chapter_7;
mod chapter_8;
pub mod figure;
mod page;
mod planar_vehicle;

use std::path::Path;

use rayon::prelude::*;

use report::error::CommandError;
use report::output::{create_directory, write_file};
use report::plot::Chart;

use figure::{Entry, Figure};

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
    use figure::{FigureError, Verdict};
    use report::plot::Series;

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
        for part in [
            "A &amp; B",
            "refuted",
            "figure-9-9.csv",
            "<svg",
            "viewport",
            "data:image/svg+xml,%3Csvg",
        ] {
            assert!(page.contains(part), "{part}");
        }
        std::fs::remove_dir_all(&directory).unwrap();
    }
}
