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
/// Bytes of a chunk before the name of its compression: start time, end time, length, checksum. The records' length follows the
/// name.
const CHUNK_HEAD: usize = 8 + 8 + 8 + 4;
/// Bytes of the length of a text, or of a list of texts, before it; and of the length of a chunk's records.
const LENGTH: usize = 4;
const RECORDS_LENGTH: usize = 8;

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
    /// Whether the file has its end.
    pub ends: bool,
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
    let mut contents = McapContents {
        ends: bytes.len() >= 2 * MAGIC.len() && bytes.ends_with(MAGIC),
        ..McapContents::default()
    };
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
            let Some((name, records)) = body.get(CHUNK_HEAD..).and_then(text) else {
                return;
            };
            if !name.is_empty() {
                coding = ChunkCoding::Compressed(String::from_utf8_lossy(name).into_owned());
            } else if let Some(records) = records.get(RECORDS_LENGTH..) {
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
        && texts_fit(kind, body)
        && let Ok(record) = parse_record(kind, body)
    {
        visit(record);
    }
}

/// The text at the start of `bytes` and what follows it; `None` if its length exceeds what there is.
fn text(bytes: &[u8]) -> Option<(&[u8], &[u8])> {
    let (length, rest) = bytes.split_first_chunk::<LENGTH>()?;
    rest.split_at_checked(usize::try_from(u32::from_le_bytes(*length)).ok()?)
}

/// Whether the texts of a record lie within its body. The library reserves memory for a text before it looks at what there is, so
/// that a damaged length would ask for gigabytes.
fn texts_fit(kind: u8, body: &[u8]) -> bool {
    // Numbers before the first text, and texts one after the other; the last text of a channel and of metadata is a list of texts.
    let (numbers, texts, lists) = match kind {
        op::SCHEMA => (2, 3, false),
        op::CHANNEL => (4, 3, true),
        op::METADATA => (0, 2, true),
        _ => return true,
    };
    let mut rest = body.get(numbers..);
    let mut last: &[u8] = &[];
    for _ in 0..texts {
        (last, rest) = match rest.and_then(text) {
            Some((found, after)) => (found, Some(after)),
            None => return false,
        };
    }
    while lists && !last.is_empty() {
        match text(last) {
            Some((_, after)) => last = after,
            None => return false,
        }
    }
    true
}

fn told<T>(frames: &[u8], what: T) -> AmongFrames<T> {
    AmongFrames {
        frames_before: frames.len(),
        what,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The record's body: its numbers, then its texts, each with its length before it.
    fn body(numbers: usize, texts: &[&[u8]]) -> Vec<u8> {
        let mut body = vec![1; numbers];
        for text in texts {
            body.extend((text.len() as u32).to_le_bytes());
            body.extend_from_slice(text);
        }
        body
    }

    /// A record passes as it was written. With a larger length of any of its texts it does not: nobody reserves memory for it.
    #[test]
    fn a_text_beyond_its_record_is_refused() {
        let list = body(0, &[b"key", b"value"]);
        let metadata = body(0, &[b"name", &list]);
        let channel = body(4, &[b"/topic", b"json", &list]);
        let schema = body(2, &[b"name", b"jsonschema", b"{}"]);
        // Where the lengths of each record are.
        let records = [
            (op::METADATA, metadata, vec![0, 8, 12, 19]),
            (op::CHANNEL, channel, vec![4, 14, 22, 26, 33]),
            (op::SCHEMA, schema, vec![2, 10, 24]),
        ];
        for (kind, sound, lengths) in records {
            assert!(texts_fit(kind, &sound), "{kind}");
            assert!(parse_record(kind, &sound).is_ok(), "{kind}");
            for at in lengths {
                for wrong in [0xE000_0000_u32, u32::MAX, sound.len() as u32] {
                    let mut damaged = sound.clone();
                    damaged[at..][..LENGTH].copy_from_slice(&wrong.to_le_bytes());
                    assert!(!texts_fit(kind, &damaged), "{kind}: {wrong} at {at}");
                }
            }
        }
    }

    #[test]
    fn a_chunk_with_a_damaged_name_is_left_out() {
        for length in [0xE000_0000_u32, u32::MAX] {
            let mut file = MAGIC.to_vec();
            let mut chunk = vec![0; CHUNK_HEAD];
            chunk.extend(length.to_le_bytes());
            chunk.extend([0; 100]);
            file.push(op::CHUNK);
            file.extend((chunk.len() as u64).to_le_bytes());
            file.extend(chunk);
            let mut records = 0;
            assert_eq!(each_record(&file, |_| records += 1), Some(ChunkCoding::Plain));
            assert_eq!(records, 0);
        }
    }
}
