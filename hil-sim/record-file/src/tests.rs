//! Files of records: whole, cut off, spoilt, and over several boots.

use std::path::Path;

use firmware::events::{Event, Line, LogBlock};
use firmware::flight_record::FlightRecord;
use model::supervise::arming::Mode;
use model::vehicle::Vehicle;

use super::log_line::LogLevel;
use super::mcap_reader::contents;
use super::run::write_run;
use super::writer::{RecordFormat, RecordWriter};
use super::*;

#[path = "../../../tests/support/identities.rs"]
mod identities;
use identities::identity;

#[path = "tests/ends.rs"]
mod ends;

fn vehicle() -> Vehicle<f32> {
    let vehicle = vehicle_file::reference().expect("good");
    Vehicle::new(vehicle.parameters().cast::<f32>()).expect("good")
}

/// A log with a line before the first tick, a warning in between, and a line at the end.
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
    let boot = ReadBoot {
        identity: None,
        vehicle: None,
        records: records.clone(),
        log: log(),
    };
    let bytes = write_run(out, &[vehicle()], &[boot]).expect("fits");
    (records, bytes)
}

fn all(file: &RecordFile) -> Vec<FlightRecord> {
    file.records().copied().collect()
}

#[test]
fn records_come_back_and_what_is_missing_is_counted() {
    let (records, bytes) = file(RecordFormat::Frames);
    let read = RecordFile::parse(&bytes);
    assert_eq!((read.lost_blocks, read.unreadable), (0, 0));
    assert_eq!(all(&read), records);
    assert!(read.boots[0].identity.is_some());
    // The file is cut off in the middle, as by a full disk. Everything written before is present.
    let cut = RecordFile::parse(&bytes[..bytes.len() / 2]);
    assert!(all(&cut).len() > 500 && records.starts_with(&all(&cut)));
    // A changed byte costs its block, and the next block's number shows the loss.
    let mut spoilt = bytes.clone();
    let middle = bytes.len() / 2;
    spoilt[middle] ^= 0x55;
    let spoilt = RecordFile::parse(&spoilt);
    assert!(spoilt.unreadable + spoilt.lost_blocks > 0 && all(&spoilt).len() < records.len());
    assert!(all(&RecordFile::parse(b"no records at all")).is_empty());
}

