//! How a file ends: by a full disk, by a cut, and with every channel.

use std::io::{self, Write};

use super::*;
use crate::mcap_repair::repair;
use crate::mcap_writer::McapWriter;
use crate::messages::TypedChannel;
use crate::run::{Narrator, RunWriter};

/// An output that tells once that it is full, and then takes what completes the file.
#[derive(Default)]
struct FullOnce {
    bytes: Vec<u8>,
    told: bool,
}

impl Write for FullOnce {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.bytes.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        if self.told || self.bytes.len() < 100_000 {
            return Ok(());
        }
        self.told = true;
        Err(io::ErrorKind::StorageFull.into())
    }
}

/// A full disk with room for the file's end: the file has its index, every tick up to the last, and no gap.
#[test]
fn a_record_that_a_full_disk_ends_is_whole() {
    let (records, _) = file(RecordFormat::Mcap);
    let out = RecordWriter::new(RecordFormat::Mcap, FullOnce::default());
    let mut writer = RunWriter::begin(out, &vehicle(), None, Narrator::Statuses).expect("begins");
    let written = records
        .iter()
        .take_while(|record| writer.record(record).is_ok())
        .count();
    assert!(written < records.len(), "it is never full");
    let bytes = writer.finish().expect("there is room for its end").bytes;
    let summary = mcap::Summary::read(&bytes).expect("good").expect("an index");
    let messages = mcap::MessageStream::new(&bytes)
        .expect("MCAP")
        .map(|message| message.expect("good"));
    assert_eq!(summary.stats.expect("there").message_count, messages.count() as u64);
    let read = RecordFile::parse(&contents(&bytes).expect("MCAP").frames);
    assert_eq!((read.lost_blocks, all(&read).len()), (0, written + 1));
}

/// Wherever a file breaks off, its repaired copy has an index, and every message that the cut file has.
#[test]
fn a_repaired_file_has_an_index_of_all_that_was_whole() {
    let (_, bytes) = file(RecordFormat::Mcap);
    for cut in (8..bytes.len()).step_by(30_011).chain([bytes.len()]) {
        let (copy, messages) = repair(&bytes[..cut], Vec::new()).expect("written").expect("MCAP");
        let summary = mcap::Summary::read(&copy).expect("good").expect("an index");
        assert_eq!(summary.stats.expect("there").message_count, messages, "cut at {cut}");
        let [was, is] = [&bytes[..cut], &copy].map(|bytes| contents(bytes).expect("MCAP"));
        assert_eq!(
            (was.frames, was.log, was.vehicles),
            (is.frames, is.log, is.vehicles),
            "cut at {cut}"
        );
    }
    assert!(repair(b"no MCAP", Vec::new()).expect("written").is_none());
}

/// The message at which the full disk is told is in the file, too.
#[test]
fn the_message_that_finds_the_disk_full_is_kept() {
    let mut writer = McapWriter::new(FullOnce::default());
    let given = (0..1000)
        .take_while(|n| writer.frame(n * 100_000, &[7; 1000]).is_ok())
        .count() as u64;
    assert!(given < 1000, "it is never full");
    let bytes = writer.finish().expect("there is room for its end").bytes;
    let summary = mcap::Summary::read(&bytes).expect("good").expect("an index");
    assert_eq!(summary.stats.expect("there").message_count, given + 1);
}

/// Every channel is in a file, with its schema, whether or not it has a message.
#[test]
fn a_record_without_an_event_has_the_channel_of_events() {
    let mut out = RecordWriter::new(RecordFormat::Mcap, Vec::new());
    out.identity(&identity(0)).expect("fits");
    let bytes = out.finish().expect("written");
    let summary = mcap::Summary::read(&bytes).expect("good").expect("there");
    for channel in TypedChannel::ALL {
        let found = summary.channels.values().find(|found| found.topic == channel.topic());
        let schema = found.and_then(|found| found.schema.as_ref());
        assert_eq!(schema.map(|schema| schema.name.as_str()), Some(channel.schema_name()));
    }
    assert_eq!(summary.stats.expect("there").message_count, 1);
}
