//! Files that grow while the board speaks, and keep what they have when the board falls silent.

use std::path::Path;

use record_file::writer::{RecordFormat, RecordWriter};
use report::error::CommandError;
use report::files::GrowingFile;

/// Records into a file that must not exist yet. A recording that ended early is completed as far as it got.
///
/// # Errors
/// As [`into_new_file`].
pub fn into_new_record<R>(
    flag: &'static str,
    path: &Path,
    record: impl FnOnce(&mut RecordWriter<&mut GrowingFile>) -> Result<R, CommandError>,
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
    flag: &'static str,
    path: &Path,
    write: impl FnOnce(&mut GrowingFile) -> Result<R, CommandError>,
) -> Result<R, CommandError> {
    let mut file = GrowingFile::create(flag, path)?;
    match write(&mut file) {
        Ok(written) => file.finish().map(|_| written),
        Err(error) => file.give_up().and(Err(error)),
    }
}
