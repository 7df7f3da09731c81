//! Files of records: the link's own frames, an identity first, then blocks of records.

use std::path::Path;

use firmware::flight_record::FlightRecord;
use firmware::protocol::message::{BoardMessage, Identity, PROTOCOL_VERSION};
use firmware::records::codec::{BlockEncoder, RecordBlock};
use model::vehicle::Vehicle;
use report::error::CommandError;
use virtual_board::records::RecordFile;

use super::link::memory::write_frame;

/// Largest file that is read: an hour's drive has about 100 MB.
const FILE_MAX_BYTES: u64 = 1 << 30;

/// Reads a file, also one that breaks off.
///
/// # Errors
/// [`CommandError::Input`]: the file cannot be read, is too large, has nothing readable in it, or is of another
/// protocol.
pub fn read(path: &Path) -> Result<RecordFile, CommandError> {
    let wrong = |why: &dyn std::fmt::Display| CommandError::Input(format!("{}: {why}", path.display()));
    let length = std::fs::metadata(path).map_err(|error| wrong(&error))?.len();
    if length > FILE_MAX_BYTES {
        return Err(wrong(&format!(
            "{length} bytes, more than the {FILE_MAX_BYTES} of any drive"
        )));
    }
    let bytes = std::fs::read(path).map_err(|error| wrong(&error))?;
    let file = RecordFile::parse(&bytes);
    if let Some(identity) = file.identity.filter(|identity| identity.protocol != PROTOCOL_VERSION) {
        return Err(wrong(&format!(
            "records of protocol {}, this tool reads {PROTOCOL_VERSION}",
            identity.protocol
        )));
    }
    if file.records.is_empty() {
        return Err(wrong(
            &"no records in it; `hil-sim drive --record` and `hil-sim link record` write such files",
        ));
    }
    Ok(file)
}

/// The bytes of a file with the `records` of a board that was built for `vehicle`.
///
/// # Errors
/// [`CommandError::Other`]: a message fits no frame.
pub fn record_bytes(vehicle: &Vehicle<f32>, records: &[FlightRecord]) -> Result<Vec<u8>, CommandError> {
    let identity = Identity {
        protocol: PROTOCOL_VERSION,
        nonce: 0,
        session: 1,
        sequence: 0,
        time_us: 0,
        about: firmware::link::about(vehicle.parameters(), 0),
    };
    let mut messages = vec![BoardMessage::Identity(identity)];
    let mut take = |block: &RecordBlock| messages.push(BoardMessage::Records(block.clone()));
    let mut encoder = BlockEncoder::new();
    for record in records {
        encoder.push(record, &mut take);
    }
    encoder.flush(&mut take);
    let mut bytes = Vec::new();
    for message in &messages {
        write_frame(message, &mut bytes)?;
    }
    Ok(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn file() -> (Vec<FlightRecord>, Vec<u8>) {
        let vehicle = vehicle_file::reference().expect("good");
        let vehicle = Vehicle::new(vehicle.parameters().cast::<f32>()).expect("good");
        let records: Vec<FlightRecord> = (1..2000_u32)
            .map(|tick| {
                let mut record = FlightRecord::NONE;
                record.tick = tick;
                record.sample.time_us = u64::from(tick) * 1000;
                record.sample.encoder_counts[0] = i64::from(tick * tick % 977);
                record
            })
            .collect();
        let bytes = record_bytes(&vehicle, &records).expect("fits");
        (records, bytes)
    }

    #[test]
    fn records_come_back_and_what_is_missing_is_counted() {
        let (records, bytes) = file();
        let read = RecordFile::parse(&bytes);
        assert_eq!((read.lost_blocks, read.unreadable), (0, 0));
        assert_eq!(read.records, records);
        assert!(read.identity.is_some());
        // Cut off in the middle, as by a full disk: what was written before is there.
        let cut = RecordFile::parse(&bytes[..bytes.len() / 2]);
        assert!(cut.records.len() > 500 && records.starts_with(&cut.records));
        // A byte that fell over costs its block, and the next block tells so.
        let mut spoilt = bytes.clone();
        let middle = bytes.len() / 2;
        spoilt[middle] ^= 0x55;
        let spoilt = RecordFile::parse(&spoilt);
        assert!(spoilt.unreadable + spoilt.lost_blocks > 0 && spoilt.records.len() < records.len());
        assert!(RecordFile::parse(b"no records at all").records.is_empty());
    }
}
