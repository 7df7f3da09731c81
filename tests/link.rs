//! `hil-sim link` over a pseudo-terminal, with the virtual board at the other end. Where time matters, it is the virtual board's
//! time.
#![cfg(unix)]

use std::fs::File;
use std::io::{self, Read, Write};
use std::process::{Command, Output, Stdio};
use std::sync::Arc;
use std::sync::atomic::AtomicU32;
use std::time::Duration;

use clap::Parser;
use firmware::protocol::message::HostMessage;
use hil_sim::cli::link::console::Console;
use hil_sim::cli::link::session::Link;
use hil_sim::cli::link::wire::{Port, Wire};
use hil_sim::cli::link::{self, Arguments};
use plant::settings::PlantSettings;
use serialport::{SerialPort, TTYPort};
use virtual_board::board::flash::VirtualFlash;

mod support;
#[path = "support/wires.rs"]
mod wires;
use support::Bench;
use wires::{HOST_START_US, READ_US, messages};

/// After this time a test gives up instead of hanging; the time measures nothing.
const GIVE_UP: Duration = Duration::from_mins(2);

/// The command line of `hil-sim link`.
#[derive(Parser)]
struct Tool {
    #[command(flatten)]
    link: Arguments,
}

/// The tool's own serial port at one end of a pseudo-terminal, the virtual board at the other end, and the board's
/// time for both: however slow the machine is, each byte arrives in its millisecond.
struct Terminal<'a> {
    bench: &'a mut Bench,
    board_end: TTYPort,
    port: Port,
    /// Bytes that the board has sent and the tool has not received yet.
    under_way: usize,
}

impl Wire for Terminal<'_> {
    fn send(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.port.send(bytes)?;
        let mut arrived = vec![0; bytes.len()];
        self.board_end.read_exact(&mut arrived)?;
        self.bench.board.send(&arrived);
        Ok(())
    }

    fn receive(&mut self, bytes: &mut [u8]) -> io::Result<usize> {
        if self.under_way == 0 {
            self.bench.run_raw(READ_US / 1000);
            let sent = self.bench.board.receive();
            self.board_end.write_all(&sent)?;
            self.under_way = sent.len();
        }
        let mut length = 0;
        while length == 0 && self.under_way > 0 {
            length = self.port.receive(bytes)?;
        }
        self.under_way -= length;
        Ok(length)
    }

    fn now_us(&self) -> u64 {
        HOST_START_US + self.bench.now_ms() * 1000
    }
}

/// What a command ended with: exit code, and what it wrote on its output and as its error.
struct Ended {
    code: u8,
    output: String,
    error: String,
}

/// Runs `link` with these arguments while the bench's board sits at the other end of the port.
fn link(bench: &mut Bench, arguments: &[&str]) -> Ended {
    let mut output = Vec::new();
    let ended = link_into(bench, arguments, &mut output);
    Ended {
        output: text(&output),
        ..ended
    }
}

