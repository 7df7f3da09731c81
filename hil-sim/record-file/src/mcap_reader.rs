//! Records out of an MCAP file, also out of one that breaks off or has spoilt bytes in it.
//!
//! The library's readers drop the chunk in which a file breaks off; here every whole message in it counts. What a
//! record of MCAP means the library says.

use mcap::MAGIC;
use mcap::parse_record;
use mcap::records::{Record, op};

use crate::log_line::LogLine;
use crate::mcap_writer::{FRAMES_TOPIC, VEHICLE_KEY, VEHICLE_METADATA};
use crate::messages::{LogMessage, TypedChannel};

/// Bytes of a record before its body: its kind and its length.
const HEAD: usize = 1 + 8;
/// Bytes of a chunk before the records in it, if they are not compressed: begin, end, length, checksum, the compression's
/// empty name, length.
const CHUNK_HEAD: usize = 8 + 8 + 8 + 4 + 4 + 8;

/// What an MCAP file holds of a drive.
#[derive(Debug, Default)]
pub struct McapContents {
    /// The link's own frames, one after the other.
    pub frames: Vec<u8>,
    /// The text of the vehicle file of the set in force, for each boot that has one.
    pub vehicles: Vec<AmongFrames<String>>,
    /// The board's log.
    pub log: Vec<AmongFrames<LogLine>>,
    /// How the chunks are compressed, where they are: no record in them is read.
    pub compression: Option<String>,
}

/// Something that stands among the frames.
#[derive(Debug, PartialEq, Eq)]
pub struct AmongFrames<T> {
    /// Bytes of the frames before it.
    pub frames_before: usize,
    /// What is told.
    pub what: T,
}

/// The contents of a file, as far as it goes; `None` if it is no MCAP file.
pub fn contents(bytes: &[u8]) -> Option<McapContents> {
    let mut contents = McapContents::default();
    let mut channels = KnownChannels::default();
    contents.read(bytes.strip_prefix(MAGIC)?, &mut channels, false);
    Some(contents)
}

/// The numbers of the channels that are read, once they are known.
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
                // The last record of a file that breaks off.
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
                    // Of no concern here, or spoilt.
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
