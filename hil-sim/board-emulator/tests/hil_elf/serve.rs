//! `hil-sim serve --board emulated`: the link tool's commands at the ports of the served ELF.

use std::io;
use std::net::TcpStream;
use std::path::PathBuf;
use std::process::Command;
use std::sync::Arc;
use std::time::{Duration, Instant};

use clap::Parser;
use firmware::protocol::frame::{Decoder, Received};
use firmware::protocol::message::BoardMessage;
use hil_elf::ELF_VARIABLE;
use hil_sim::cli::link::console::Console;
use hil_sim::cli::link::session::Link;
use hil_sim::cli::link::wire::{Port, Wire};
use hil_sim::cli::link::{self, Arguments};
use report::error::CommandError;

use crate::support::firmware;

#[path = "../../../../tests/support/listened.rs"]
mod listened;
use listened::Listened;

/// After this time of the host's clock a test gives up instead of hanging; the time measures nothing.
const GIVE_UP: Duration = Duration::from_mins(3);

/// A port of the served board that takes its time from the board's statuses, over restarts too: however slow this machine is, the
/// board answers the tool in time.
struct BoardTimedPort {
    port: Port,
    opened: Instant,
    decoder: Decoder,
    /// The board's time in the last status, us since its boot; none before the first.
    board_us: Option<u64>,
    now_us: u64,
    /// When the port breaks.
    cut_us: u64,
}

impl BoardTimedPort {
    fn open(name: &str, cut_us: u64) -> Result<Self, CommandError> {
        Ok(Self {
            port: Port::open(name)?,
            opened: Instant::now(),
            decoder: Decoder::new(),
            board_us: None,
            now_us: 0,
            cut_us,
        })
    }
}

impl Wire for BoardTimedPort {
    fn send(&mut self, bytes: &[u8]) -> io::Result<()> {
        if self.now_us >= self.cut_us {
            return Err(io::ErrorKind::BrokenPipe.into());
        }
        self.port.send(bytes)
    }

    fn receive(&mut self, bytes: &mut [u8]) -> io::Result<usize> {
        assert!(self.opened.elapsed() < GIVE_UP, "the test hangs");
        if self.now_us >= self.cut_us {
            return Err(io::ErrorKind::BrokenPipe.into());
        }
        let length = self.port.receive(bytes)?;
        for byte in &bytes[..length] {
            if let Received::Message(BoardMessage::Status(status)) = self.decoder.push(*byte) {
                let board_us = status.vehicle.time_us;
                // After a boot the board's time begins at 0 again.
                self.now_us += self.board_us.map_or(0, |last| board_us.saturating_sub(last));
                self.board_us = Some(board_us);
            }
        }
        Ok(length)
    }

    fn now_us(&self) -> u64 {
        self.now_us
    }
}

/// The command line of `hil-sim link`.
#[derive(Parser)]
struct Tool {
    #[command(flatten)]
    link: Arguments,
}

/// A server, which ends with the test.
fn serve(arguments: &[&str]) -> Listened {
    let mut command = Command::new(env!("CARGO_BIN_EXE_emulated-board"));
    let command = command.args(["serve", "--board", "emulated"]).args(arguments);
    Listened::start(command.env(ELF_VARIABLE, firmware().path()), GIVE_UP)
}

/// Runs the link tool at a port that breaks after `cut_s` seconds; returns the tool's result and output.
fn link_until(cut_s: f64, port: &str, arguments: &[&str]) -> (Result<(), CommandError>, String) {
    let line = [&["link", "--port", port], arguments].concat();
    let tool = Tool::try_parse_from(line).expect("understood");
    let mut console = Console(Vec::new());
    let begin = |port: &str| {
        let wire = BoardTimedPort::open(port, (cut_s * 1e6) as u64)?;
        Ok(Link::new(wire, 0x5EED ^ port.len() as u32, Arc::default()))
    };
    let ended = link::run_on(&tool.link, begin, &mut console);
    (ended, String::from_utf8(console.0).expect("text"))
}

/// Runs the link tool at a port, asserts that it succeeds, and returns its output.
fn link_at(port: &str, arguments: &[&str]) -> String {
    let (ended, text) = link_until(f64::INFINITY, port, arguments);
    ended.unwrap_or_else(|error| panic!("{arguments:?}: {error}: {text}"));
    text
}

/// The path of a file that does not exist yet.
fn new_file(name: &str) -> PathBuf {
    let path = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(name);
    let _ = std::fs::remove_file(&path);
    path
}

