//! The record of every tick over the link: the stream, which replays bit for bit, and the look back after a fault.

use std::collections::BTreeSet;

use firmware::drive_board::SCALES;
use firmware::fault_list::FaultEntry;
use firmware::flight_record::FlightRecord;
use firmware::protocol::frame::{Decoder, Received};
use firmware::protocol::message::{Answer, BoardMessage, Order, Read, Reading};
use firmware::records::codec::{RecordBlock, Records};
use hil_sim::cli::link::console::Console;
use model::command::Request;
use model::supervise::arming::Mode;
use model::supervise::codes::Fault;
use model::tick::VehicleCore;
use model::vehicle::Vehicle;
use record_file::writer::{RecordFormat, RecordWriter};
use virtual_board::board::flash::VirtualFlash;

mod support;
#[path = "support/wires.rs"]
mod wires;
use support::Bench;
use wires::{BoardWire, Scripted, link, ready};

/// The records of these blocks.
fn records(blocks: &[RecordBlock]) -> Vec<FlightRecord> {
    blocks
        .iter()
        .flat_map(|block| Records::new(&block.bytes))
        .map(|record| record.expect("readable"))
        .collect()
}

#[test]
fn the_stream_of_records_replays_bit_for_bit_and_leaves_room_for_the_status() {
    let mut bench = Bench::new(37);
    bench.run(50);
    assert_eq!(bench.ask(Order::Recording { from: Some(0) }), Some(Answer::Done));
    bench.run(850);
    bench.request(Request::Arm);
    bench.drive = Some([0.0, 0.0]);
    bench.run(100);
    bench.drive = Some([1.0, 0.4]);
    let before = bench.client.bytes;
    let mut statuses = 0;
    bench.run_watching(4000, |bench| {
        statuses += u32::from(bench.client.status.take().is_some());
    });
    assert_eq!(bench.mode(), Mode::Armed);
    let bytes = bench.client.bytes - before;
    let blocks: Vec<RecordBlock> = std::mem::take(&mut bench.client.records).into();
    let numbers: Vec<u32> = blocks.iter().map(|block| block.number).collect();
    assert_eq!(
        numbers,
        (0..numbers.len() as u32).collect::<Vec<u32>>(),
        "blocks are lost"
    );
    let records = records(&blocks);
    let stream: usize = blocks.iter().map(|block| block.bytes.len()).sum();
    println!(
        "{} ticks, {:.1} bytes per tick; the line carried {:.1} bytes per ms",
        records.len(),
        stream as f64 / records.len() as f64,
        bytes as f64 / 4000.0
    );
    assert!(records.len() > 4900 && records[0].tick == 1);
    assert!(stream < 45 * records.len(), "{} bytes per tick", stream / records.len());
    // 921,600 baud are 92 bytes per ms.
    assert!(bytes < 4000 * 80, "{bytes}");
    assert!((395..=405).contains(&statuses), "{statuses}");
    let vehicle = Vehicle::new(support::reference().parameters().cast::<f32>()).expect("valid");
    let mut core = VehicleCore::new(&vehicle, &SCALES);
    for record in &records {
        let output = core.step(&record.sample, &record.command);
        assert_eq!(output.actuation, record.actuation, "tick {}", record.tick);
        assert_eq!(output.status.tick, record.tick);
    }
    assert!(records.iter().filter(|record| record.actuation.enable).count() > 4000);
}

#[test]
fn the_last_two_seconds_before_a_fault_can_be_read_afterwards() {
    let mut bench = Bench::driving(38, 1.0);
    bench.press_emergency_stop();
    bench.run(1000);
    let stopped = bench.board.status().expect("runs");
    assert!(stopped.faults.contains(Fault::EmergencyStop));
    let mut blocks: Vec<RecordBlock> = Vec::new();
    loop {
        let from = blocks.last().map_or(0, |block| block.number + 1);
        let sequence = bench.order(Order::Read(Read::LookBack { from }));
        bench.run(20);
        let Some(Reading::LookBack { frozen, block }) = bench.client.reading_of(sequence) else {
            panic!("no answer")
        };
        assert!(frozen);
        match block {
            Some(block) => blocks.push(block),
            None => break,
        }
    }
    let records = records(&blocks);
    let pressed = records
        .iter()
        .position(|record| record.sample.emergency_stop)
        .expect("in the look back");
    assert!(pressed >= 2000, "{pressed} ticks before the fault");
    assert!(
        (195..=205).contains(&(records.len() - pressed)),
        "{}",
        records.len() - pressed
    );
    assert!(records.windows(2).all(|pair| pair[1].tick == pair[0].tick + 1));
    assert!(records[pressed - 1].actuation.enable && !records[pressed].actuation.enable);
}

