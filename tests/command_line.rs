//! The command line of `drive` from outside: files, exit codes, messages.

use std::io::{BufRead as _, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

#[path = "support/tool.rs"]
mod tool;
use tool::{WORKSPACE, hil_sim, stderr};

fn folder(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    std::fs::create_dir_all(&folder).expect("a folder");
    folder
}

/// A folder with the name of a scenario, as a report leaves, does not hide the scenario.
#[test]
fn a_folder_is_no_scenario() {
    let place = folder("a-folder-is-no-scenario");
    std::fs::create_dir_all(place.join("kerb")).expect("a folder");
    let output = Command::new(env!("CARGO_BIN_EXE_hil-sim"))
        .args(["drive", "kerb", "--json"])
        .current_dir(&place)
        .output()
        .expect("runs");
    assert!(output.status.success(), "{}", stderr(&output));
}

#[test]
fn drive_writes_its_report_and_says_where() {
    let out = folder("drive");
    let output = hil_sim(&["drive", "--out", out.to_str().expect("utf-8")]);
    assert!(output.status.success(), "{}", stderr(&output));
    let table = String::from_utf8_lossy(&output.stdout);
    for part in [
        "speed error",
        "phi, peak",
        "camera spar",
        "motor current",
        "tick on this host",
        out.to_str().expect("utf-8"),
    ] {
        assert!(table.contains(part), "{part}: {table}");
    }
    for file in [
        "trace.csv",
        "speed.svg",
        "phi.svg",
        "spar.svg",
        "path.svg",
        "current.svg",
        "firmware.log",
        "index.html",
    ] {
        assert!(std::fs::metadata(out.join(file)).expect(file).len() > 500, "{file}");
    }
}

#[test]
fn drive_prints_one_json_object() {
    let output = hil_sim(&["drive", "tests/scenarios/zero-radius-turn.toml", "--json"]);
    assert!(output.status.success(), "{}", stderr(&output));
    let json: serde_json::Value = serde_json::from_slice(&output.stdout).expect("one object");
    assert_eq!(json["ok"], true);
    let turned = json["metrics"]
        .as_array()
        .expect("metrics")
        .iter()
        .find(|m| m["name"] == "yaw_rate_peak_rad_s");
    assert!((turned.expect("there")["value"].as_f64().expect("number") - 0.785).abs() < 0.05);
}

#[test]
fn another_seed_is_another_run_and_the_same_seed_the_same() {
    let run = |seed: &str| hil_sim(&["drive", "tests/scenarios/kerb.toml", "--json", "--seed", seed]).stdout;
    assert_eq!(run("5"), run("5"));
    assert_ne!(run("5"), run("6"));
}

#[test]
fn a_metric_out_of_bounds_ends_with_1_and_names_it_with_the_seed() {
    let folder = folder("bounds");
    let scenario = folder.join("s.toml");
    std::fs::write(
        &scenario,
        "title = \"t\"\nduration_s = 2.0\n[metrics]\narmed_s = [5.0, 6.0]\n",
    )
    .expect("writes");
    let output = hil_sim(&["drive", scenario.to_str().expect("utf-8"), "--json"]);
    assert_eq!(output.status.code(), Some(1));
    let message = stderr(&output);
    assert!(
        message.contains("armed_s = 0 is not within 5 to 6") && message.contains("seed 1"),
        "{message}"
    );
}

#[test]
fn bad_vehicles_end_with_2_and_name_file_field_and_range() {
    let folder = folder("vehicles");
    let reference = std::fs::read_to_string(Path::new(WORKSPACE).join("vehicles/reference.toml")).expect("there");
    for (name, from, to, parts) in [
        (
            "nan",
            "wheel_radius_m = 0.25",
            "wheel_radius_m = nan",
            ["body.wheel_radius_m = NaN", "0.01 to 2"],
        ),
        (
            "missing",
            "gear_ratio = 43.0",
            "",
            ["drive_motor.gear_ratio is missing", "1 to 1000"],
        ),
        (
            "alpha",
            "arm_mass_kg = 12.24",
            "arm_mass_kg = 14.0",
            ["body.arm_mass_kg = 14", "alpha"],
        ),
        (
            "length",
            "arm_length_m = 0.20",
            "arm_length_m = 0.0",
            ["body.arm_length_m = 0", "0.005 to 2"],
        ),
        (
            "unknown",
            "[body]",
            "[body]\nwings = 2",
            ["unknown name `body.wings`", "wheel_radius_m"],
        ),
    ] {
        assert!(reference.contains(from), "{from}");
        let file = folder.join(format!("{name}.toml"));
        std::fs::write(&file, reference.replace(from, to)).expect("writes");
        let file = file.to_str().expect("utf-8");
        let output = hil_sim(&["drive", "--vehicle", file]);
        assert_eq!(output.status.code(), Some(2), "{name}");
        let message = stderr(&output);
        assert!(message.contains(file), "{message}");
        for part in parts {
            assert!(message.contains(part), "{name}: {message}");
        }
    }
}

#[test]
fn unreadable_files_unknown_flags_and_bad_values_end_with_2() {
    for arguments in [
        &["drive", "no/such/file.toml"][..],
        &["drive", "--vehicle", "no/such/file.toml"],
        &["drive", "--vehicle", "README.md"],
        &["drive", "--seed", "many"],
        &["drive", "--wings"],
        &["fly"],
    ] {
        let output = hil_sim(arguments);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}: {}", stderr(&output));
        assert!(!stderr(&output).is_empty());
        assert!(output.stdout.is_empty());
    }
}

