use std::path::Path;

use firmware::events::{Event, Line, LogBlock};
use firmware::flight_record::FlightRecord;
use firmware::protocol::message::Identity;
use model::supervise::arming::Mode;
use model::vehicle::Vehicle;

use super::log_line::LogLevel;
use super::mcap_reader::contents;
use super::run::write_run;
use super::writer::{RecordFormat, RecordWriter};
use super::*;

fn vehicle() -> Vehicle<f32> {
    let vehicle = vehicle_file::reference().expect("good");
    Vehicle::new(vehicle.parameters().cast::<f32>()).expect("good")
}

/// A log with a line before the first tick, one of trouble in between, and one at the end.
fn log() -> Vec<LogLine> {
    [
        (0, LogLevel::Info),
        (1_000_500, LogLevel::Warning),
        (1_999_000, LogLevel::Error),
    ]
    .into_iter()
    .map(|(time_us, level)| LogLine {
        time_us,
        level,
        text: format!("line of {time_us}"),
    })
    .collect()
}

fn file(format: RecordFormat) -> (Vec<FlightRecord>, Vec<u8>) {
    let records: Vec<FlightRecord> = (1..2000_u32)
        .map(|tick| {
            let mut record = FlightRecord::NONE;
            record.tick = tick;
            record.sample.time_us = u64::from(tick) * 1000;
            record.sample.encoder_counts[0] = i64::from(tick * tick % 977);
            record
        })
        .collect();
    let out = RecordWriter::new(format, Vec::new());
    let bytes = write_run(out, &vehicle(), None, &records, &log()).expect("fits");
    (records, bytes)
}

