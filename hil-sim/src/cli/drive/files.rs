//! The files of a run.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use report::error::CommandError;
use report::files::NewFile;
use report::output::{create_directory, write_file};
use virtual_board::scenario::trace::TraceRow;

use super::page::{self, RunSummary};
use super::rows::{self, ChartRows};

/// The files of a run. The trace is written during the run.
pub struct RunReport {
    directory: PathBuf,
    trace: NewFile,
    charts: ChartRows,
}

/// The address of `file` on a page in `folder`; nothing for a file that is not there, or whose name is not text.
fn address(folder: &Path, file: &Path) -> Option<String> {
    let (folder, file) = (folder.canonicalize().ok()?, file.canonicalize().ok()?);
    let common = folder
        .components()
        .zip(file.components())
        .take_while(|(a, b)| a == b)
        .count();
    let up = "../".repeat(folder.components().count() - common);
    let down: PathBuf = file.components().skip(common).collect();
    let mut address = up;
    for byte in down.to_str()?.bytes() {
        match byte {
            b'\\' => address.push('/'),
            b'a'..=b'z' | b'A'..=b'Z' | b'0'..=b'9' | b'-' | b'_' | b'.' | b'~' | b'/' => {
                address.push(char::from(byte));
            }
            _ => _ = write!(address, "%{byte:02X}"),
        }
    }
    Some(address)
}

impl RunReport {
    /// The address of `file` on the page.
    pub fn address(&self, file: &Path) -> Option<String> {
        address(&self.directory, file)
    }

    /// Begins the files in `directory`, and creates the directory if needed.
    ///
    /// # Errors
    /// [`CommandError::Input`] with the file that cannot be written.
    pub fn create(directory: PathBuf) -> Result<Self, CommandError> {
        create_directory(&directory)?;
        let mut trace = NewFile::replace("--out", &directory.join("trace.csv"))?;
        rows::write_header(&mut trace)?;
        Ok(Self {
            directory,
            trace,
            charts: ChartRows::default(),
        })
    }

    /// Takes the next row of the run.
    ///
    /// # Errors
    /// The operating system's error.
    pub fn add(&mut self, row: &TraceRow) -> Result<(), CommandError> {
        self.charts.add(row);
        Ok(rows::write_row(&mut self.trace, row)?)
    }

    /// Completes the files; returns their directory.
    ///
    /// # Errors
    /// [`CommandError`]: a file or a chart cannot be written.
    pub fn finish(self, summary: &RunSummary<'_>) -> Result<PathBuf, CommandError> {
        let out = self.directory;
        self.trace.finish()?;
        for (name, chart) in page::drawn(summary, &self.charts.trace) {
            let svg = chart.to_svg().map_err(CommandError::Other)?;
            write_file(&out, &format!("{name}.svg"), &svg)?;
        }
        write_file(&out, "firmware.log", &(summary.log.join("\n") + "\n"))?;
        let page = page::page(summary, &self.charts).map_err(CommandError::Other)?;
        write_file(&out, "index.html", &page)?;
        Ok(out)
    }
}
