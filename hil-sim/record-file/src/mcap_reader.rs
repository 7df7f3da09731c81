//! Reads records from an MCAP file, also from a truncated or damaged file.
//!
//! The library's readers drop the chunk in which a file breaks off. This reader returns every whole message of that
//! chunk. The library decodes the MCAP records.

use mcap::MAGIC;
use mcap::parse_record;
use mcap::records::{Record, op};

use crate::log_line::LogLine;
use crate::mcap_writer::{FRAMES_TOPIC, VEHICLE_KEY, VEHICLE_METADATA};
use crate::messages::{LogMessage, TypedChannel};

/// Bytes of a record before its body: kind and length.
const HEAD: usize = 1 + 8;
/// Bytes of an uncompressed chunk before its records: start time, end time, length, checksum, the compression's empty
/// name, length.
const CHUNK_HEAD: usize = 8 + 8 + 8 + 4 + 4 + 8;

/// The contents of a drive's MCAP file.
#[derive(Debug, Default)]
pub struct McapContents {
    /// The link's own frames, one after the other.
    pub frames: Vec<u8>,
    /// The text of the vehicle file of the set in force, for each boot that has one.
    pub vehicles: Vec<AmongFrames<String>>,
    /// The board's log.
    pub log: Vec<AmongFrames<LogLine>>,
    /// Compression of the chunks, if any. Records in compressed chunks are not read.
    pub compression: Option<String>,
}

/// An item between the frames.
#[derive(Debug, PartialEq, Eq)]
pub struct AmongFrames<T> {
    /// Number of bytes of the frames before the item.
    pub frames_before: usize,
    /// The item.
    pub what: T,
}

/// The contents of a file up to its end or to where it breaks off. `None` if the file is not MCAP.
pub fn contents(bytes: &[u8]) -> Option<McapContents> {
    let mut contents = McapContents::default();
    let mut channels = KnownChannels::default();
    contents.read(bytes.strip_prefix(MAGIC)?, &mut channels, false);
    Some(contents)
}

/// Numbers of the channels to read, once the file has declared them.
#[derive(Debug, Default)]
struct KnownChannels {
    frames: Option<u16>,
    log: Option<u16>,
}

impl McapContents {
    /// Reads records one after the other.
    fn read(&mut self, mut rest: &[u8], channels: &mut KnownChannels, in_chunk: bool) {
        while let Some((head, after)) = rest.split_first_chunk::<HEAD>() {
            let [kind, length @ ..] = *head;
            let length = usize::try_from(u64::from_le_bytes(length)).unwrap_or(usize::MAX);
            let (body, next) = after.split_at(length.min(after.len()));
            rest = next;
            match kind {
                op::CHUNK if !in_chunk => self.read_chunk(body, channels),
                // The last record of a truncated file.
                _ if body.len() < length => {}
                op::CHANNEL | op::MESSAGE | op::METADATA => match parse_record(kind, body) {
                    Ok(Record::Channel(found)) if found.topic == FRAMES_TOPIC => channels.frames = Some(found.id),
                    Ok(Record::Channel(found)) if found.topic == TypedChannel::Log.topic() => {
                        channels.log = Some(found.id);
                    }
                    Ok(Record::Message { header, data }) if Some(header.channel_id) == channels.frames => {
                        self.frames.extend_from_slice(&data);
                    }
                    Ok(Record::Message { header, data }) if Some(header.channel_id) == channels.log => {
                        let message = serde_json::from_slice::<LogMessage>(&data);
                        let line = message.ok().map(LogLine::from);
                        self.log.extend(line.map(|line| told(&self.frames, line)));
                    }
                    Ok(Record::Metadata(mut found)) if found.name == VEHICLE_METADATA => {
                        let text = found.metadata.remove(VEHICLE_KEY);
                        self.vehicles.extend(text.map(|text| told(&self.frames, text)));
                    }
                    // Not needed here, or damaged.
                    _ => {}
                },
                _ => {}
            }
        }
    }

    fn read_chunk(&mut self, body: &[u8], channels: &mut KnownChannels) {
        if let Ok(Record::Chunk { header, .. }) = parse_record(op::CHUNK, body)
            && !header.compression.is_empty()
        {
            self.compression = Some(header.compression);
        } else if let Some(records) = body.get(CHUNK_HEAD..) {
            self.read(records, channels, true);
        }
    }
}

fn told<T>(frames: &[u8], what: T) -> AmongFrames<T> {
    AmongFrames {
        frames_before: frames.len(),
        what,
    }
}
