//! Files of records: the link's own frames, an identity first, then blocks of records; alone, or in an MCAP file.

use std::path::Path;

use firmware::drive_board::SCALES;
use firmware::protocol::message::PROTOCOL_VERSION;
use model::vehicle::Vehicle;
use report::error::CommandError;
use virtual_board::records::RecordFile;

mod mcap_reader;
mod mcap_writer;
mod messages;
pub mod run;
pub mod writer;

/// Largest file that is read: an hour's drive has about 100 MB, as MCAP 600 MB.
const FILE_MAX_BYTES: u64 = 1 << 30;

/// What was read from a file.
#[derive(Debug)]
pub struct ReadRecords {
    /// The records.
    pub file: RecordFile,
    /// The vehicle in force when they were recorded, if the file says so.
    pub vehicle: Option<Vehicle<f64>>,
}

/// Reads a file, also one that breaks off.
///
/// # Errors
/// [`CommandError::Input`]: the file cannot be read, is too large, has nothing readable in it, or is of another
/// protocol.
pub fn read(path: &Path) -> Result<ReadRecords, CommandError> {
    let wrong = |why: &dyn std::fmt::Display| CommandError::Input(format!("{}: {why}", path.display()));
    let length = std::fs::metadata(path).map_err(|error| wrong(&error))?.len();
    if length > FILE_MAX_BYTES {
        return Err(wrong(&format!(
            "{length} bytes, more than the {FILE_MAX_BYTES} of any drive"
        )));
    }
    let bytes = std::fs::read(path).map_err(|error| wrong(&error))?;
    let contents = mcap_reader::contents(&bytes);
    let (frames, vehicle) = match &contents {
        Some(contents) => (&contents.frames[..], contents.vehicle.as_deref()),
        None => (&bytes[..], None),
    };
    let file = RecordFile::parse(frames);
    if let Some(identity) = file.identity.filter(|identity| identity.protocol != PROTOCOL_VERSION) {
        return Err(wrong(&format!(
            "records of protocol {}, this tool reads {PROTOCOL_VERSION}",
            identity.protocol
        )));
    }
    if file.records.is_empty() {
        return Err(match contents.and_then(|contents| contents.compression) {
            Some(compression) => wrong(&format!(
                "its chunks are compressed with {compression}, which this tool does not read; `mcap decompress` makes a \
                 file that it reads"
            )),
            None => wrong(&"no records in it; `hil-sim drive --record` and `hil-sim link record` write such files"),
        });
    }
    let vehicle = vehicle
        .map(|text| {
            let name = format!("{}, its vehicle", path.display());
            vehicle_file::parse_vehicle_for(&name, text, &SCALES.sensor_ranges())
        })
        .transpose()
        .map_err(|error| CommandError::Input(error.to_string()))?;
    Ok(ReadRecords { file, vehicle })
}

#[cfg(test)]
mod tests;