#[test]
fn messages_name_the_flag_and_what_is_allowed() {
    for (arguments, parts) in [
        (&["drive", "--seed", "-1"][..], &["a whole number from 0"][..]),
        (&["drive", "--seed", "1.5"], &["a whole number from 0"]),
        (
            &["drive", "--record", "/no/dir/x", "--json"],
            &["--record: cannot write /no/dir/x: "],
        ),
        (
            &["drive", "vehicles/small.toml"],
            &["this is a vehicle file", "--vehicle"],
        ),
        (
            &["check", "tests/scenarios/kerb.toml"],
            &["this is a scenario", "hil-sim drive"],
        ),
        (&["link", "status"], &["--port is missing", "tcp:HOST:PORT"]),
        (
            &["link", "--port", "README.md", "status"],
            &["--port README.md: is not a serial port"],
        ),
        (
            &["link", "status", "--port", "docs"],
            &["--port docs: is not a serial port"],
        ),
        (
            &["link", "--port", "tcp:127.0.0.1", "status"],
            &["allowed is tcp:HOST:PORT, as tcp:127.0.0.1:5760"],
        ),
        (
            &["serve", "--tcp", "5760"],
            &["an IP address and a port, as 127.0.0.1:5760"],
        ),
    ] {
        let output = hil_sim(arguments);
        let message = stderr(&output);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}: {message}");
        for part in parts {
            assert!(message.contains(part), "{arguments:?}: {message}");
        }
        for part in ["use '--", ".part-", "Not a typewriter"] {
            assert!(!message.contains(part), "{arguments:?}: {message}");
        }
    }
}

/// Runs a program as on a machine without the board's toolchain; a program that calls cargo fails.
#[cfg(unix)]
fn without_toolchain(name: &str, program: &str, arguments: &[&str]) -> std::process::Output {
    use std::os::unix::fs::PermissionsExt as _;

    let shims = folder(name);
    for (tool, text) in [("rustup", "exit 1"), ("cargo", "echo built >&2; exit 99")] {
        let path = shims.join(tool);
        std::fs::write(&path, format!("#!/bin/sh\n{text}\n")).expect("writes");
        std::fs::set_permissions(&path, std::fs::Permissions::from_mode(0o755)).expect("a program");
    }
    let path = std::env::var("PATH").expect("a path");
    Command::new(program)
        .args(arguments)
        .current_dir(WORKSPACE)
        .env("PATH", format!("{}:{path}", shims.display()))
        .env_remove("FIRMWARE_ELF")
        .output()
        .expect("runs")
}

