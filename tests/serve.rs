//! `hil-sim serve` from outside: every command of the link tool against a served board, on a TCP port, on a pseudo-terminal
//! and over a WebSocket.

use std::io::Write as _;
use std::net::TcpStream;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use firmware::drive_board::BOARD;
use tungstenite::Message;
use virtual_board::link_client::LinkClient;

#[path = "support/elves.rs"]
mod elves;
#[path = "support/listened.rs"]
mod listened;
#[path = "support/served.rs"]
mod served;
#[path = "support/tool.rs"]
mod tool;
use served::{GIVE_UP, Served};
use tool::{WORKSPACE, hil_sim, stderr};

/// Fault and blocker of a vehicle whose operator fell silent because the machine was busy.
const SILENCED: [&str; 2] = ["CommandTimeout", "NotAtRest"];
const TCP: [&str; 2] = ["--tcp", "127.0.0.1:0"];

fn new_file(name: &str) -> String {
    let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    let _ = std::fs::remove_file(&path);
    path.to_str().expect("utf-8").to_owned()
}

/// Runs every command of the link tool.
fn every_command(served: &Served, name: &str) {
    let ok = |arguments: &[&str]| {
        let (code, text, error) = served.link(arguments);
        assert_eq!(code, Some(0), "{arguments:?}: {text} {error}");
        text
    };
    assert!(ok(&["status", "--seconds", "1"]).contains("disarmed: "));
    // The gyros are calibrated in the first seconds.
    served.wait_for("calibrated");
    let drive = ["drive", "--speed-m-s", "0.3", "--seconds", "1"];
    // On a busy machine the operator may fall silent: the vehicle then stops and reports why, and its arm must swing out before the
    // vehicle can be armed again.
    let driven = (0..10).find_map(|_| {
        let (code, text, error) = served.link(&drive);
        if code != Some(0) && SILENCED.iter().any(|why| error.contains(why)) {
            ok(&["disarm"]);
            ok(&["clear-faults"]);
            ok(&["status", "--seconds", "1"]);
            return None;
        }
        assert_eq!(code, Some(0), "{text} {error}");
        Some(text)
    });
    let text = driven.expect("a drive without a silent operator");
    assert!(text.starts_with("armed: "), "{text}");
    served.wait_for("drives");
    ok(&["disarm"]);
    ok(&["clear-faults"]);
    assert!(ok(&["log"]).contains(" armed"));
    ok(&["faults"]);
    let (records, set) = (new_file(&format!("{name}.rec")), new_file(&format!("{name}.toml")));
    ok(&["record", "--out", &records, "--seconds", "0.5"]);
    assert!(std::fs::metadata(&records).expect("records").len() > 100);
    ok(&["parameters", "list"]);
    ok(&["parameters", "dump", &set]);
    ok(&["parameters", "diff", &set]);
    ok(&["parameters", "load", &set]);
    ok(&["parameters", "set", "control.comfort_s=0.3"]);
    let (code, text, _) = served.link(&["parameters", "diff", &set]);
    assert!(
        code == Some(1) && text.contains("control.comfort_s: 0.3 -> 0.2"),
        "{text}"
    );
    ok(&["parameters", "built-in"]);
    ok(&["parameters", "diff", &set]);
    let (code, _, error) = served.link(&["look-back", "--out", &new_file(&format!("{name}-back.rec"))]);
    assert!(code == Some(1) && error.contains("no fault has occurred"), "{error}");
    // The board stores and checks an update; it has no boot loader that would install the update, and keeps running.
    let elf = new_file(&format!("{name}.elf"));
    std::fs::write(&elf, elves::elf(BOARD, 9000)).expect("writes");
    let (code, text, error) = served.link(&["update", &elf]);
    assert!(text.contains("build 00000007, 9000 bytes"), "{text}");
    assert!(
        code == Some(1) && error.contains("has stored and checked the image and not installed it"),
        "{error}"
    );
    ok(&["status", "--seconds", "0.2"]);
}

