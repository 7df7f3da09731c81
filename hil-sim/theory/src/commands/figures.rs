//! `hil-sim figures`: every figure of the thesis as SVG and CSV, and one page.

use std::path::PathBuf;

use clap::Args;
use serde::Serialize;

use crate::figures::figure::Figure;
use crate::figures::{all, write_all};
use report::error::CommandError;
use report::output::{OutputArguments, Report, progress_bar};

/// Flags of `figures`.
#[derive(Debug, Args)]
pub struct Arguments {
    /// Where the figures and index.html are written
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Print exactly one JSON object on stdout
    #[arg(long)]
    json: bool,
}

/// What the command prints with `--json`.
#[derive(Debug, Serialize)]
struct FiguresJson {
    page: PathBuf,
    figures: Vec<FigureLine>,
}

/// One figure.
#[derive(Debug, Serialize)]
struct FigureLine {
    id: &'static str,
    title: String,
    verdict: &'static str,
}

/// Runs the command.
///
/// # Errors
/// [`CommandError::Other`] if a figure cannot be made or written.
pub fn run(arguments: &Arguments) -> Result<(), CommandError> {
    let entries = all();
    let bar = progress_bar(entries.len(), "figures");
    let figures = write_all(&entries, &arguments.out, || bar.inc(1))?;
    bar.finish_and_clear();
    let line = |f: &Figure| FigureLine {
        id: f.id,
        title: f.title.clone(),
        verdict: f.verdict.word(),
    };
    let outcome = FiguresJson {
        page: arguments.out.join("index.html"),
        figures: figures.iter().map(line).collect(),
    };
    let mut report = Report::new("figures", &outcome);
    for line in &outcome.figures {
        report = report.line(line.id, format!("{:9}  {}", line.verdict, line.title));
    }
    report = report.line("page", outcome.page.display());
    OutputArguments {
        json: arguments.json,
        out: None,
    }
    .emit(&report)
}