/// A file of frames.
fn frames() -> RecordWriter<Vec<u8>> {
    RecordWriter::new(RecordFormat::Frames, Vec::new())
}

/// The messages of a file of frames.
fn messages(bytes: &[u8]) -> Vec<BoardMessage> {
    let mut decoder = Decoder::new();
    bytes
        .iter()
        .filter_map(|byte| match decoder.push(*byte) {
            Received::Nothing => None,
            Received::Message(message) => Some(message),
            other => panic!("{other:?}"),
        })
        .collect()
}

#[test]
fn the_tool_writes_the_stream_as_the_frames_that_brought_it() {
    let (mut link, _) = link(BoardWire::new(ready(39)));
    link.identify().expect("answers");
    let mut file = frames();
    let recorded = link.record(2.0, &mut file).expect("records");
    let file = file.finish().expect("written");
    assert_eq!(recorded.lost, 0);
    // The board has run for 1 s and still holds all records of that second.
    assert!((2900..=3100).contains(&recorded.ticks), "{recorded:?}");
    let messages = messages(&file);
    assert!(matches!(messages[0], BoardMessage::Identity(_)));
    let blocks = messages
        .iter()
        .filter(|message| matches!(message, BoardMessage::Records(_)));
    assert_eq!(blocks.count() as u32, recorded.blocks);
    let BoardMessage::Records(first) = &messages[1] else {
        panic!("{:?}", messages[1])
    };
    assert_eq!(first.number, 0);
    // The file also has the log from the boot on, which `replay` writes into an MCAP file.
    let log: Vec<String> = record_file::parse(&file)
        .expect("readable")
        .log()
        .map(|line| line.text.clone())
        .collect();
    for part in ["booted, reset by power-on", "gyros calibrated"] {
        assert_eq!(log.iter().filter(|line| *line == part).count(), 1, "{part}: {log:?}");
    }
    // Without a fault there is no look back.
    assert_eq!(link.look_back(&mut frames()).expect_err("none").exit_code(), 1);
}

/// An MCAP file contains the board's identity, parameters, status, terms, log and events in addition to the same
/// records.
#[test]
fn the_tool_records_everything_for_other_tools_too() {
    let mut bench = ready(39);
    bench.request(Request::Arm);
    bench.run(100);
    let (mut link, _) = link(BoardWire::new(bench));
    link.identify().expect("answers");
    let mut out = RecordWriter::new(RecordFormat::Mcap, Vec::new());
    let recorded = link.record(2.0, &mut out).expect("records");
    let bytes = out.finish().expect("written");
    let messages: Vec<mcap::Message<'_>> = mcap::MessageStream::new(&bytes)
        .expect("MCAP")
        .map(|message| message.expect("readable"))
        .collect();
    let of = |topic: &'static str| messages.iter().filter(move |message| message.channel.topic == topic);
    let json =
        |message: &mcap::Message<'_>| -> serde_json::Value { serde_json::from_slice(&message.data).expect("JSON") };
    // The identity and each block, and a status every 10 ms except while the tool reads the parameters.
    assert_eq!(of("/records").count() as u32, recorded.blocks + 1);
    let statuses = of("/status").count();
    assert!((100..=200).contains(&statuses), "{statuses}");
    assert_eq!(of("/terms").count(), statuses);
    let first = json(of("/status").next().expect("there"));
    assert!(first["battery_v"].as_f64().expect("a number") > 20.0, "{first}");
    let log: Vec<String> = of("/log").map(|message| json(message)["message"].to_string()).collect();
    for part in ["booted, reset by power-on", "gyros calibrated", "armed", "disarmed"] {
        let count = log.iter().filter(|line| line.contains(part)).count();
        assert!(count > 0, "{part}: {log:?}");
    }
    let lines: BTreeSet<(u64, &[u8])> = of("/log")
        .map(|message| (message.log_time, &message.data[..]))
        .collect();
    assert_eq!(lines.len(), log.len(), "a line comes twice: {log:?}");
    assert!(
        of("/events").any(|message| json(message)["kind"] == "mode"),
        "the vehicle disarms by itself"
    );
    // The reader returns the records, with the parameters in force.
    let path = std::path::Path::new(env!("CARGO_TARGET_TMPDIR")).join("link.mcap");
    std::fs::write(&path, &bytes).expect("writes");
    let read = hil_sim::cli::record_files::read(&path).expect("readable");
    assert_eq!(read.records().count() as u64, recorded.ticks);
    assert_eq!(read.boots[0].records[0].tick, 1);
    let vehicle = read.boots[0].vehicle.expect("in the file").parameters().cast::<f32>();
    assert_eq!(vehicle, support::reference().parameters().cast::<f32>());
}

