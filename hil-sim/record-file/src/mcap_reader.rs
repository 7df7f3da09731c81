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
    if let ChunkCoding::Compressed(by) = each_record(bytes, |record| contents.take(record, &mut channels))? {
        contents.compression = Some(by);
    }
    Some(contents)
}

/// Numbers of the channels to read, once the file has declared them.
#[derive(Debug, Default)]
struct KnownChannels {
    frames: Option<u16>,
    log: Option<u16>,
}

impl McapContents {
    /// Takes the next record of the file.
    fn take(&mut self, record: Record<'_>, channels: &mut KnownChannels) {
        match record {
            Record::Channel(found) if found.topic == FRAMES_TOPIC => channels.frames = Some(found.id),
            Record::Channel(found) if found.topic == TypedChannel::Log.topic() => channels.log = Some(found.id),
            Record::Message { header, data } if Some(header.channel_id) == channels.frames => {
                self.frames.extend_from_slice(&data);
            }
            Record::Message { header, data } if Some(header.channel_id) == channels.log => {
                let message = serde_json::from_slice::<LogMessage>(&data);
                let line = message.ok().map(LogLine::from);
                self.log.extend(line.map(|line| told(&self.frames, line)));
            }
            Record::Metadata(mut found) if found.name == VEHICLE_METADATA => {
                let text = found.metadata.remove(VEHICLE_KEY);
                self.vehicles.extend(text.map(|text| told(&self.frames, text)));
            }
            // Not needed here.
            _ => {}
        }
    }
}

/// Coding of a file's chunks.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum ChunkCoding {
    /// The records themselves.
    Plain,
    /// By this compression: such chunks are not read.
    Compressed(String),
}

/// Passes every whole schema, channel, message and metadata of a file to `visit`, in order, up to the file's end or to where
/// it breaks off; `None` if the file is not MCAP.
pub fn each_record(bytes: &[u8], mut visit: impl FnMut(Record<'_>)) -> Option<ChunkCoding> {
    let mut coding = ChunkCoding::Plain;
    let records = bytes.strip_prefix(MAGIC)?;
    each_of(records, &mut |kind, body, is_whole| match kind {
        op::CHUNK => {
            if let Ok(Record::Chunk { header, .. }) = parse_record(op::CHUNK, body)
                && !header.compression.is_empty()
            {
                coding = ChunkCoding::Compressed(header.compression);
            } else if let Some(records) = body.get(CHUNK_HEAD..) {
                each_of(records, &mut |kind, body, is_whole| {
                    parsed(kind, body, is_whole, &mut visit);
                });
            }
        }
        _ => parsed(kind, body, is_whole, &mut visit),
    });
    Some(coding)
}

/// Passes kind and body of each record to `visit`, and whether it is whole: the last record of a truncated file is not.
fn each_of(mut rest: &[u8], visit: &mut dyn FnMut(u8, &[u8], bool)) {
    while let Some((head, after)) = rest.split_first_chunk::<HEAD>() {
        let [kind, length @ ..] = *head;
        let length = usize::try_from(u64::from_le_bytes(length)).unwrap_or(usize::MAX);
        let (body, next) = after.split_at(length.min(after.len()));
        rest = next;
        visit(kind, body, body.len() == length);
    }
}

/// Passes a whole record to `visit`, unless it is damaged.
fn parsed(kind: u8, body: &[u8], is_whole: bool, visit: &mut impl FnMut(Record<'_>)) {
    if is_whole
        && matches!(kind, op::SCHEMA | op::CHANNEL | op::MESSAGE | op::METADATA)
        && let Ok(record) = parse_record(kind, body)
    {
        visit(record);
    }
}

fn told<T>(frames: &[u8], what: T) -> AmongFrames<T> {
    AmongFrames {
        frames_before: frames.len(),
        what,
    }
}