/// A drive over the link that is recorded from the boot on replays bit for bit; a later record does not replay.
#[test]
fn a_drive_is_recorded_from_the_boot_on_and_replays() {
    let served = Served::new(&["--tcp", "127.0.0.1:0", "--wait"]);
    for (name, whole) in [("served-drive.mcap", true), ("later-drive.mcap", false)] {
        let file = new_file(name);
        let (code, text, error) = served.link(&["drive", "--speed-m-s", "0.3", "--seconds", "3", "--record", &file]);
        assert_eq!(code, Some(0), "{text} {error}");
        assert!(text.contains(" 0 blocks lost"), "{text}");
        let replay = hil_sim(&["replay", &file]);
        let text = String::from_utf8_lossy(&replay.stdout).into_owned();
        if whole {
            assert!(text.contains("bit for bit"), "{text} {}", stderr(&replay));
            assert_eq!(replay.status.code(), Some(0), "{text}");
        } else {
            // The later record lacks the vehicle's state at its beginning, and the tool says so.
            assert_eq!(replay.status.code(), Some(2), "{text}");
            assert!(stderr(&replay).contains("boot"), "{}", stderr(&replay));
        }
        let read = hil_sim::cli::record_files::read(Path::new(&file)).expect("readable");
        // In this record the vehicle arms, drives for 3 s and stops.
        assert!(read.records().count() > 3000, "{}", read.records().count());
    }
}

/// For a wrong port the tool says which port would be right.
#[test]
fn a_wrong_port_is_told_with_what_would_be_right() {
    let served = Served::new(&["--websocket", "127.0.0.1:0"]);
    let address = served
        .port
        .strip_prefix("ws://")
        .expect("a WebSocket's address")
        .to_owned();
    let web = format!("tcp:{address}");
    let page = format!("ws://{address}/page");
    let other = Served::new(&TCP);
    let no_web = other.port.replace("tcp:", "ws://");
    for (port, part) in [
        ("tcp:127.0.0.1:9", "nobody listens there: `hil-sim serve`"),
        ("ws://127.0.0.1:9", "nobody listens there: `hil-sim serve`"),
        ("ws:127.0.0.1:9", "allowed is ws://HOST:PORT"),
        ("ws://127.0.0.1", "allowed is ws://HOST:PORT"),
        (&page, "allowed is ws://HOST:PORT"),
        ("wss://127.0.0.1:9", "no encrypted WebSocket"),
        (&no_web, "`hil-sim serve --websocket` serves a board at one"),
        (&web, "is a board served at this port?"),
        (&address, &web),
        ("/dev/null", "is not a serial port"),
        (WORKSPACE, "is not a serial port"),
        ("/dev/ttyNone", "this machine has"),
    ] {
        let output = hil_sim(&["link", "--port", port, "status"]);
        assert_ne!(output.status.code(), Some(0), "{port}");
        assert!(stderr(&output).contains(part), "{port}: {}", stderr(&output));
    }
}

#[test]
fn every_link_command_works_over_tcp() {
    let served = Served::new(&TCP);
    assert!(served.port.starts_with("tcp:127.0.0.1:"), "{}", served.port);
    every_command(&served, "tcp");
}

#[test]
fn every_link_command_works_over_a_websocket() {
    let served = Served::new(&["--websocket", "127.0.0.1:0"]);
    assert!(served.port.starts_with("ws://127.0.0.1:"), "{}", served.port);
    every_command(&served, "websocket");
}

#[cfg(unix)]
#[test]
fn every_link_command_works_on_a_pseudo_terminal() {
    let served = Served::new(&["--pty"]);
    assert!(served.port.starts_with("/dev/"), "{}", served.port);
    every_command(&served, "pty");
}

/// The link tool drives a board that is served slower or faster than this machine's clock. Whether an order is dated in the board's
/// future is checked in the board's own time: `a_board_at_another_rate_gets_no_order_late` of tests/link_tool.rs.
#[test]
fn a_board_at_another_rate_drives() {
    for rate in ["0.3", "0.97", "3"] {
        // On a busy machine the operator may fall silent, so the test retries with a new board.
        let driven = (0..10).any(|_| {
            let served = Served::new(&["--tcp", "127.0.0.1:0", "--rate", rate]);
            served.wait_for("calibrated");
            let (code, text, error) = served.link(&["drive", "--speed-m-s", "0.3", "--seconds", "4"]);
            let is_silent = SILENCED.iter().any(|why| error.contains(why));
            assert!(code == Some(0) || is_silent, "rate {rate}: {text} {error}");
            code == Some(0)
        });
        assert!(driven, "rate {rate}: the operator falls silent in every drive");
    }
}