#[test]
fn the_tool_shows_the_boards_log() {
    let mut bench = ready(40);
    bench.request(Request::Arm);
    bench.run(500);
    bench.press_emergency_stop();
    bench.run(500);
    bench.request(Request::Arm);
    bench.run(500);
    let (mut link, _) = link(BoardWire::new(bench));
    link.identify().expect("answers");
    let mut console = Console(Vec::new());
    link.show_log(&mut console).expect("answers");
    let text = String::from_utf8(console.0).expect("text");
    let mut lines = text.lines();
    for part in [
        "booted, reset by power-on",
        "gyros calibrated",
        " armed",
        "fault 0: EmergencyStop",
        " disarmed",
        "not armed: blocked by FaultLatched, EmergencyStop",
    ] {
        assert!(lines.any(|line| line.contains(part)), "no {part} in this order: {text}");
    }
    assert!(
        text.contains("arm IMU: started") && text.contains("spar IMU: started"),
        "{text}"
    );
    let recorded = link.look_back(&mut frames()).expect("a fault");
    // From boot to 0.2 s after the fault.
    assert!((1690..=1710).contains(&recorded.ticks), "{recorded:?}");
}

#[test]
fn a_flood_of_questions_about_the_memory_holds_up_no_status_and_no_tick() {
    let mut bench = Bench::driving(63, 1.0);
    let before = bench.board.status().expect("runs");
    let (mut statuses, mut asked, mut read, mut bytes) = (0, 0, 0, bench.client.bytes);
    let mut waiting: Vec<u32> = Vec::new();
    bench.run_watching(1000, |bench| {
        for question in [Read::Log { from: 0 }, Read::Faults { from: 0 }].repeat(4) {
            asked += 1;
            waiting.push(bench.order(Order::Read(question)));
        }
        statuses += u32::from(bench.client.status.take().is_some());
        waiting.retain(|sequence| {
            let answered = bench.client.reading_of(*sequence).is_some();
            read += u64::from(answered);
            !answered && bench.client.answer_to(*sequence).is_none()
        });
    });
    bytes = bench.client.bytes - bytes;
    assert!((99..=101).contains(&statuses), "{statuses}");
    let after = bench.board.status().expect("runs");
    assert_eq!(after.mode, Mode::Armed);
    assert_eq!(after.late_ticks, before.late_ticks);
    assert_eq!(after.tick, before.tick + 1000);
    assert!(read > 1000 && read <= asked, "{read} of {asked}");
    // At most one frame per question, and the statuses.
    assert!(bytes <= 512 * (asked + 101), "{bytes}");
}

/// Every fault that the board remembers.
fn faults(bench: &mut Bench) -> Vec<FaultEntry> {
    let mut entries: Vec<FaultEntry> = Vec::new();
    loop {
        let from = entries.last().map_or(0, |entry| entry.number + 1);
        let sequence = bench.order(Order::Read(Read::Faults { from }));
        bench.run(20);
        match bench.client.reading_of(sequence) {
            Some(Reading::Faults(block)) if block.is_empty() => return entries,
            Some(Reading::Faults(block)) => entries.extend(block),
            other => panic!("{other:?}"),
        }
    }
}

