//! Files that grow while the board sends, and keep their content when the board falls silent.

use std::path::Path;

use record_file::writer::{RecordFormat, RecordWriter};
use report::error::CommandError;
use report::files::GrowingFile;

use crate::cli::record_files::if_cut;

/// Records into a file that must not exist yet. A recording that ended early is completed with what it has.
///
/// # Errors
/// As [`into_new_file`].
pub fn into_new_record<R>(
    flag: &'static str,
    path: &Path,
    record: impl FnOnce(&mut RecordWriter<&mut GrowingFile>) -> Result<R, CommandError>,
) -> Result<R, CommandError> {
    into(GrowingFile::create(flag, path)?.if_cut(if_cut(path)), |out| {
        let mut writer = RecordWriter::new(RecordFormat::of(path), out);
        let recorded = record(&mut writer);
        let finished = writer.finish();
        let recorded = recorded?;
        finished?;
        Ok(recorded)
    })
}

/// Writes into a file that must not exist yet, and flushes it to the disk. Everything written before the board fell
/// silent stays. An empty file is removed, so that the command can be repeated.
///
/// # Errors
/// [`CommandError::Input`]: the file exists or cannot be written; [`CommandError::Other`]: the disk is full; the
/// errors of `write`.
pub fn into_new_file<R>(
    flag: &'static str,
    path: &Path,
    write: impl FnOnce(&mut GrowingFile) -> Result<R, CommandError>,
) -> Result<R, CommandError> {
    into(GrowingFile::create(flag, path)?, write)
}

fn into<R>(
    mut file: GrowingFile,
    write: impl FnOnce(&mut GrowingFile) -> Result<R, CommandError>,
) -> Result<R, CommandError> {
    match write(&mut file) {
        Ok(written) => file.finish().map(|_| written),
        Err(error) => file.give_up().and(Err(error)),
    }
}
