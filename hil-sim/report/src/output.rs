//! The output of every analysis command: `--json`, `--out DIR`, `--html FILE`, or a short table.

use std::fmt::Write as _;
use std::io::{IsTerminal, Write as _};
use std::path::{Path, PathBuf};

use clap::Args;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use serde::Serialize;

use crate::colour::bad_on_stderr;
use crate::error::CommandError;
use crate::files::write_whole;
use crate::html::escaped;
use crate::interactive::InteractivePage;
use crate::plot::{Chart, Columns};
use crate::visible::{visible, visible_json};

/// Flags that select the outputs of the result.
#[derive(Debug, Clone, Default, Args)]
pub struct OutputArguments {
    /// Print exactly one JSON object on stdout, every number with its full precision
    #[arg(long)]
    pub json: bool,
    /// Write the computed data as CSV and its charts as SVG into this directory
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Write the table and the charts as one interactive page into this file
    #[arg(long, value_name = "FILE.html")]
    pub html: Option<PathBuf>,
}

/// A command's results.
#[derive(Debug)]
pub struct Report<'a, R> {
    /// The command's name: the stem of the files in `--out`.
    pub command: &'static str,
    /// The object that `--json` prints.
    pub result: &'a R,
    /// The lines printed without `--json`: label and value.
    pub lines: Vec<(String, String)>,
    /// The columns of `COMMAND.csv`; no file if empty.
    pub columns: Columns,
    /// Name and chart of each `COMMAND-NAME.svg`.
    pub charts: Vec<(&'static str, Chart)>,
}

impl<'a, R: Serialize> Report<'a, R> {
    /// A report without lines, columns and charts.
    pub fn new(command: &'static str, result: &'a R) -> Self {
        Self {
            command,
            result,
            lines: Vec::new(),
            columns: Columns::new(),
            charts: Vec::new(),
        }
    }

    /// The report with one more line of the table.
    #[must_use]
    pub fn line(mut self, label: impl Into<String>, value: impl std::fmt::Display) -> Self {
        self.lines.push((label.into(), value.to_string()));
        self
    }

    /// The report with the columns of the CSV file.
    #[must_use]
    pub fn columns(mut self, columns: Columns) -> Self {
        self.columns = columns;
        self
    }

    /// The report with one more chart.
    #[must_use]
    pub fn chart(mut self, name: &'static str, chart: Chart) -> Self {
        self.charts.push((name, chart));
        self
    }

    /// The report as one page.
    fn page(&self) -> Result<String, CommandError> {
        let mut tail = String::from("<section class=\"card\"><table>\n");
        for (label, value) in &self.lines {
            _ = writeln!(tail, "<tr><td>{}</td><td>{}</td></tr>", escaped(label), escaped(value));
        }
        tail.push_str("</table></section>\n");
        let page = InteractivePage {
            title: self.command,
            head: format!(
                "<p class=\"quiet\">hil-sim {}<br><code>{}</code></p>\n",
                env!("CARGO_PKG_VERSION"),
                escaped(&command_line())
            ),
            charts: self.charts.iter().map(|(_, chart)| chart.clone()).collect(),
            tail,
            ..InteractivePage::default()
        };
        page.to_html().map_err(CommandError::Other)
    }
}

/// This program's command line, for the pages that it writes.
pub fn command_line() -> String {
    let given: Vec<String> = std::env::args_os()
        .skip(1)
        .map(|argument| argument.to_string_lossy().into_owned())
        .collect();
    format!("hil-sim {}", given.join(" "))
}

impl OutputArguments {
    /// Whether the flags ask for charts.
    pub fn draws(&self) -> bool {
        self.out.is_some() || self.html.is_some()
    }