/// A second client receives the board's messages and may disarm the vehicle, but the board refuses its orders while the first client
/// drives.
#[test]
fn a_second_client_watches_and_disarms_but_does_not_drive() {
    let served = Served::new(&TCP);
    served.wait_for("calibrated");
    let port = served.port.clone();
    let first = std::thread::spawn(move || {
        hil_sim(&[
            "link",
            "--port",
            &port,
            "drive",
            "--speed-m-s",
            "0.2",
            "--seconds",
            "20",
        ])
    });
    served.wait_for("drives");
    let (code, text, error) = served.link(&["status", "--seconds", "1"]);
    assert_eq!(code, Some(0), "{text} {error}");
    let (code, _, error) = served.link(&["drive", "--speed-m-s", "0.5", "--seconds", "1"]);
    assert_eq!(code, Some(1));
    assert!(error.contains("another host"), "{error}");
    // The second client's orders do not disturb the first client's drive, but its Disarm ends the drive.
    let (code, text, error) = served.link(&["status", "--seconds", "1"]);
    assert_eq!(code, Some(0), "{error}");
    assert!(text.lines().skip(1).all(|line| line.starts_with("armed: ")), "{text}");
    let (code, _, error) = served.link(&["disarm"]);
    assert_eq!(code, Some(0), "{error}");
    let output = first.join().expect("ended");
    assert_eq!(output.status.code(), Some(1), "{}", stderr(&output));
}

/// A client that vanishes is an operator who falls silent: the vehicle stops by itself, and the next client can clear the fault.
#[test]
fn a_client_that_vanishes_leaves_a_vehicle_that_stops() {
    let served = Served::new(&TCP);
    served.wait_for("calibrated");
    let mut first = Command::new(env!("CARGO_BIN_EXE_hil-sim"))
        .args([
            "link",
            "--port",
            &served.port,
            "drive",
            "--speed-m-s",
            "0.5",
            "--seconds",
            "60",
        ])
        .stdout(Stdio::null())
        .spawn()
        .expect("starts");
    served.wait_for("INFO  armed");
    // SIGKILL, so that the tool cannot send a Disarm.
    first.kill().expect("killed");
    first.wait().expect("ended");
    served.wait_for("left, and has driven");
    served.wait_for("CommandTimeout");
    // The controlled stop takes its time.
    served.wait_for("disarmed");
    let (code, text, error) = served.link(&["status", "--seconds", "0.5"]);
    assert_eq!(code, Some(0), "{error}");
    assert!(text.contains("CommandTimeout"), "{text}");
    assert_eq!(served.link(&["clear-faults"]).0, Some(0));
}

/// The file of a recording keeps what the tool received before the cable was pulled, or before the tool itself was killed.
#[test]
fn a_recording_that_breaks_off_keeps_what_it_had() {
    let mut served = Served::new(&TCP);
    for (name, end_the_board) in [("tool-dies.mcap", false), ("cable-pulled.mcap", true)] {
        let file = new_file(name);
        let mut tool = Command::new(env!("CARGO_BIN_EXE_hil-sim"))
            .args([
                "link",
                "--port",
                &served.port,
                "record",
                "--out",
                &file,
                "--seconds",
                "600",
            ])
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .expect("starts");
        let begun = Instant::now();
        // Some hundreds of statuses.
        while std::fs::metadata(&file).map_or(0, |file| file.len()) < 300_000 {
            assert!(begun.elapsed() < GIVE_UP, "{name}: nothing is recorded");
            std::thread::sleep(Duration::from_millis(20));
        }
        if end_the_board {
            served.server.process.kill().expect("killed");
        } else {
            tool.kill().expect("killed");
        }
        let code = tool.wait().expect("ended").code();
        assert_eq!(code, end_the_board.then_some(1), "{name}");
        let read = hil_sim::cli::record_files::read(Path::new(&file)).expect("readable");
        let ticks: Vec<u32> = read.records().map(|record| record.tick).collect();
        assert!(ticks.len() > 1000, "{name}: {} ticks", ticks.len());
        assert!(ticks.windows(2).all(|pair| pair[1] == pair[0] + 1), "{name}");
        assert!(read.boots[0].vehicle.is_some(), "{name}");
        if end_the_board {
            // The tool is still running, so it completes the file with an index.
            let bytes = std::fs::read(&file).expect("reads");
            assert!(mcap::Summary::read(&bytes).expect("whole").is_some());
        }
    }
}

