//! Files that grow while the board speaks, and keep what they have when the board falls silent.

use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::Path;

use report::error::CommandError;
use report::files::existing;

use crate::cli::record_file::writer::{RecordFormat, RecordWriter};

/// Records into a file that must not exist yet. A recording that ended early is completed as far as it got.
///
/// # Errors
/// As [`into_new_file`].
pub fn into_new_record<R>(
    flag: &str,
    path: &Path,
    record: impl FnOnce(&mut RecordWriter<&mut BufWriter<File>>) -> Result<R, CommandError>,
) -> Result<R, CommandError> {
    into_new_file(flag, path, |out| {
        let mut writer = RecordWriter::new(RecordFormat::of(path), out);
        let recorded = record(&mut writer);
        let finished = writer.finish();
        let recorded = recorded?;
        finished?;
        Ok(recorded)
    })
}

/// Writes into a file that must not exist yet, and makes sure that it is there. What was written before the board fell
/// silent stays; a file into which nothing was written does not, so that the command can be given again.
///
/// # Errors
/// [`CommandError::Input`]: there is such a file, or it cannot be written; [`CommandError::Other`]: the disk is full; what
/// `write` says.
pub fn into_new_file<R>(
    flag: &str,
    path: &Path,
    write: impl FnOnce(&mut BufWriter<File>) -> Result<R, CommandError>,
) -> Result<R, CommandError> {
    let file = File::create_new(path).map_err(|error| match error.kind() {
        io::ErrorKind::AlreadyExists => existing(flag, path),
        _ => CommandError::Input(format!("{flag}: cannot write {}: {error}", path.display())),
    })?;
    let mut out = BufWriter::new(file);
    let written = write(&mut out);
    let flushed = out.flush().and_then(|()| out.get_ref().sync_all());
    let empty = out.get_ref().metadata().is_ok_and(|file| file.len() == 0);
    if written.is_err() && empty {
        // The command's own failure is what is told.
        let _ = std::fs::remove_file(path);
    }
    flushed.map_err(|error| CommandError::Other(format!("output: {error}")))?;
    written
}