#[test]
fn records_come_back_and_what_is_missing_is_counted() {
    let (records, bytes) = file(RecordFormat::Frames);
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

/// However far a file got, the records up to there come back: every whole frame of them.
#[test]
fn a_cut_mcap_file_is_read_as_far_as_it_goes() {
    let (records, bytes) = file(RecordFormat::Mcap);
    let whole = contents(&bytes).expect("MCAP");
    assert_eq!(RecordFile::parse(&whole.frames).records, records);
    assert_eq!(
        whole.vehicle,
        Some(vehicle_file::to_toml(vehicle().parameters())),
        "the vehicle goes with the records"
    );
    assert_eq!(whole.log, log());
    // Where the frames begin and end in the file: each is there once its last byte is.
    let mut ends = Vec::new();
    let mut from = 0;
    for frame in whole.frames.split_inclusive(|byte| *byte == 0) {
        let found = bytes[from..].windows(frame.len()).position(|at| at == frame);
        from += found.expect("as written") + frame.len();
        ends.push((from, frame.len()));
    }
    // Some bytes a record, 480 a block.
    assert!(ends.len() > 10, "{}", ends.len());
    for cut in (0..bytes.len()).step_by(997).chain(bytes.len() - 40..bytes.len()) {
        let Some(read) = contents(&bytes[..cut]) else {
            assert!(cut < mcap::MAGIC.len());
            continue;
        };
        let length: usize = ends
            .iter()
            .take_while(|(end, _)| *end <= cut)
            .map(|(_, length)| length)
            .sum();
        assert_eq!(read.frames, whole.frames[..length], "cut at {cut}");
        assert!(whole.log.starts_with(&read.log), "cut at {cut}");
    }
}

/// Whatever a byte becomes, reading ends, and what comes back is what was recorded.
#[test]
fn a_spoilt_mcap_file_ends_and_invents_nothing() {
    let (records, bytes) = file(RecordFormat::Mcap);
    for at in (8..bytes.len()).step_by(613) {
        let mut spoilt = bytes.clone();
        spoilt[at] ^= 0xFF;
        let read = RecordFile::parse(&contents(&spoilt).expect("MCAP").frames).records;
        assert!(
            read.iter().all(|record| records[record.tick as usize - 1] == *record),
            "{at}"
        );
    }
}

/// The library's own reader agrees: every message in a whole file, and the index over them.
#[test]
fn the_reader_of_the_library_finds_every_message() {
    let (_, bytes) = file(RecordFormat::Mcap);
    let messages: Vec<_> = mcap::MessageStream::new(&bytes)
        .expect("MCAP")
        .map(|message| message.expect("good"))
        .collect();
    let count = |topic: &str| messages.iter().filter(|message| message.channel.topic == topic).count();
    assert_eq!((count("/status"), count("/terms")), (199, 199));
    assert!(count("/records") > 10);
    assert_eq!(count("/log"), log().len());
    // In the order of their times, but for what has no time of its own: blocks, whose first tick counts.
    let times: Vec<u64> = messages.iter().map(|message| message.log_time).collect();
    let log_times = messages
        .iter()
        .enumerate()
        .filter(|(_, message)| message.channel.topic == "/log");
    for (n, message) in log_times {
        let status_before = messages[..n]
            .iter()
            .rev()
            .find(|message| message.channel.topic == "/status");
        assert!(
            status_before.is_none_or(|status| status.log_time <= message.log_time),
            "{times:?}"
        );
    }
    let status = messages.iter().filter(|message| message.channel.topic == "/status");
    for (n, message) in (1_u64..).zip(status) {
        let status: serde_json::Value = serde_json::from_slice(&message.data).expect("JSON");
        assert_eq!(status["tick"], n * 10);
        assert_eq!(message.log_time, n * 10_000_000);
    }
    let summary = mcap::Summary::read(&bytes).expect("good").expect("there");
    let counted = summary.stats.expect("there").message_count;
    assert_eq!(counted, messages.len() as u64);
    // Half a second each; before them the channels, and the identity, each of which metadata ends.
    assert_eq!(summary.chunk_indexes.len(), 2 + 4);
}

#[test]
fn a_name_says_what_kind_of_file_it_is() {
    for (name, format) in [
        ("run.mcap", RecordFormat::Mcap),
        ("RUN.MCAP", RecordFormat::Mcap),
        ("run.records", RecordFormat::Frames),
        ("mcap", RecordFormat::Frames),
    ] {
        assert_eq!(RecordFormat::of(Path::new(name)), format, "{name}");
    }
}

/// Lines of the log with these times, us, the first of which has this number.
fn block(first: u32, times_us: impl IntoIterator<Item = u64>) -> LogBlock {
    let event = Event::Mode(Mode::Armed);
    LogBlock {
        first,
        lines: times_us.into_iter().map(|time_us| Line { time_us, event }).collect(),
    }
}

/// The log in a file of frames: each line once, whatever was asked twice, and that of the next boot behind it.
#[test]
fn a_log_that_came_over_the_link_is_in_a_file_of_frames() {
    let identity = Identity {
        protocol: PROTOCOL_VERSION,
        nonce: 0,
        session: 1,
        sequence: 0,
        time_us: 0,
        about: firmware::link::about(vehicle().parameters(), 0),
    };
    let mut out = RecordWriter::new(RecordFormat::Frames, Vec::new());
    for _ in 0..2 {
        out.identity(&identity).expect("fits");
        for block in [block(0, [10, 20]), block(1, [20, 30]), block(3, [])] {
            out.log_block(&block).expect("fits");
        }
    }
    let frames = out.finish().expect("written");
    let times: Vec<u64> = RecordFile::parse(&frames).log.iter().map(|line| line.time_us).collect();
    assert_eq!(times, [10, 20, 30, 10, 20, 30]);
    // The same conversation as MCAP has each line as often as the board told it.
    let mcap = conversation::write_mcap(&frames, None, Vec::new()).expect("written");
    let log = contents(&mcap).expect("MCAP").log;
    assert_eq!(log.len(), 8);
    assert!(
        log.iter()
            .all(|line| line.text == "armed" && line.level == LogLevel::Info),
        "{log:?}"
    );
}

#[test]
fn a_printed_line_has_time_level_and_words() {
    let line = LogLine::printed("  1.250000 WARN  arm IMU: no samples, restarting");
    let expected = LogLine {
        time_us: 1_250_000,
        level: LogLevel::Warning,
        text: "arm IMU: no samples, restarting".to_owned(),
    };
    assert_eq!(line, expected);
}
