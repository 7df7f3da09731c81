//! The link tool's core on a wire in memory to the virtual board, which may fall silent. Time is virtual.

use std::cell::RefCell;
use std::io::{self, Write};
use std::path::Path;
use std::rc::Rc;
use std::sync::Arc;
use std::sync::atomic::{AtomicU32, Ordering};

use firmware::protocol::message::{Answer, HostMessage, Order, ParameterRequest};
use hil_sim::cli::link::console::Console;
use hil_sim::cli::link::drive::{DriveJob, check_seconds};
use hil_sim::cli::link::session::{Link, SILENCE_US};
use hil_sim::cli::link::status::StatusDetail;
use hil_sim::cli::link::wire::Wire;
use model::command::Request;
use record_file::writer::{RecordFormat, RecordWriter};
use report::error::CommandError;

mod support;
#[path = "support/wires.rs"]
mod wires;
use support::Bench;
use wires::{BoardWire, READ_US, link, messages, ready};

/// Identifies the board, drives, and returns what the tool printed.
fn drive<W: Wire>(link: &mut Link<W>, seconds: f64) -> Result<String, CommandError> {
    let mut console = Console(Vec::new());
    link.identify()?;
    link.drive(&DriveJob::new(0.5, 0.0, seconds)?, &mut console)?;
    Ok(String::from_utf8(console.0).expect("text"))
}

fn last_is_disarm(sent: &RefCell<Vec<u8>>) {
    let messages = messages(&sent.borrow());
    let last = messages
        .iter()
        .rev()
        .find(|message| !matches!(message, HostMessage::Identify { .. }));
    assert!(matches!(last, Some(HostMessage::Disarm(_))), "{last:?}");
}

#[test]
fn a_drive_ends_with_a_confirmed_disarm() {
    let wire = BoardWire::new(ready(1));
    let sent = wire.sent.clone();
    let (mut link, _) = link(wire);
    let shown = drive(&mut link, 4.0).expect("drives");
    assert!(shown.starts_with("armed: "), "{shown}");
    last_is_disarm(&sent);
}

/// The host's clock runs slower or faster than the board's, by as much as a served board's clock may and by as much as two crystals
/// differ. The tool follows the board's clock, and the board counts no order as late or as given in the future.
#[test]
fn a_board_at_another_rate_gets_no_order_late() {
    for board_rate in [0.3, 0.7, 0.97, 0.9999, 1.0001, 3.0] {
        let mut wire = BoardWire::new(ready(1));
        wire.host_rate = 1.0 / board_rate;
        let (mut link, _) = link(wire);
        let shown = drive(&mut link, 4.0).unwrap_or_else(|error| panic!("rate {board_rate}: {error}"));
        assert!(shown.lines().count() > 3, "rate {board_rate}: {shown}");
        for line in shown.lines() {
            // The line leaves out counters that are zero.
            let counted = line.split("; link: ").nth(1).expect("the link's counters");
            assert!(
                counted.contains(" frames") && !counted.contains("late") && !counted.contains("dropped"),
                "rate {board_rate}: {line}"
            );
        }
    }
}

#[test]
fn silence_is_told_at_once_wherever_it_begins() {
    for cut_at_us in [0, 60_000, 150_000, 1_000_000, 2_500_000, 4_900_000] {
        let mut wire = BoardWire::new(ready(2));
        wire.cut_at_us = cut_at_us;
        let sent = wire.sent.clone();
        let (mut link, _) = link(wire);
        let told = drive(&mut link, 4.0).expect_err("silent").to_string();
        assert!(told.contains("silent") || told.contains("no identity"), "{told}");
        if cut_at_us > 0 {
            last_is_disarm(&sent);
        }
    }
}

#[test]
fn silence_while_the_state_is_shown_is_told_within_300_ms() {
    let mut wire = BoardWire::new(ready(3));
    wire.cut_at_us = 1_000_000;
    let ended_us = Rc::new(RefCell::new(0));
    let seen = ended_us.clone();
    wire.world = Box::new(move |_, us| *seen.borrow_mut() = us);
    let (mut link, _) = link(wire);
    link.identify().expect("answers");
    let mut console = Console(Vec::new());
    let told = link.show(5.0, StatusDetail::Line, &mut console).expect_err("silent");
    assert_eq!(told.exit_code(), 1);
    let late_us = *ended_us.borrow() - 1_000_000;
    assert!(late_us <= SILENCE_US + READ_US, "{late_us} us after the last word");
    let lines = String::from_utf8(console.0).expect("text").lines().count();
    assert!((2..=3).contains(&lines), "{lines} states of one second");
}

#[test]
fn a_fault_is_told_within_300_ms_and_named() {
    for at_us in [1_500_000, 3_000_000, 4_700_000] {
        let ended_us = Rc::new(RefCell::new(0));
        let seen = ended_us.clone();
        let mut wire = BoardWire::new(ready(4));
        wire.world = Box::new(move |bench, us| {
            *seen.borrow_mut() = us;
            if us >= at_us {
                bench.press_emergency_stop();
            }
        });
        let sent = wire.sent.clone();
        let (mut link, _) = link(wire);
        let told = drive(&mut link, 4.0).expect_err("faulted").to_string();
        assert!(told.contains("EmergencyStop"), "{told}");
        assert!(*ended_us.borrow() - at_us < 300_000, "{}", *ended_us.borrow() - at_us);
        last_is_disarm(&sent);
    }
}

