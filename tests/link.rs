//! `hil-sim link` from outside, over a pseudo-terminal, with the virtual board at the other end.
#![cfg(unix)]

use std::io::{ErrorKind, Read, Write};
use std::process::{Child, Command, Output, Stdio};
use std::time::{Duration, Instant};

use serialport::{SerialPort, TTYPort};

mod support;
use support::Bench;

/// Runs `hil-sim link` while the bench's board sits at the other end of the port.
fn link(bench: &mut Bench, arguments: &[&str]) -> Output {
    link_into(bench, arguments, Stdio::piped())
}

/// As [`link`], with another standard output.
fn link_into(bench: &mut Bench, arguments: &[&str], output: Stdio) -> Output {
    let (mut board_end, tool_end) = TTYPort::pair().expect("a pseudo-terminal");
    board_end.set_timeout(Duration::from_millis(1)).expect("a timeout");
    let port = tool_end.name().expect("has a name");
    let mut tool: Child = Command::new(env!("CARGO_BIN_EXE_hil-sim"))
        .args(["link", "--port", &port])
        .args(arguments)
        .stdout(output)
        .stderr(Stdio::piped())
        .spawn()
        .expect("runs");
    // The operator at the port is the tool now. Tool and board live in the same time: a command is as old as when it
    // was given.
    bench.drive = None;
    bench.board.receive();
    let (started, started_ms) = (Instant::now(), bench.now_ms());
    while tool.try_wait().expect("waits").is_none() {
        let mut bytes = [0; 256];
        match board_end.read(&mut bytes) {
            Ok(length) => bench.board.send(&bytes[..length]),
            Err(error) => assert_eq!(error.kind(), ErrorKind::TimedOut, "{error}"),
        }
        let due_ms = started_ms + started.elapsed().as_millis() as u64;
        bench.run_raw(due_ms.saturating_sub(bench.now_ms()));
        // A full line loses bytes, as a UART does.
        if let Err(error) = board_end.write_all(&bench.board.receive()) {
            assert_eq!(error.kind(), ErrorKind::TimedOut, "{error}");
        }
    }
    drop(tool_end);
    tool.wait_with_output().expect("ended")
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

#[test]
fn the_state_is_shown() {
    let mut bench = Bench::new(1);
    bench.run(1000);
    let output = link(&mut bench, &["status", "--seconds", "1"]);
    assert!(output.status.success(), "{}", text(&output.stderr));
    let shown = text(&output.stdout);
    assert!(
        shown.contains("disarmed: ") && shown.contains("0.00 m/s, phi") && shown.contains("faults none"),
        "{shown}"
    );
}

#[test]
fn a_vehicle_is_armed_driven_and_disarmed() {
    let mut bench = Bench::new(2);
    bench.run(1000);
    let output = link(&mut bench, &["drive", "--speed-m-s", "0.5", "--seconds", "4"]);
    assert!(output.status.success(), "{}", text(&output.stderr));
    assert!(!bench.bridges_on());
    let driven = bench.board.world(|world| world.plant.truth().x_m);
    assert!(driven > 0.8 && driven < 3.0, "{driven} m");
}

#[test]
fn a_blocked_vehicle_is_not_armed_and_the_blocker_is_named() {
    let mut bench = Bench::new(3);
    bench.run(1000);
    bench.board.world(|world| world.emergency_stop = true);
    let output = link(&mut bench, &["drive", "--speed-m-s", "0.5", "--seconds", "1"]);
    assert_eq!(output.status.code(), Some(1));
    assert!(
        text(&output.stderr).contains("blocked by EmergencyStop"),
        "{}",
        text(&output.stderr)
    );
}

#[test]
fn parameters_are_listed_set_and_refused_by_name() {
    let mut bench = Bench::new(4);
    bench.run(1000);
    let output = link(&mut bench, &["parameters", "set", "control.speed_max_m_s=1.25"]);
    assert!(output.status.success(), "{}", text(&output.stderr));
    let listed = text(&link(&mut bench, &["parameters", "list"]).stdout);
    assert!(
        listed.contains("control.speed_max_m_s = 1.25") && listed.contains("body.wheel_radius_m = 0.25"),
        "{listed}"
    );
    for (assignment, part) in [
        ("control.speed_max_m_s=nan", "allowed is 0 to 20"),
        ("control.wings=2", "unknown parameter"),
        ("control.kp", "expected table.name=value"),
    ] {
        let output = link(&mut bench, &["parameters", "set", assignment]);
        assert_eq!(output.status.code(), Some(2), "{assignment}");
        assert!(text(&output.stderr).contains(part), "{}", text(&output.stderr));
    }
}

#[test]
fn sets_move_as_vehicle_files() {
    let file = std::env::temp_dir().join(format!("biplanar-dump-{}.toml", std::process::id()));
    let path = file.to_str().expect("text");
    let mut bench = Bench::new(5);
    bench.run(1000);
    let run = |bench: &mut Bench, arguments: &[&str]| {
        let output = link(bench, &[&["parameters"], arguments].concat());
        (output.status.code(), text(&output.stdout) + &text(&output.stderr))
    };
    let dumped = run(&mut bench, &["dump", path]);
    assert_eq!(dumped.0, Some(0), "{}", dumped.1);
    assert_eq!(run(&mut bench, &["diff", path]).0, Some(0));
    assert_eq!(run(&mut bench, &["set", "control.speed_max_m_s=1.25"]).0, Some(0));
    let differ = run(&mut bench, &["diff", path]);
    assert_eq!(differ.0, Some(1));
    assert!(differ.1.contains("control.speed_max_m_s: 1.25 -> 2.5"), "{}", differ.1);
    let loaded = run(&mut bench, &["load", path]);
    assert!(
        loaded.0 == Some(0) && loaded.1.contains("1 parameters changed"),
        "{}",
        loaded.1
    );
    assert_eq!(run(&mut bench, &["diff", path]).0, Some(0));
    assert_eq!(run(&mut bench, &["dump", path]).0, Some(2), "no file is overwritten");
    std::fs::remove_file(file).expect("is there");
}

#[test]
fn a_closed_or_full_output_is_no_panic_and_the_vehicle_is_disarmed() {
    let mut bench = Bench::new(6);
    bench.run(1000);
    let full = || {
        Stdio::from(
            std::fs::File::options()
                .write(true)
                .open("/dev/full")
                .expect("a device"),
        )
    };
    let (reader, closed) = std::io::pipe().expect("a pipe");
    drop(reader);
    for (arguments, output) in [
        (&["status", "--seconds", "2"][..], full()),
        (&["status", "--seconds", "2"], Stdio::from(closed)),
        (&["drive", "--speed-m-s", "0.3", "--seconds", "1"], full()),
        (&["parameters", "list"], full()),
    ] {
        let ended = link_into(&mut bench, arguments, output);
        assert_eq!(ended.status.code(), Some(1), "{arguments:?}");
        let told = text(&ended.stderr);
        assert!(
            told.contains("output") && !told.contains("panicked"),
            "{arguments:?}: {told}"
        );
        assert!(!bench.bridges_on());
    }
}

#[test]
fn numbers_are_checked_before_the_port_opens() {
    for (flag, value) in [
        ("--speed-m-s", "nan"),
        ("--speed-m-s", "inf"),
        ("--speed-m-s", "1e39"),
        ("--speed-m-s", "-1e10"),
        ("--seconds", "nan"),
        ("--seconds", "-1"),
        ("--seconds", "inf"),
        ("--seconds", "0"),
    ] {
        let mut values = vec![("--speed-m-s", "0.5"), ("--seconds", "1")];
        values.retain(|(name, _)| *name != flag);
        values.push((flag, value));
        let output = Command::new(env!("CARGO_BIN_EXE_hil-sim"))
            .args(["link", "--port", "/dev/no-such-port", "drive"])
            .args(values.iter().flat_map(|(flag, value)| [*flag, *value]))
            .output()
            .expect("runs");
        let told = text(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{flag} {value}: {told}");
        assert!(told.contains(flag) && !told.contains("no-such-port"), "{told}");
    }
}

#[test]
fn a_port_that_is_not_there_ends_with_2_and_a_silent_one_with_1() {
    let output = Command::new(env!("CARGO_BIN_EXE_hil-sim"))
        .args(["link", "--port", "/dev/no-such-port", "status"])
        .output()
        .expect("runs");
    assert_eq!(output.status.code(), Some(2));
    assert!(
        text(&output.stderr).contains("--port /dev/no-such-port"),
        "{}",
        text(&output.stderr)
    );
    let (_board_end, tool_end) = TTYPort::pair().expect("a pseudo-terminal");
    let output = Command::new(env!("CARGO_BIN_EXE_hil-sim"))
        .args(["link", "--port", &tool_end.name().expect("has a name"), "status"])
        .output()
        .expect("runs");
    assert_eq!(output.status.code(), Some(1));
    assert!(
        text(&output.stderr).contains("no identity from the board"),
        "{}",
        text(&output.stderr)
    );
}