/// As [`link`], with another output.
fn link_into<O: Write>(bench: &mut Bench, arguments: &[&str], output: O) -> Ended {
    let (mut board_end, tool_end) = TTYPort::pair().expect("a pseudo-terminal");
    board_end.set_timeout(GIVE_UP).expect("a timeout");
    let port = tool_end.name().expect("has a name");
    let arguments = [&["link", "--port", &port], arguments].concat();
    let tool = Tool::try_parse_from(arguments).expect("understood");
    // From now on the tool is the operator at the port.
    bench.drive = None;
    bench.board.receive();
    let begin = |port: &str| {
        let port = Port::open(port)?;
        let wire = Terminal {
            bench,
            board_end,
            port,
            under_way: 0,
        };
        Ok(Link::new(wire, std::process::id(), Arc::new(AtomicU32::new(0))))
    };
    let result = link::run_on(&tool.link, begin, &mut Console(output));
    Ended {
        code: result.as_ref().err().map_or(0, report::error::CommandError::exit_code),
        output: String::new(),
        error: result.err().map(|error| error.to_string()).unwrap_or_default(),
    }
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

/// Runs the program itself with these arguments to its end.
fn program(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_hil-sim"))
        .arg("link")
        .args(arguments)
        .output()
        .expect("runs")
}

#[test]
fn the_program_disarms_before_anything_else() {
    let (mut board_end, tool_end) = TTYPort::pair().expect("a pseudo-terminal");
    board_end.set_timeout(GIVE_UP).expect("a timeout");
    let program = Command::new(env!("CARGO_BIN_EXE_hil-sim"))
        .args(["link", "--port", &tool_end.name().expect("has a name"), "disarm"])
        .stderr(Stdio::piped())
        .spawn()
        .expect("runs");
    let mut came = Vec::new();
    while messages(&came).is_empty() {
        let mut bytes = [0; 64];
        let length = board_end.read(&mut bytes).expect("the program speaks");
        came.extend(&bytes[..length]);
    }
    assert!(matches!(messages(&came)[0], HostMessage::Disarm(_)), "{came:?}");
    // Nobody answers: the program ends by itself and says what it does not know.
    let ended = program.wait_with_output().expect("ends");
    assert_eq!(ended.status.code(), Some(1));
    let error = String::from_utf8_lossy(&ended.stderr);
    assert!(
        error.contains("Disarm was sent, and the board did not confirm it"),
        "{error}"
    );
}

#[test]
fn the_state_is_shown() {
    let mut bench = Bench::new(1);
    bench.run(1000);
    let output = link(&mut bench, &["status", "--seconds", "1"]);
    assert_eq!(output.code, 0, "{}", output.error);
    let shown = output.output;
    assert!(
        shown.contains("disarmed: ") && shown.contains("0.00 m/s, phi") && shown.contains("faults none"),
        "{shown}"
    );
    assert!(!shown.contains("distance"), "{shown}");
    let all = link(&mut bench, &["status", "--all", "--seconds", "1"]).output;
    for part in [
        "place: distance ",
        "heading ",
        "spar: ",
        "currents: left ",
        "voltages: left ",
        "limits: none",
        "terms of the speed law, V: ",
        "friction 0.00",
        "terms of the spar law, V: ",
    ] {
        assert!(all.contains(part), "{part}: {all}");
    }
    assert_eq!(link(&mut bench, &["faults"]).output.trim_end(), "no faults");
}

#[test]
fn the_state_of_a_vehicle_without_a_spar_shows_none() {
    let mut parameters = *support::reference().parameters();
    parameters.spar = None;
    let vehicle = model::vehicle::Vehicle::new(parameters).expect("valid");
    let erased = VirtualFlash::erased;
    let mut bench = Bench::of(&vehicle, 1, erased(), erased(), &PlantSettings::default());
    bench.run(1000);
    let all = link(&mut bench, &["status", "--all", "--seconds", "1"]).output;
    assert!(
        all.contains("currents: left ") && all.contains("terms of the steering law"),
        "{all}"
    );
    assert!(!all.contains("spar") && !all.contains("ballast"), "{all}");
}

#[test]
fn a_vehicle_is_armed_driven_and_disarmed() {
    let mut bench = Bench::new(2);
    bench.run(1000);
    let output = link(&mut bench, &["drive", "--speed-m-s", "0.5", "--seconds", "4"]);
    assert_eq!(output.code, 0, "{}", output.error);
    assert!(!bench.bridges_on());
    let driven = bench.board.world(|world| world.plant.truth().x_m);
    // 2 m, less what the ramp of 0.25 s takes, and with the stop's way.
    assert!((1.8..2.2).contains(&driven), "{driven} m");
}

#[test]
fn a_blocked_vehicle_is_not_armed_and_the_blocker_is_named() {
    let mut bench = Bench::new(3);
    bench.run(1000);
    bench.board.world(|world| world.emergency_stop = true);
    let output = link(&mut bench, &["drive", "--speed-m-s", "0.5", "--seconds", "1"]);
    assert_eq!(output.code, 1);
    assert!(output.error.contains("blocked by EmergencyStop"), "{}", output.error);
}

#[test]
fn parameters_are_listed_set_and_refused_by_name() {
    let mut bench = Bench::new(4);
    bench.run(1000);
    let output = link(&mut bench, &["parameters", "set", "control.speed_max_m_s=1.25"]);
    assert_eq!(output.code, 0, "{}", output.error);
    let listed = link(&mut bench, &["parameters", "list"]).output;
    assert!(
        listed.contains("control.speed_max_m_s = 1.25   0 to 20: ") && listed.contains("body.wheel_radius_m = 0.25"),
        "{listed}"
    );
    for (assignment, part) in [
        ("control.speed_max_m_s=nan", "allowed is 0 to 20"),
        ("control.wings=2", "unknown parameter"),
        ("control.kp", "expected table.name=value"),
        ("control.kp=abc", "`abc` is not a number: allowed is "),
    ] {
        let output = link(&mut bench, &["parameters", "set", assignment]);
        assert_eq!(output.code, 2, "{assignment}");
        assert!(output.error.contains(part), "{}", output.error);
    }
    let twice = [
        "parameters",
        "set",
        "control.speed_max_m_s=1",
        "control.speed_max_m_s=2",
    ];
    let output = link(&mut bench, &twice);
    assert!(
        output.code == 2 && output.error.contains("control.speed_max_m_s is given twice"),
        "{}",
        output.error
    );
    let listed = link(&mut bench, &["parameters", "list"]).output;
    assert!(listed.contains("control.speed_max_m_s = 1.25 "), "{listed}");
}

#[test]
fn sets_move_as_vehicle_files() {
    let file = std::env::temp_dir().join(format!("biplanar-dump-{}.toml", std::process::id()));
    let path = file.to_str().expect("text");
    let mut bench = Bench::new(5);
    bench.run(1000);
    let run = |bench: &mut Bench, arguments: &[&str]| {
        let ended = link(bench, &[&["parameters"], arguments].concat());
        (ended.code, ended.output + &ended.error)
    };
    let dumped = run(&mut bench, &["dump", path]);
    assert_eq!(dumped.0, 0, "{}", dumped.1);
    assert_eq!(run(&mut bench, &["diff", path]).0, 0);
    assert_eq!(run(&mut bench, &["set", "control.speed_max_m_s=1.25"]).0, 0);
    let differ = run(&mut bench, &["diff", path]);
    assert_eq!(differ.0, 1);
    assert!(differ.1.contains("control.speed_max_m_s: 1.25 -> 2.5"), "{}", differ.1);
    let loaded = run(&mut bench, &["load", path]);
    assert!(
        loaded.0 == 0 && loaded.1.contains("parameters changed: 1"),
        "{}",
        loaded.1
    );
    assert_eq!(run(&mut bench, &["diff", path]).0, 0);
    assert_eq!(run(&mut bench, &["dump", path]).0, 2, "no file is overwritten");
    // Within each range, but with the arm in the ground.
    let text = std::fs::read_to_string(&file).expect("readable");
    std::fs::write(&file, text.replace("arm_length_m = 0.2\n", "arm_length_m = 0.3\n")).expect("written");
    let refused = run(&mut bench, &["load", path]);
    assert!(
        refused.0 == 2
            && refused
                .1
                .contains("body.arm_length_m: the arm's centre of mass hangs 0.3 m"),
        "{}",
        refused.1
    );
    std::fs::remove_file(file).expect("is there");
}

#[test]
fn a_closed_or_full_output_is_no_panic_and_the_vehicle_is_disarmed() {
    let mut bench = Bench::new(6);
    bench.run(1000);
    let full = || Box::new(File::options().write(true).open("/dev/full").expect("a device"));
    let (reader, closed) = io::pipe().expect("a pipe");
    drop(reader);
    let cases: [(&[&str], Box<dyn Write>); 4] = [
        (&["status", "--seconds", "2"], full()),
        (&["status", "--seconds", "2"], Box::new(closed)),
        (&["drive", "--speed-m-s", "0.3", "--seconds", "1"], full()),
        (&["parameters", "list"], full()),
    ];
    for (arguments, output) in cases {
        let ended = link_into(&mut bench, arguments, output);
        assert_eq!(ended.code, 1, "{arguments:?}");
        assert!(ended.error.contains("output"), "{arguments:?}: {}", ended.error);
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
        let mut arguments = vec!["--port", "/dev/no-such-port", "drive"];
        arguments.extend(values.iter().flat_map(|(flag, value)| [*flag, *value]));
        let output = program(&arguments);
        let told = text(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{flag} {value}: {told}");
        assert!(told.contains(flag) && !told.contains("no-such-port"), "{told}");
    }
}

#[test]
fn a_port_that_is_not_there_ends_with_2_and_a_silent_one_with_1() {
    let output = program(&["--port", "/dev/no-such-port", "status"]);
    assert_eq!(output.status.code(), Some(2));
    assert!(
        text(&output.stderr).contains("--port /dev/no-such-port"),
        "{}",
        text(&output.stderr)
    );
    let (_board_end, tool_end) = TTYPort::pair().expect("a pseudo-terminal");
    let output = program(&["--port", &tool_end.name().expect("has a name"), "status"]);
    assert_eq!(output.status.code(), Some(1));
    assert!(
        text(&output.stderr).contains("no identity from the board"),
        "{}",
        text(&output.stderr)
    );
}
