//! Records of drives as files: the link's own frames (an identity first, then blocks of records),
//! alone or in an MCAP file.
//!
//! This package works on bytes in memory and on any writer. It opens no file, so it also compiles for
//! `wasm32-unknown-unknown`, and the console's page writes the same files as the tool.
#![forbid(unsafe_code)]

use firmware::drive_board::SCALES;
use firmware::flight_record::FlightRecord;
use firmware::protocol::message::{Identity, PROTOCOL_VERSION};
use model::vehicle::Vehicle;
use thiserror::Error;
use virtual_board::records::{BootRecords, RecordFile};

pub mod conversation;
pub mod log_line;
mod mcap_reader;
pub mod mcap_repair;
mod mcap_writer;
mod messages;
pub mod replay;
pub mod run;
pub mod writer;

use log_line::LogLine;

/// The contents of a file.
#[derive(Debug, Default)]
pub struct ReadRecords {
    /// The boots of the board, in the order in which they were recorded.
    pub boots: Vec<ReadBoot>,
    /// Number of missing blocks, counted from the gaps in the blocks' numbers.
    pub lost_blocks: u32,
    /// Number of frames and blocks that could not be read.
    pub unreadable: u32,
    /// Whether the file has its end, as far as its kind shows: an MCAP file that a killed tool or a full disk has left has none.
    pub ends: bool,
}

/// What was recorded between one boot of the board and the next.
#[derive(Debug)]
pub struct ReadBoot {
    /// The board that made the records, if the file says so.
    pub identity: Option<Identity>,
    /// The vehicle in force, if the file contains it: the vehicle of this boot, else of the previous
    /// or the next boot.
    pub vehicle: Option<Vehicle<f64>>,
    /// The records in order, each tick once.
    pub records: Vec<FlightRecord>,
    /// The lines of the board's log that the file contains, in order.
    pub log: Vec<LogLine>,
}

impl ReadRecords {
    /// The records of every boot, one after the other.
    pub fn records(&self) -> impl Iterator<Item = &FlightRecord> {
        self.boots.iter().flat_map(|boot| &boot.records)
    }

    /// The log of every boot, one after the other.
    pub fn log(&self) -> impl Iterator<Item = &LogLine> {
        self.boots.iter().flat_map(|boot| &boot.log)
    }
}

/// Why this program cannot read a file's records.
#[derive(Debug, Error)]
pub enum ReadError {
    /// The records belong to another protocol version. The reader does not guess their meaning.
    #[error("records of protocol {0}, this tool reads {PROTOCOL_VERSION}")]
    Protocol(u16),
    /// An MCAP file that was compressed after it was written.
    #[error(
        "its chunks are compressed with {0}, which this tool does not read; `mcap decompress` makes a file that it reads"
    )]
    Compressed(String),
    /// Nothing in the file can be read.
    #[error("no records in it; `hil-sim drive --record` and `hil-sim link record` write such files")]
    NoRecords,
    /// The file's vehicle is not valid.
    #[error("its vehicle: {0}")]
    Vehicle(String),
}

/// Reads the bytes of a file of either kind, also of a truncated file.
///
/// # Errors
/// [`ReadError`].
pub fn parse(bytes: &[u8]) -> Result<ReadRecords, ReadError> {
    let contents = mcap_reader::contents(bytes);
    let frames = contents.as_ref().map_or(bytes, |contents| &contents.frames);
    let ends = contents.as_ref().is_none_or(|contents| contents.ends);
    let file = RecordFile::parse(frames);
    let identities = file.boots.iter().filter_map(|boot| boot.identity);
    if let Some(identity) = { identities }.find(|identity| identity.protocol != PROTOCOL_VERSION) {
        return Err(ReadError::Protocol(identity.protocol));
    }
    if file.records().next().is_none() {
        let compression = contents.and_then(|contents| contents.compression);
        return Err(compression.map_or(ReadError::NoRecords, ReadError::Compressed));
    }
    let RecordFile {
        boots,
        lost_blocks,
        unreadable,
    } = file;
    let starts: Vec<usize> = boots.iter().map(|boot| boot.start).collect();
    let mut read: Vec<ReadBoot> = boots.into_iter().map(ReadBoot::from).collect();
    if let Some(contents) = contents {
        // Everything that the board sent after a boot's first frame belongs to that boot.
        let boot_of = |frames_before: usize| starts.partition_point(|start| *start < frames_before).saturating_sub(1);
        for told in contents.log {
            read[boot_of(told.frames_before)].log.push(told.what);
        }
        for told in contents.vehicles {
            read[boot_of(told.frames_before)].vehicle = Some(vehicle(&told.what)?);
        }
        let mut known = read.iter().find_map(|boot| boot.vehicle);
        for boot in &mut read {
            known = boot.vehicle.or(known);
            boot.vehicle = known;
        }
    }
    Ok(ReadRecords {
        boots: read,
        lost_blocks,
        unreadable,
        ends,
    })
}

impl From<BootRecords> for ReadBoot {
    fn from(boot: BootRecords) -> Self {
        Self {
            identity: boot.identity,
            vehicle: None,
            records: boot.records,
            log: boot.log.iter().map(LogLine::of).collect(),
        }
    }
}

fn vehicle(text: &str) -> Result<Vehicle<f64>, ReadError> {
    vehicle_file::parse_vehicle_for("vehicle.toml", text, &SCALES.sensor_ranges())
        .map_err(|error| ReadError::Vehicle(error.to_string()))
}

#[cfg(test)]
mod tests;
