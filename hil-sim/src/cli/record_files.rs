//! Files of records in the file system.

use std::path::Path;

use record_file::writer::RecordFormat;
use record_file::{ReadRecords, parse};
use report::error::CommandError;

/// Largest file that is read, bytes. An hour's drive has about 100 MB, as MCAP 600 MB.
const FILE_MAX_BYTES: u64 = 1 << 30;

/// What a user can do with an MCAP file that was cut off before its end.
pub const REPAIR_MCAP: &str =
    "`hil-sim replay FILE --repair NEW.mcap`, on a disk with room, rewrites it with its missing index";

/// What a user can do with the record at `path` if it was cut off before its end.
pub fn if_cut(path: &Path) -> &'static str {
    match RecordFormat::of(path) {
        RecordFormat::Mcap => REPAIR_MCAP,
        RecordFormat::Frames => "",
    }
}

/// Reads a file, also a truncated file.
///
/// # Errors
/// [`CommandError::Input`]: the file cannot be read, is too large, contains nothing readable, or uses another
/// protocol version.
pub fn read(path: &Path) -> Result<ReadRecords, CommandError> {
    parse(&bytes(path)?).map_err(|error| CommandError::Input(format!("{}: {error}", path.display())))
}

/// The bytes of a file of records.
///
/// # Errors
/// [`CommandError::Input`]: the file cannot be read, or is too large.
pub fn bytes(path: &Path) -> Result<Vec<u8>, CommandError> {
    vehicle_file::read_bytes(path, FILE_MAX_BYTES)
        .map_err(|why| CommandError::Input(format!("{}: {why}", path.display())))
}