/// Handshake, status, drive, an operator who vanishes, log, faults, records and parameters, at all three kinds of port of one
/// board.
#[test]
fn a_served_elf_is_driven_over_every_kind_of_port() {
    let served = serve(&["--tcp", "127.0.0.1:0", "--websocket", "127.0.0.1:0", "--pty"]);
    let [tcp, websocket, terminal] = [(); 3].map(|()| served.wait_for("board at "));
    assert!(tcp.starts_with("tcp:") && websocket.starts_with("ws://") && terminal.starts_with('/'));
    let text = link_at(&websocket, &["status", "--seconds", "0.3"]);
    assert!(text.contains("disarmed: "), "{text}");

    // On a busy machine the operator may fall silent: the vehicle then stops and reports why.
    let recorded = new_file("served.mcap");
    let drive = ["drive", "--speed-m-s", "0.3", "--seconds", "1"];
    let driven = (0..5).find_map(|_| {
        let _ = std::fs::remove_file(&recorded);
        let record = ["--record", recorded.to_str().expect("utf-8")];
        let (ended, text) = link_until(f64::INFINITY, &tcp, &[&drive[..], &record].concat());
        match ended {
            Ok(()) => Some(text),
            Err(error)
                if ["CommandTimeout", "NotAtRest"]
                    .iter()
                    .any(|why| error.to_string().contains(why)) =>
            {
                link_at(&tcp, &["clear-faults"]);
                None
            }
            Err(error) => panic!("{error}: {text}"),
        }
    });
    let text = driven.expect("a drive without a silent operator");
    assert!(text.starts_with("armed: ") && text.contains(" 0 blocks lost"), "{text}");
    let read = record_file::parse(&std::fs::read(&recorded).expect("written")).expect("readable");
    // In this record the vehicle stands, drives for 1 s and stops.
    assert!(read.records().count() > 1000, "{}", read.records().count());
    assert!(read.log().any(|line| line.text == "armed"), "{:?}", read.boots[0].log);

    // An operator who vanishes is silent: the vehicle stops by itself, and the board keeps the fault.
    let (ended, _) = link_until(2.0, &websocket, &["drive", "--speed-m-s", "0.3", "--seconds", "60"]);
    assert!(ended.is_err());
    served.wait_for("left, and has driven");
    let stopped = (0..40).any(|_| {
        link_at(&tcp, &["status", "--seconds", "0.5"])
            .lines()
            .last()
            .is_some_and(|line| line.starts_with("disarmed: ") && line.contains("CommandTimeout"))
    });
    assert!(stopped);
    assert!(link_at(&terminal, &["faults"]).contains("this boot"));
    assert!(link_at(&terminal, &["log"]).contains("CommandTimeout"));
    let back = new_file("served-back.rec");
    link_at(&tcp, &["look-back", "--out", back.to_str().expect("utf-8")]);
    link_at(&terminal, &["clear-faults"]);

    let set = new_file("served.toml");
    let set = set.to_str().expect("utf-8");
    link_at(&terminal, &["parameters", "dump", set]);
    link_at(&tcp, &["parameters", "set", "control.comfort_s=0.3"]);
    let (ended, text) = link_until(f64::INFINITY, &websocket, &["parameters", "diff", set]);
    assert!(
        ended.is_err() && text.contains("control.comfort_s: 0.3 -> 0.2"),
        "{text}"
    );
    link_at(&tcp, &["disarm"]);
}

/// The whole command `cargo run -- serve --board emulated`: it ends together with its emulator, whatever ends it.
#[cfg(unix)]
#[test]
fn the_command_and_its_emulator_end_together() {
    let cargo = |arguments: &[&str]| {
        let mut command = Command::new("cargo");
        hil_elf::without_package_variables(&mut command);
        command.arg(arguments[0]).arg("--quiet").args(&arguments[1..]);
        command
            .current_dir(hil_elf::root())
            .env(ELF_VARIABLE, firmware().path());
        command
    };
    // However long the build takes.
    assert!(
        cargo(&["build", "--package", "hil-sim"])
            .status()
            .expect("runs")
            .success()
    );
    let serve = [
        "run",
        "--package",
        "hil-sim",
        "--",
        "serve",
        "--board",
        "emulated",
        "--tcp",
        "127.0.0.1:0",
    ];
    for (signal, code) in [
        ("-INT", Some(0)),
        ("-TERM", Some(0)),
        ("-HUP", Some(0)),
        ("-KILL", None),
    ] {
        // The command builds its emulator first.
        let mut served = Listened::start(&mut cargo(&serve), 4 * GIVE_UP);
        let port = served.wait_for("board at ");
        let text = link_at(&port, &["status", "--seconds", "0.2"]);
        assert!(text.contains("disarmed: "), "{text}");
        served.signal(signal);
        assert_eq!(served.process.wait().expect("ended").code(), code, "{signal}");
        let address = port.strip_prefix("tcp:").expect("a TCP port");
        assert!(TcpStream::connect(address).is_err(), "{signal}: an emulator still runs");
    }
}

/// An update runs completely, as on the drive board: sent, installed by the boot loader, confirmed.
#[test]
fn a_served_elf_takes_an_update_and_comes_up_with_it() {
    // As fast as this machine allows, because nobody drives.
    let served = serve(&["--websocket", "127.0.0.1:0", "--rate", "100"]);
    let port = served.wait_for("board at ");
    let text = link_at(&port, &["update", firmware().path().to_str().expect("utf-8")]);
    assert!(
        text.ends_with("the new firmware has come up and is confirmed\n"),
        "{text}"
    );
    assert!(link_at(&port, &["log"]).contains("booted, reset by "));
}

/// The server refuses a vehicle that the firmware cannot fly before anybody could connect.
#[test]
fn a_served_vehicle_of_another_kind_is_refused() {
    let file = new_file("no-spar.toml");
    let text = vehicle_file_without_spar();
    std::fs::write(&file, text).expect("writes");
    let output = Command::new(env!("CARGO_BIN_EXE_emulated-board"))
        .args(["serve", "--board", "emulated", "--tcp", "127.0.0.1:0", "--vehicle"])
        .arg(&file)
        .env(ELF_VARIABLE, firmware().path())
        .output()
        .expect("it starts");
    let error = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(2), "{error}");
    assert!(error.contains("camera spar"), "{error}");
    assert!(!String::from_utf8_lossy(&output.stdout).contains("board at"));
}

/// The reference vehicle without its camera spar.
fn vehicle_file_without_spar() -> String {
    let with_spar = firmware::built_in::PARAMETERS;
    vehicle_file::to_toml(&model::vehicle::VehicleParameters {
        spar: None,
        ..with_spar
    })
}