/// Something other than the tool ends the armed state: a fault that opens the bridges, a fault that stops, or the board's button.
#[test]
fn a_drive_that_something_else_ends_is_told_within_300_ms() {
    type End = fn(&mut Bench);
    let ends: [(&str, End); 3] = [
        ("disarmed, without a fault", |bench| bench.board.press_button()),
        ("by itself: BatteryHigh", |bench| {
            bench
                .board
                .world(|world| world.plant.battery_mut().open_circuit_v = 33.0);
        }),
        ("stopping by itself: BatteryLow", |bench| {
            bench
                .board
                .world(|world| world.plant.battery_mut().open_circuit_v = 18.0);
        }),
    ];
    for (seed, at_us) in [(14, 1_500_000), (24, 2_700_000)] {
        for (expected, end) in ends {
            let ended_us = Rc::new(RefCell::new(0));
            let seen = ended_us.clone();
            let mut wire = BoardWire::new(ready(seed));
            let mut done = false;
            wire.world = Box::new(move |bench, us| {
                *seen.borrow_mut() = us;
                if us >= at_us && !done {
                    done = true;
                    end(bench);
                }
            });
            let sent = wire.sent.clone();
            let (mut link, _) = link(wire);
            let told = drive(&mut link, 4.0).expect_err("ended").to_string();
            assert!(told.contains(expected), "{told}");
            // The board believes a supply out of bounds after its filter and 50 ms.
            assert!(
                *ended_us.borrow() - at_us < 300_000,
                "{expected}: {} us",
                *ended_us.borrow() - at_us
            );
            last_is_disarm(&sent);
        }
    }
}

#[test]
fn an_arm_that_is_refused_is_told_with_its_blockers() {
    let mut bench = ready(5);
    bench.board.world(|world| world.press_stop(true));
    let wire = BoardWire::new(bench);
    let sent = wire.sent.clone();
    let (mut link, _) = link(wire);
    let told = drive(&mut link, 4.0).expect_err("blocked").to_string();
    assert!(told.contains("blocked by EmergencyStop"), "{told}");
    last_is_disarm(&sent);
}

/// The board calibrates its gyros for half a second after the boot: a drive that is asked for earlier waits.
#[test]
fn a_drive_waits_for_gyros_that_are_being_calibrated() {
    let wire = BoardWire::new(Bench::new(5));
    let (mut link, _) = link(wire);
    let shown = drive(&mut link, 1.0).expect("drives");
    assert!(shown.starts_with("armed: "), "{shown}");
}

/// The disk is full while the vehicle drives: the tool stops the vehicle, disarms it, and prints the reason.
#[test]
fn a_record_that_takes_no_more_stops_the_vehicle() {
    struct Disk(usize);
    impl Write for Disk {
        fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
            self.0 = self.0.checked_sub(bytes.len()).ok_or(io::ErrorKind::StorageFull)?;
            Ok(bytes.len())
        }
        fn flush(&mut self) -> io::Result<()> {
            Ok(())
        }
    }
    let mut wire = BoardWire::new(ready(6));
    let speeds = Rc::new(RefCell::new(Vec::new()));
    let seen = speeds.clone();
    wire.world = Box::new(move |bench, us| {
        bench
            .board
            .world(|world| seen.borrow_mut().push((us, world.plant.truth().speed_m_s)));
    });
    let sent = wire.sent.clone();
    let (mut link, _) = link(wire);
    link.identify().expect("answers");
    let mut out = RecordWriter::new(RecordFormat::Frames, Disk(60_000));
    let job = DriveJob::new(0.5, 0.0, 60.0).expect("good");
    let told = link
        .drive_recorded(&job, &mut out, &mut Console(Vec::new()))
        .expect_err("full")
        .to_string();
    assert!(told.contains("storage"), "{told}");
    last_is_disarm(&sent);
    let speeds = speeds.borrow();
    assert!(
        speeds.iter().any(|(_, speed)| *speed > 0.4),
        "the vehicle did not drive"
    );
    let (ended_us, speed) = speeds.last().expect("some");
    assert!(
        *ended_us < 15_000_000 && speed.abs() < 0.05,
        "{ended_us} us, {speed} m/s"
    );
}

#[test]
fn a_wish_to_stop_stops_and_a_second_one_disarms_at_once() {
    for (second_us, clean) in [(u64::MAX, true), (1_600_000, false)] {
        let mut wire = BoardWire::new(ready(6));
        let count = Arc::new(AtomicU32::new(0));
        let raised = count.clone();
        wire.world = Box::new(move |_, us| {
            raised.store(u32::from(us > 1_500_000) + u32::from(us > second_us), Ordering::Relaxed);
        });
        let sent = wire.sent.clone();
        let mut link = Link::new(wire, 4711, count);
        let ended = drive(&mut link, 3000.0);
        assert_eq!(ended.is_ok(), clean, "{ended:?}");
        last_is_disarm(&sent);
    }
}

