//! `hil-sim figures`: every figure of the thesis as SVG and CSV, and one page.

use std::path::{Path, PathBuf};

use clap::Args;
use serde::Serialize;

use crate::figures::figure::Figure;
use crate::figures::{all, write_all};
use report::error::CommandError;
use report::output::{OutputArguments, Report, progress_bar};

/// Flags of `figures`.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub struct Arguments {
    /// Where the figures and index.html are written
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Print exactly one JSON object on stdout
    #[arg(long)]
    json: bool,
}

const EXAMPLES: &str = "\
Examples:
  hil-sim figures --out out/figures";

/// What the command prints with `--json`.
#[derive(Debug, Serialize)]
struct FiguresJson {
    /// In printable form: a path need not be valid text.
    page: String,
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
    let outcome = outcome(&arguments.out, &figures);
    let mut report = Report::new("figures", &outcome);
    for line in &outcome.figures {
        report = report.line(line.id, format!("{:9}  {}", line.verdict, line.title));
    }
    report = report.line("page", &outcome.page);
    OutputArguments {
        html: None,
        json: arguments.json,
        out: None,
    }
    .emit(&report)
}

fn outcome(out: &Path, figures: &[Figure]) -> FiguresJson {
    let line = |f: &Figure| FigureLine {
        id: f.id,
        title: f.title.clone(),
        verdict: f.verdict.word(),
    };
    FiguresJson {
        page: out.join("index.html").display().to_string(),
        figures: figures.iter().map(line).collect(),
    }
}

#[cfg(all(test, unix))]
mod tests {
    use std::os::unix::ffi::OsStrExt;

    use super::*;

    #[test]
    fn a_folder_whose_name_is_no_text_is_told_in_json() {
        let folder = Path::new(std::ffi::OsStr::from_bytes(b"figures\xff"));
        let page = outcome(folder, &[]).page;
        assert_eq!(page, "figures\u{fffd}/index.html");
    }
}