#[cfg(unix)]
#[test]
fn without_the_boards_toolchain_one_line_names_the_remedy_before_anything_is_built() {
    let remedy = "build-board: the toolchain cannot build for thumbv7em-none-eabihf: run .ci/setup-target";
    for arguments in [&[][..], &["--check"]] {
        let output = without_toolchain("build-board", ".ci/build-board", arguments);
        assert_eq!(output.status.code(), Some(1));
        assert_eq!(stderr(&output).trim_end(), remedy);
    }
    let program = env!("CARGO_BIN_EXE_hil-sim");
    let output = without_toolchain("emulated", program, &["drive", "--board", "emulated"]);
    assert_eq!(output.status.code(), Some(2), "{}", stderr(&output));
    assert_eq!(stderr(&output).trim_end(), format!("error: --board emulated: {remedy}"));
    for (elf, why) in [
        (
            "README.md",
            "no ELF; leave the flag out to run the firmware of this workspace",
        ),
        ("docs", "not a file"),
    ] {
        let arguments = ["drive", "--board", "emulated", "--firmware", elf];
        let output = without_toolchain("emulated-elf", program, &arguments);
        assert_eq!(output.status.code(), Some(2));
        assert_eq!(stderr(&output).trim_end(), format!("error: --firmware: {elf}: {why}"));
    }
    let arguments = ["drive", "--board", "emulated", "--firmware", "no-such.elf"];
    let output = without_toolchain("emulated-elf", program, &arguments);
    assert_eq!(output.status.code(), Some(2));
    assert_eq!(stderr(&output).trim_end(), "error: --firmware: no-such.elf: not a file");
}

/// Completions and manual know every command that the help lists.
#[test]
fn every_shell_gets_completions_and_every_command_a_page() {
    let help = hil_sim(&["--help"]);
    let help = String::from_utf8_lossy(&help.stdout).into_owned();
    let (_, list) = help.split_once("Commands:\n").expect("a list");
    let commands: Vec<&str> = list
        .lines()
        .take_while(|line| !line.trim().is_empty())
        .filter_map(|line| {
            line.strip_prefix("  ")?
                .split_whitespace()
                .next()
                .filter(|_| !line.starts_with("   "))
        })
        .collect();
    assert!(commands.contains(&"drive") && commands.len() > 20, "{commands:?}");
    for shell in ["bash", "zsh", "fish", "powershell", "elvish"] {
        let output = hil_sim(&["completions", shell]);
        let script = String::from_utf8_lossy(&output.stdout).into_owned();
        for command in &commands {
            assert!(script.contains(command), "{shell}: {command}");
        }
    }
    let out = folder("man");
    let output = hil_sim(&["man", "--out", out.to_str().expect("utf-8")]);
    assert!(output.status.success(), "{}", stderr(&output));
    for command in commands.iter().filter(|command| **command != "help") {
        let page = std::fs::read_to_string(out.join(format!("hil-sim-{command}.1"))).expect(command);
        assert!(page.contains(".SH NAME") && page.contains("Examples:"), "{page}");
    }
    let page = String::from_utf8_lossy(&hil_sim(&["man"]).stdout).into_owned();
    assert!(page.contains(".TH hil-sim 1"), "{page}");
}

/// As in `serve | head -1`: after the address nobody reads on. The board keeps serving its clients, and Ctrl-C ends the server
/// without a message.
#[cfg(unix)]
#[test]
fn a_server_whose_words_nobody_reads_goes_on() {
    let mut server = Command::new(env!("CARGO_BIN_EXE_hil-sim"))
        .arg("serve")
        .args(["--tcp", "127.0.0.1:0"])
        .current_dir(WORKSPACE)
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("it starts");
    let mut line = String::new();
    let words = server.stdout.take().expect("piped");
    // `read_line` is the reader's last call: dropping the reader closes the pipe.
    BufReader::new(words).read_line(&mut line).expect("its address");
    let port = line.trim().strip_prefix("board at ").unwrap_or(&line);
    // The server reports each client that comes and goes, into the closed pipe.
    let answers = [(); 2].map(|()| hil_sim(&["link", "--port", port, "status", "--seconds", "0.5"]));
    let goes_on = server.try_wait().expect("waits").is_none();
    let stopped = Command::new("kill").args(["-INT", &server.id().to_string()]).status();
    let ended = server.wait_with_output().expect("ended");
    for answer in answers {
        assert_eq!(answer.status.code(), Some(0), "{port}: {}", stderr(&answer));
    }
    assert!(goes_on && stopped.expect("runs").success());
    assert_eq!((ended.status.code(), stderr(&ended)), (Some(0), String::new()));
}
