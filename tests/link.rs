//! `hil-sim link` from outside, over a pseudo-terminal, with the virtual board at the other end.
#![cfg(unix)]

use std::io::{ErrorKind, Read, Write};
use std::process::{Child, Command, Output, Stdio};
use std::time::Duration;

use serialport::{SerialPort, TTYPort};

mod support;
use support::Bench;

/// Runs `hil-sim link` while the bench's board sits at the other end of the port.
fn link(bench: &mut Bench, arguments: &[&str]) -> Output {
    let (mut board_end, tool_end) = TTYPort::pair().expect("a pseudo-terminal");
    board_end.set_timeout(Duration::from_millis(1)).expect("a timeout");
    let port = tool_end.name().expect("has a name");
    let mut tool: Child = Command::new(env!("CARGO_BIN_EXE_hil-sim"))
        .args(["link", "--port", &port])
        .args(arguments)
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("runs");
    // The operator at the port is the tool now.
    bench.drive = None;
    let mut idle = 0_u32;
    while tool.try_wait().expect("waits").is_none() {
        // The tool lives in real time, the board in virtual. What the tool sends paces the board, so that a
        // busy machine that keeps the tool waiting does not look like a silent operator.
        let mut bytes = [0; 256];
        match board_end.read(&mut bytes) {
            Ok(length) => {
                bench.board.send(&bytes[..length]);
                bench.run_raw(20);
            }
            Err(error) if error.kind() == ErrorKind::TimedOut => {
                idle += 1;
                if idle.is_multiple_of(8) {
                    bench.run_raw(1);
                }
            }
            Err(error) => panic!("{error}"),
        }
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
        shown.contains("disarmed: 0.00 m/s, phi") && shown.contains("faults none"),
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