/// Boots, arms, presses the emergency stop `ms` milliseconds later, and returns the boot's number and the faults that the board
/// remembers.
fn run_with_a_fault(seed: u64, history: &VirtualFlash, ms: u64) -> (u32, Vec<FaultEntry>) {
    let mut bench = Bench::with_history(seed, VirtualFlash::erased(), history.clone());
    bench.run(1000);
    bench.request(Request::Arm);
    bench.run(ms);
    assert_eq!(bench.mode(), Mode::Armed);
    bench.press_emergency_stop();
    bench.run(100);
    let boot = bench.client.identity().expect("identified").about.boot;
    (boot, faults(&mut bench))
}

#[test]
fn the_tool_shows_time_mode_and_cause_of_every_fault() {
    let history = VirtualFlash::erased();
    let (before, _) = run_with_a_fault(64, &history, 40);
    let mut bench = Bench::with_history(65, VirtualFlash::erased(), history);
    bench.run(500);
    let (mut link, _) = link(BoardWire::new(bench));
    link.identify().expect("answers");
    let mut console = Console(Vec::new());
    link.show_faults(&mut console).expect("answers");
    let text = String::from_utf8(console.0).expect("text");
    let lines: Vec<&str> = text.lines().collect();
    assert_eq!(lines.len(), 2, "{text}");
    for (line, cause) in lines.iter().zip(["fault 0: EmergencyStop", "fault 1: BridgeBreak"]) {
        assert!(
            line.contains(&format!("an earlier boot {before:08x}, 1.0")) && line.contains(&format!(", armed: {cause}")),
            "{line}"
        );
    }
}

#[test]
fn a_board_that_answers_the_same_for_ever_is_told_strange() {
    let fault = FaultEntry {
        number: 5,
        boot: 1,
        time_us: 1,
        mode: Mode::Armed,
        fault: 0,
    };
    let (mut link, _) = link(Scripted::new(move |id, _| {
        let reading = Reading::Faults([fault].into_iter().collect());
        vec![(0, BoardMessage::Reading { id, reading })]
    }));
    link.identify().expect("answers");
    let error = link.show_faults(&mut Console(Vec::new())).expect_err("strange");
    assert!(error.to_string().contains("strange"), "{error}");
}

#[test]
fn the_last_32_faults_outlive_resets() {
    let history = VirtualFlash::erased();
    // An emergency stop latches two faults: the contact's and the break's.
    let (mut boots, mut entries) = (Vec::new(), Vec::new());
    for n in 0..18 {
        let (boot, remembered) = run_with_a_fault(41 + n, &history, 20 * (n + 1));
        boots.push(boot);
        entries = remembered;
        assert_eq!(entries.len(), 32.min(2 * (n as usize + 1)), "{entries:?}");
    }
    let numbers: Vec<u32> = entries.iter().map(|entry| entry.number).collect();
    assert_eq!(numbers, (4..36).collect::<Vec<u32>>());
    for pair in entries.chunks(2) {
        let n = u64::from(pair[0].number / 2);
        assert_eq!(pair[0].boot, boots[n as usize]);
        assert_eq!(pair[0].mode, Mode::Armed);
        assert_eq!(
            [pair[0].fault, pair[1].fault],
            [Fault::EmergencyStop as u8, Fault::BridgeBreak as u8]
        );
        let expected_us = 1_000_000 + 20_000 * (n + 1);
        assert!(pair[0].time_us.abs_diff(expected_us) <= 2_000, "{pair:?}");
    }
    // A reset without a fault keeps the history.
    let mut bench = Bench::with_history(60, VirtualFlash::erased(), history);
    bench.run(500);
    assert_eq!(faults(&mut bench), entries);
}

#[test]
fn a_history_that_cannot_be_read_costs_no_drive_and_begins_anew() {
    let history = VirtualFlash::erased();
    let mut noise = plant::noise::Noise::new(61, 1);
    let bytes: Vec<u8> = (0..256 * 1024).map(|_| noise.bits() as u8).collect();
    history.overwrite(&bytes);
    for n in 1..3 {
        let (_, entries) = run_with_a_fault(61, &history, 100);
        assert_eq!(entries.len(), 2 * n, "{entries:?}");
    }
}