/// Wherever a file is cut off, the reader returns every whole frame before the cut.
#[test]
fn a_cut_mcap_file_is_read_as_far_as_it_goes() {
    let (records, bytes) = file(RecordFormat::Mcap);
    let whole = contents(&bytes).expect("MCAP");
    assert_eq!(all(&RecordFile::parse(&whole.frames)), records);
    // The reader tells whether the file has its end.
    assert!(parse(&bytes).expect("records").ends);
    assert!(!parse(&bytes[..bytes.len() / 2]).expect("records").ends);
    assert!(!parse(&bytes[..bytes.len() - 1]).expect("records").ends);
    assert_eq!(
        whole.vehicles.iter().map(|told| &told.what).collect::<Vec<_>>(),
        [&vehicle_file::to_toml(vehicle().parameters())],
        "the file lacks the vehicle"
    );
    assert_eq!(
        whole.log.iter().map(|told| told.what.clone()).collect::<Vec<_>>(),
        log()
    );
    // Ends of the frames in the file: a frame is present once its last byte is present.
    let mut ends = Vec::new();
    let mut from = 0;
    for frame in whole.frames.split_inclusive(|byte| *byte == 0) {
        let found = bytes[from..].windows(frame.len()).position(|at| at == frame);
        from += found.expect("as written") + frame.len();
        ends.push((from, frame.len()));
    }
    // A few bytes per record, 480 per block.
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

/// With any byte changed, reading ends, and the reader returns only records that were written.
#[test]
fn a_spoilt_mcap_file_ends_and_invents_nothing() {
    let (records, bytes) = file(RecordFormat::Mcap);
    for at in (8..bytes.len()).step_by(613) {
        let mut spoilt = bytes.clone();
        spoilt[at] ^= 0xFF;
        let read = all(&RecordFile::parse(&contents(&spoilt).expect("MCAP").frames));
        assert!(
            read.iter().all(|record| records[record.tick as usize - 1] == *record),
            "{at}"
        );
    }
}

/// The library's own reader agrees on every message of a whole file, and on the file's index.
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
    // Messages are in the order of their times, except blocks, which have the time of their first tick.
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
    // Each chunk has half a second. Before them come the channels and the identity, each ended by metadata.
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

/// Lines of the log at these times, us; the first line has this number.
fn block(first: u32, times_us: impl IntoIterator<Item = u64>) -> LogBlock {
    let event = Event::Mode(Mode::Armed);
    LogBlock {
        first,
        lines: times_us.into_iter().map(|time_us| Line { time_us, event }).collect(),
    }
}

/// The log in a file of frames: each line once, even if it was requested twice, followed by the log of the next boot.
#[test]
fn a_log_that_came_over_the_link_is_in_a_file_of_frames() {
    let mut out = RecordWriter::new(RecordFormat::Frames, Vec::new());
    for boot in 0..2 {
        out.identity(&identity(boot)).expect("fits");
        for block in [block(0, [10, 20]), block(1, [20, 30]), block(3, [])] {
            out.log_block(&block).expect("fits");
        }
    }
    let frames = out.finish().expect("written");
    let read = RecordFile::parse(&frames);
    let times: Vec<u64> = { read.boots.iter() }
        .flat_map(|boot| &boot.log)
        .map(|line| line.time_us)
        .collect();
    assert_eq!(times, [10, 20, 30, 10, 20, 30]);
    // As MCAP, the same conversation has each line as often as the board sent it.
    let mcap = conversation::write_mcap(&frames, None, Vec::new()).expect("written");
    let log = contents(&mcap).expect("MCAP").log;
    assert_eq!(log.len(), 8);
    assert!(
        log.iter()
            .map(|told| &told.what)
            .all(|line| line.text == "armed" && line.level == LogLevel::Info),
        "{log:?}"
    );
}

/// A boot of the board with these ticks, and a log line at the end of each second.
fn boot(number: u32, ticks: u32) -> ReadBoot {
    let records = (1..=ticks).map(|tick| {
        let mut record = FlightRecord::NONE;
        record.tick = tick;
        record.sample.time_us = u64::from(tick) * 1000;
        record
    });
    let line = |s: u32| LogLine {
        time_us: u64::from(s) * 1_000_000,
        level: LogLevel::Info,
        text: format!("boot {number}, {s} s"),
    };
    ReadBoot {
        identity: Some(identity(number)),
        vehicle: None,
        records: records.collect(),
        log: (0..=ticks / 1000).map(line).collect(),
    }
}

/// Boots stay separate in either kind of file, each with its own records, vehicle and log. The times of an MCAP file
/// continue across boots.
#[test]
fn boots_stay_apart() {
    let told = [boot(7, 2500), boot(3, 1500), boot(9, 3000)];
    let other = vehicle_file::REFERENCE.replace("comfort_s = 0.2", "comfort_s = 0.4");
    let other = vehicle_file::parse_vehicle_for("other", &other, &SCALES.sensor_ranges()).expect("good");
    let other = Vehicle::new(other.parameters().cast::<f32>()).expect("good");
    for format in [RecordFormat::Frames, RecordFormat::Mcap] {
        let out = RecordWriter::new(format, Vec::new());
        let bytes = write_run(out, &[vehicle(), other], &told).expect("fits");
        let read = parse(&bytes).expect("readable");
        assert_eq!((read.lost_blocks, read.unreadable), (0, 0));
        assert_eq!(read.boots.len(), told.len());
        for (n, (read, told)) in read.boots.iter().zip(&told).enumerate() {
            assert_eq!(
                (read.identity, &read.records),
                (told.identity, &told.records),
                "{format:?}"
            );
            if format == RecordFormat::Mcap {
                assert_eq!(read.log, told.log);
                let parameters = read.vehicle.expect("told").parameters().cast::<f32>();
                let expected = if n == 0 { vehicle() } else { other };
                assert_eq!(parameters, *expected.parameters());
            }
        }
        if format == RecordFormat::Frames {
            continue;
        }
        // The file's clock runs 2.5 s, then 1.5 s, then 3 s, on every channel.
        let begins_s = [0.0, 2.5, 4.0, 7.0];
        let mut boots = Vec::new();
        for message in mcap::MessageStream::new(&bytes).expect("MCAP") {
            let message = message.expect("good");
            if message.channel.topic == "/log" {
                let line: serde_json::Value = serde_json::from_slice(&message.data).expect("JSON");
                let words = line["message"].as_str().expect("text");
                let second: f64 = words
                    .trim_end_matches(" s")
                    .rsplit(' ')
                    .next()
                    .expect("s")
                    .parse()
                    .expect("s");
                let boot = told
                    .iter()
                    .position(|boot| boot.log.iter().any(|line| line.text == words));
                let at_s = begins_s[boot.expect("told")] + second;
                assert_eq!(message.log_time, (at_s * 1e9) as u64, "{words}");
            }
            let at_s = message.log_time as f64 * 1e-9;
            boots.push(begins_s.iter().filter(|begin_s| at_s > **begin_s).count());
        }
        // Everything of one boot precedes everything of the next boot, in the file and in its time.
        assert!(boots.is_sorted(), "{boots:?}");
    }
}

/// If the identity between two boots is lost, a tick number that goes back shows the boot. If a board repeats its
/// identity in the same boot, repeated records count once.
#[test]
fn a_boot_is_told_from_a_board_that_speaks_again() {
    let frames = |boots: &[ReadBoot]| {
        let out = RecordWriter::new(RecordFormat::Frames, Vec::new());
        write_run(out, &[vehicle()], boots).expect("fits")
    };
    let [first, second] = [boot(1, 2000), boot(2, 1000)].map(|boot| frames(&[boot]));
    let without_identity = &second[second.iter().position(|byte| *byte == 0).expect("a frame") + 1..];
    let read = parse(&[&first, without_identity].concat()).expect("readable");
    let ticks: Vec<usize> = read.boots.iter().map(|boot| boot.records.len()).collect();
    assert_eq!((ticks, read.lost_blocks), (vec![2000, 1000], 0));

    let longer = frames(&[boot(1, 3000)]);
    let read = parse(&[first, longer].concat()).expect("readable");
    assert_eq!(read.boots.len(), 1);
    assert_eq!(
        (read.boots[0].records.clone(), read.lost_blocks),
        (boot(1, 3000).records, 0)
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
