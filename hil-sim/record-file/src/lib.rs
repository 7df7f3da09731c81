//! Records of drives as files: the link's own frames, an identity first, then blocks of records; alone, or in an MCAP file.
//!
//! Bytes in memory and writers of any kind: no file of a file system, so that this package compiles for
//! `wasm32-unknown-unknown` too and the console's page writes what the tool writes.
#![forbid(unsafe_code)]

use firmware::drive_board::SCALES;
use firmware::protocol::message::PROTOCOL_VERSION;
use model::vehicle::Vehicle;
use thiserror::Error;
use virtual_board::records::RecordFile;

pub mod conversation;
pub mod log_line;
mod mcap_reader;
mod mcap_writer;
mod messages;
pub mod run;
pub mod writer;

use log_line::LogLine;

/// What was read from a file.
#[derive(Debug)]
pub struct ReadRecords {
    /// The records.
    pub file: RecordFile,
    /// The vehicle in force when they were recorded, if the file says so.
    pub vehicle: Option<Vehicle<f64>>,
    /// The board's log, as far as the file has it, in order.
    pub log: Vec<LogLine>,
}

/// Why a file has no records for this program.
#[derive(Debug, Error)]
pub enum ReadError {
    /// Another protocol's: nothing in it is taken for what it is not.
    #[error("records of protocol {0}, this tool reads {PROTOCOL_VERSION}")]
    Protocol(u16),
    /// An MCAP file that was compressed after it was written.
    #[error(
        "its chunks are compressed with {0}, which this tool does not read; `mcap decompress` makes a file that it reads"
    )]
    Compressed(String),
    /// Nothing readable in it.
    #[error("no records in it; `hil-sim drive --record` and `hil-sim link record` write such files")]
    NoRecords,
    /// The vehicle in it is none.
    #[error("its vehicle: {0}")]
    Vehicle(String),
}

/// Reads the bytes of a file of either kind, also of one that breaks off.
///
/// # Errors
/// [`ReadError`].
pub fn parse(bytes: &[u8]) -> Result<ReadRecords, ReadError> {
    let contents = mcap_reader::contents(bytes);
    let frames = contents.as_ref().map_or(bytes, |contents| &contents.frames);
    let file = RecordFile::parse(frames);
    if let Some(identity) = file.identity.filter(|identity| identity.protocol != PROTOCOL_VERSION) {
        return Err(ReadError::Protocol(identity.protocol));
    }
    let lines = file.log.iter().map(LogLine::of).collect();
    let (vehicle, log, compression) = match contents {
        Some(contents) => (contents.vehicle, contents.log, contents.compression),
        None => (None, lines, None),
    };
    if file.records.is_empty() {
        return Err(compression.map_or(ReadError::NoRecords, ReadError::Compressed));
    }
    let vehicle = vehicle
        .map(|text| vehicle_file::parse_vehicle_for("vehicle.toml", &text, &SCALES.sensor_ranges()))
        .transpose()
        .map_err(|error| ReadError::Vehicle(error.to_string()))?;
    Ok(ReadRecords { file, vehicle, log })
}

#[cfg(test)]
mod tests;