    /// Prints the report and writes its files.
    ///
    /// # Errors
    /// [`CommandError::Input`] when a file cannot be written, [`CommandError::Other`] when stdout cannot.
    pub fn emit<R: Serialize>(&self, report: &Report<'_, R>) -> Result<(), CommandError> {
        let mut files = Vec::new();
        if let Some(directory) = &self.out {
            create_directory(directory)?;
            if !report.columns.is_empty() {
                files.push(write_file(
                    directory,
                    &format!("{}.csv", report.command),
                    &report.columns.to_csv(),
                )?);
            }
            for (name, chart) in &report.charts {
                let svg = chart.to_svg().map_err(CommandError::Other)?;
                files.push(write_file(directory, &format!("{}-{name}.svg", report.command), &svg)?);
            }
        }
        if let Some(path) = &self.html {
            files.push(write_whole("--html", path, report.page()?.as_bytes())?);
        }
        if self.json {
            return print_json(report.result);
        }
        let mut text = String::new();
        let labels = report.lines.iter().map(|(label, _)| label.chars().count());
        let width = labels.max().unwrap_or(0);
        for (label, value) in &report.lines {
            _ = writeln!(text, "{label:width$}  {value}");
        }
        for file in files {
            _ = writeln!(text, "wrote {}", file.display());
        }
        print(&text)
    }
}

/// Prints `text` on stdout, with control characters replaced by their numbers.
///
/// # Errors
/// [`CommandError::Other`] when stdout cannot be written. A reader that closes the pipe (`| head`) is not
/// a failure.
pub fn print(text: &str) -> Result<(), CommandError> {
    write_out(&visible(text))
}

/// Prints the tool's own text on stdout, with its [colours](crate::colour). Text from files, paths and
/// boards in it must have been made [visible] before.
///
/// # Errors
/// As [`print()`].
pub fn print_coloured(text: &str) -> Result<(), CommandError> {
    write_out(text)
}

/// Prints `value` as one JSON object on one line of stdout.
///
/// # Errors
/// As [`print()`].
pub fn print_json(value: &impl Serialize) -> Result<(), CommandError> {
    let text = serde_json::to_string(value).map_err(|error| CommandError::Other(error.to_string()))?;
    write_out(&(visible_json(&text) + "\n"))
}

fn write_out(text: &str) -> Result<(), CommandError> {
    match std::io::stdout().lock().write_all(text.as_bytes()) {
        Err(e) if e.kind() == std::io::ErrorKind::BrokenPipe => Ok(()),
        written => written.map_err(|error| CommandError::Other(format!("standard output: {error}"))),
    }
}

/// Reports a command's failure on standard error.
pub fn tell(error: &CommandError) {
    // Not `eprintln!`, which panics when the reader has closed the stream.
    let _ = writeln!(
        std::io::stderr(),
        "{} {}",
        bad_on_stderr("error:"),
        visible(&error.to_string())
    );
}

/// Creates `directory` and its parents.
///
/// # Errors
/// [`CommandError::Input`] with the directory.
pub fn create_directory(directory: &Path) -> Result<(), CommandError> {
    std::fs::create_dir_all(directory).map_err(|error| {
        CommandError::Input(format!(
            "--out: cannot create {}: {error}; it must be a directory that can be written",
            directory.display()
        ))
    })
}

/// Writes `text` into `directory/name` of `--out`, whole or not at all, and returns the path.
///
/// # Errors
/// [`CommandError::Input`] with the file.
pub fn write_file(directory: &Path, name: &str, text: &str) -> Result<PathBuf, CommandError> {
    write_whole("--out", &directory.join(name), text.as_bytes())
}

/// A progress bar for `length` pieces of work on stderr, hidden unless stderr is a terminal.
pub fn progress_bar(length: usize, what: &'static str) -> ProgressBar {
    let target = if std::io::stderr().is_terminal() {
        ProgressDrawTarget::stderr()
    } else {
        ProgressDrawTarget::hidden()
    };
    let bar = ProgressBar::with_draw_target(Some(length as u64), target).with_message(what);
    if let Ok(style) = ProgressStyle::with_template("{msg} {wide_bar} {pos}/{len} {eta}") {
        bar.set_style(style);
    }
    bar
}