/// Clients that never read, and a client that floods the board, hold up neither the board nor another client.
#[test]
fn clients_that_do_not_read_or_flood_hold_up_nobody() {
    let served = Served::new(&["--tcp", "127.0.0.1:0", "--websocket", "127.0.0.1:0"]);
    let web = served.wait_for("board at ");
    let connect = |port: &str| TcpStream::connect(port).expect("connects");
    let (tcp, address) = (&served.port["tcp:".len()..], &web["ws://".len()..]);
    let silent = connect(tcp);
    let (silent_web, _) = tungstenite::client(&web, connect(address)).expect("greeted");
    let mut flood = connect(tcp);
    std::thread::spawn(move || while flood.write_all(&[1; 8192]).is_ok() {});
    for _ in 0..3 {
        let (code, text, error) = served.link(&["status", "--seconds", "1"]);
        assert_eq!(code, Some(0), "{text} {error}");
    }
    drop((silent, silent_web));
}

/// Ctrl-C ends the server with exit code 0, and the server prints the board's log to its last line.
#[cfg(unix)]
#[test]
fn a_server_that_is_told_to_end_tells_the_last_lines_of_the_log() {
    for signal in ["-INT", "-TERM"] {
        // At this rate the server first reads the log 2 s from now, 20 ms after the boot in the board's time.
        let mut served = Served::new(&["--tcp", "127.0.0.1:0", "--rate", "0.01"]);
        let (code, _, error) = served.link(&["status", "--seconds", "0.1"]);
        assert_ne!(code, None, "{error}");
        served.server.signal(signal);
        assert!(served.wait_for("biplanar drive board").contains("power-on"));
        assert_eq!(served.server.process.wait().expect("ended").code(), Some(0), "{signal}");
    }
}

/// A WebSocket carries the link's bytes both ways: the board answers with its identity and sends its status.
#[test]
fn a_board_answers_over_a_websocket() {
    let served = Served::new(&["--websocket", "127.0.0.1:0"]);
    let address = served.port.strip_prefix("ws://").expect("a WebSocket's address");
    let stream = TcpStream::connect(address).expect("connects");
    stream.set_read_timeout(Some(GIVE_UP)).expect("a socket");
    let (mut socket, _) = tungstenite::client(&served.port, stream).expect("greeted");
    let mut client = LinkClient::new(7);
    socket.send(Message::binary(client.identify())).expect("sent");
    while client.identity().is_none() || client.status.is_none() {
        if let Message::Binary(bytes) = socket.read().expect("the board speaks") {
            client.receive(0, &bytes);
        }
    }
    assert_eq!(client.unreadable_frames, 0);
    socket.close(None).expect("told");
    served.wait_for("left");
}

#[test]
fn what_cannot_be_served_is_told_before_anything_runs() {
    for (arguments, part) in [
        (&["serve", "--tcp", "0.0.0.0:0"][..], "--any-machine"),
        (&["serve", "--websocket", "0.0.0.0:0"], "--any-machine"),
        (&["serve", "--tcp", "nowhere"], "invalid"),
        (&["serve", "--scenario", "curb"], "kerb"),
        (&["serve", "--rate", "0"], "0.01 to 100"),
        (&["serve", "--firmware", "any.elf"], "an ELF runs with --board emulated"),
        (
            &["serve", "--board", "emulated", "--firmware", "no.elf"],
            "no.elf: not a file",
        ),
        // Refused before cargo builds anything.
        (&["serve", "--board", "emulated", "--tcp", "0.0.0.0:0"], "--any-machine"),
        (&["link", "--port", "tcp:127.0.0.1:1", "status"], "tcp:127.0.0.1:1"),
    ] {
        let output = hil_sim(arguments);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}");
        assert!(stderr(&output).contains(part), "{arguments:?}: {}", stderr(&output));
    }
}