/// An output that accepts nothing.
struct Closed;

impl Write for Closed {
    fn write(&mut self, _: &[u8]) -> io::Result<usize> {
        Err(io::ErrorKind::BrokenPipe.into())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

#[test]
fn a_closed_output_is_an_error_after_the_disarm() {
    let wire = BoardWire::new(ready(7));
    let sent = wire.sent.clone();
    let (mut link, _) = link(wire);
    link.identify().expect("answers");
    let drive = DriveJob::new(0.5, 0.0, 1.0).expect("good");
    let told = link.drive(&drive, &mut Console(Closed)).expect_err("closed");
    assert_eq!(told.to_string(), "standard output: nobody reads it any more");
    last_is_disarm(&sent);
    assert!(link.show(1.0, StatusDetail::Line, &mut Console(Closed)).is_err());
}

#[test]
fn disarm_is_the_first_message_and_needs_no_answer() {
    for cut_at_us in [0, u64::MAX] {
        let mut bench = Bench::armed(8);
        bench.run(100);
        let mut wire = BoardWire::new(bench);
        wire.cut_at_us = cut_at_us;
        let sent = wire.sent.clone();
        let (mut link, _) = link(wire);
        let confirmed = link.disarm();
        assert_eq!(confirmed.is_ok(), cut_at_us > 0, "{confirmed:?}");
        let messages = messages(&sent.borrow());
        assert!(matches!(messages.first(), Some(HostMessage::Disarm(_))), "{messages:?}");
    }
}

#[test]
fn numbers_are_checked_before_anything_happens() {
    for (speed, yaw) in [
        (f32::NAN, 0.0),
        (f32::INFINITY, 0.0),
        (1e39_f64 as f32, 0.0),
        (-1e10, 0.0),
        (20.1, 0.0),
        (0.0, f32::NAN),
        (0.0, -20.1),
    ] {
        let refused = DriveJob::new(speed, yaw, 1.0).expect_err("no number to drive");
        assert_eq!(refused.exit_code(), 2, "{refused}");
    }
    for seconds in [f64::NAN, -1.0, 0.0, f64::INFINITY, 3600.1] {
        assert_eq!(check_seconds(seconds).expect_err("no time").exit_code(), 2, "{seconds}");
    }
    assert!(DriveJob::new(-20.0, 20.0, 3600.0).is_ok());
    // What the vehicle itself does not allow is refused before it arms.
    let wire = BoardWire::new(ready(9));
    let sent = wire.sent.clone();
    let (mut link, _) = link(wire);
    link.identify().expect("answers");
    let fast = DriveJob::new(2.6, 0.0, 1.0).expect("a speed that some vehicle reaches");
    let refused = link.drive(&fast, &mut Console(Vec::new())).expect_err("too fast");
    assert_eq!(refused.exit_code(), 2, "{refused}");
    let arms = messages(&sent.borrow())
        .iter()
        .filter(|message| {
            matches!(
                message,
                HostMessage::Order {
                    order: Order::Request(Request::Arm),
                    ..
                }
            )
        })
        .count();
    assert_eq!(arms, 0);
}

#[test]
fn what_another_host_staged_and_left_is_not_stored() {
    let mut bench = ready(11);
    let built_in = support::reference().parameters().cast::<f32>();
    let staged = built_in.number_of("control", "speed_max_m_s").expect("known");
    let write = ParameterRequest::Write {
        number: staged,
        value: 9.0,
    };
    assert!(matches!(
        bench.ask(Order::Parameters(write)),
        Some(Answer::Parameters(_))
    ));
    let (mut link, _) = link(BoardWire::new(bench));
    link.identify().expect("answers");
    link.set(&["control.ki=0.05".to_owned()]).expect("stored");
    let mut expected = built_in;
    expected.control.ki = 0.05;
    assert_eq!(link.parameters().expect("answers"), expected);
}

#[test]
fn a_set_is_written_as_a_file_loaded_and_compared() {
    let (mut link, _) = link(BoardWire::new(ready(10)));
    link.identify().expect("answers");
    let board = link.parameters().expect("answers");
    assert_eq!(board, support::reference().parameters().cast::<f32>());
    let file = Path::new("wanted.toml");
    let mut wanted = board;
    wanted.control.speed_max_m_s = 1.25;
    wanted.body.half_track_m = 0.3;
    let names: Vec<&str> = link
        .differences(file, &wanted)
        .expect("answers")
        .iter()
        .map(|difference| difference.name)
        .collect();
    assert_eq!(names, ["half_track_m", "speed_max_m_s"]);
    assert_eq!(link.load(file, &wanted).expect("stored").len(), 2);
    assert_eq!(link.parameters().expect("answers"), wanted);
    assert_eq!(link.load(file, &wanted).expect("stored again"), []);
    link.built_in().expect("stored");
    assert_eq!(link.parameters().expect("answers"), board);
}
