//! Files of records in the file system.

use std::path::Path;

use record_file::{ReadRecords, parse};
use report::error::CommandError;

/// Largest file that is read, bytes. An hour's drive has about 100 MB, as MCAP 600 MB.
const FILE_MAX_BYTES: u64 = 1 << 30;

/// Reads a file, also a truncated file.
///
/// # Errors
/// [`CommandError::Input`]: the file cannot be read, is too large, contains nothing readable, or uses another
/// protocol version.
pub fn read(path: &Path) -> Result<ReadRecords, CommandError> {
    let wrong = |why: &dyn std::fmt::Display| CommandError::Input(format!("{}: {why}", path.display()));
    let length = std::fs::metadata(path).map_err(|error| wrong(&error))?.len();
    if length > FILE_MAX_BYTES {
        return Err(wrong(&format!(
            "{length} bytes, more than the {FILE_MAX_BYTES} of any drive"
        )));
    }
    let bytes = std::fs::read(path).map_err(|error| wrong(&error))?;
    parse(&bytes).map_err(|error| wrong(&error))
}
