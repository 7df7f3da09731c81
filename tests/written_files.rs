//! The files that the tool writes: it destroys no existing file, and loses nothing that it has written.

use std::path::{Path, PathBuf};
use std::process::Command;

#[path = "support/tool.rs"]
mod tool;
use tool::{hil_sim, stderr};

fn folder(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    std::fs::create_dir_all(&folder).expect("a folder");
    folder
}

/// Asserts that a file of records replays bit for bit.
#[cfg(unix)]
fn replays_to_the_bit(file: &std::path::Path) {
    let replay = hil_sim(&["replay", file.to_str().expect("utf-8")]);
    let text = String::from_utf8_lossy(&replay.stdout).into_owned();
    assert!(
        replay.status.success() && text.contains("bit for bit"),
        "{}: {text} {}",
        file.display(),
        stderr(&replay)
    );
}

/// A full disk ends the record of a run, and the written part replays.
#[cfg(unix)]
#[test]
fn what_a_full_disk_took_of_a_record_replays() {
    let place = folder("full-disk");
    for name in ["run.mcap", "run.records"] {
        let file = place.join(name);
        let _ = std::fs::remove_file(&file);
        // Here no file may grow beyond 200 blocks: a larger write fails.
        let limits = "trap '' XFSZ; ulimit -f 200; exec \"$0\" drive kerb --no-bounds --json --record \"$1\"";
        let output = Command::new("sh")
            .args(["-c", limits, env!("CARGO_BIN_EXE_hil-sim"), name])
            .current_dir(&place)
            .output()
            .expect("runs");
        assert_ne!(output.status.code(), Some(0), "{name}");
        let told = stderr(&output);
        for part in ["File too large", "--record: ", name, "stays in it"] {
            assert!(told.contains(part), "{name}: {told}");
        }
        // The tool still reports the drive itself.
        let text = String::from_utf8_lossy(&output.stdout).into_owned();
        assert!(text.contains("\"simulated_s\":24"), "{name}: {text}");
        replays_to_the_bit(&file);
    }
}

/// When the disk is full, the message names the flag and the file of a file that is written whole or not at all, and standard output
/// as such.
#[cfg(target_os = "linux")]
#[test]
fn a_full_disk_is_named() {
    let place = folder("full-disk-replay");
    let [record, mcap] = ["run.records", "again.mcap"].map(|name| place.join(name));
    for file in [&record, &mcap] {
        let _ = std::fs::remove_file(file);
    }
    let [record, mcap] = [&record, &mcap].map(|path| path.to_str().expect("utf-8"));
    assert!(
        hil_sim(&["drive", "kerb", "--no-bounds", "--json", "--record", record])
            .status
            .success()
    );
    let limited = |line: &str| {
        let line = format!("trap '' XFSZ; ulimit -f 100; exec \"$0\" {line}");
        let output = Command::new("sh")
            .args(["-c", &line, env!("CARGO_BIN_EXE_hil-sim"), record, mcap])
            .output();
        stderr(&output.expect("runs"))
    };
    let told = limited("replay \"$1\" --mcap \"$2\"");
    assert!(told.contains(&format!("--mcap: cannot write {mcap}: ")), "{told}");
    assert!(!told.contains(".part-") && !told.contains("directory"), "{told}");
    assert!(!Path::new(mcap).exists());
    let told = limited("replay \"$1\" > /dev/full");
    assert!(told.contains("standard output: No space left on device"), "{told}");
}

/// A recorded drive that is killed leaves its record, up to that moment, under the file's own name, and the record replays.
#[cfg(unix)]
#[test]
fn what_a_killed_drive_has_recorded_replays() {
    /// More than the first chunk of an MCAP file, and far less than the whole drive.
    const ENOUGH_BYTES: u64 = 1 << 20;
    let place = folder("killed");
    let scenario = place.join("long.toml");
    // The longest duration that a scenario may have.
    let text = "title = 'long'\nduration_s = 3600.0\n[[step]]\nat_s = 2.0\naction = 'arm'\n";
    std::fs::write(&scenario, text).expect("writes");
    for name in ["run.mcap", "run.records"] {
        let file = place.join(name);
        let _ = std::fs::remove_file(&file);
        let mut drive = Command::new(env!("CARGO_BIN_EXE_hil-sim"))
            .args(["drive", "long.toml", "--json", "--record", name])
            .current_dir(&place)
            .stdout(std::process::Stdio::null())
            .stderr(std::process::Stdio::null())
            .spawn()
            .expect("runs");
        while std::fs::metadata(&file).map_or(0, |file| file.len()) < ENOUGH_BYTES {
            assert!(
                drive.try_wait().expect("asked").is_none(),
                "{name}: the drive ended by itself"
            );
            std::thread::sleep(std::time::Duration::from_millis(10));
        }
        // SIGKILL: the program cannot react.
        drive.kill().expect("killed");
        drive.wait().expect("gone");
        replays_to_the_bit(&file);
    }
}

/// A drive that cannot begin leaves no record, so that the command can be given again.
#[test]
fn a_drive_that_cannot_begin_leaves_no_record() {
    let place = folder("never-begun");
    let (record, out) = (place.join("run.mcap"), place.join("a-file"));
    let _ = std::fs::remove_file(&record);
    std::fs::write(&out, "no directory").expect("writes");
    let [record_name, out_name] = [&record, &out].map(|path| path.to_str().expect("utf-8"));
    for wrong in [
        &["--out", out_name][..],
        &["--vehicle", "no-such-vehicle.toml"],
        &["--plant-vehicle", "no-such-vehicle.toml"],
    ] {
        let output = hil_sim(&[&["drive", "kerb", "--record", record_name][..], wrong].concat());
        assert_eq!(output.status.code(), Some(2), "{wrong:?}: {}", stderr(&output));
        assert!(!record.exists(), "{wrong:?}");
    }
}

/// Every command that writes one file refuses to replace an existing file, before it does anything.
#[test]
fn a_file_that_exists_is_not_overwritten() {
    let folder = folder("existing");
    let file = folder.join("precious");
    std::fs::write(&file, "precious").expect("writes");
    let file = file.to_str().expect("utf-8");
    for arguments in [
        &["drive", "kerb", "--json", "--record", file][..],
        &[
            "campaign",
            "run",
            "tests/scenarios/kerb.toml",
            "--seeds",
            "1",
            "--out",
            file,
        ],
        &["link", "--port", "no-port", "record", "--out", file],
        &["link", "--port", "no-port", "look-back", "--out", file],
    ] {
        let output = hil_sim(arguments);
        let message = stderr(&output);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}: {message}");
        assert!(
            message.contains(file) && message.contains("exists already; choose another name"),
            "{arguments:?}: {message}"
        );
        assert_eq!(
            std::fs::read_to_string(file).expect("there"),
            "precious",
            "{arguments:?}"
        );
    }
}

#[test]
fn a_record_and_the_results_of_a_campaign_are_named_and_merging_keeps_what_is_there() {
    let folder = folder("written");
    let path = |name: &str| folder.join(name).to_str().expect("utf-8").to_owned();
    let (record, part, out) = (path("record"), path("part"), path("out"));
    for file in [&record, &part] {
        let _ = std::fs::remove_file(file);
    }
    let output = hil_sim(&["drive", "kerb", "--record", &record, "--out", &out]);
    assert!(output.status.success(), "{}", stderr(&output));
    let told = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(
        told.contains(&record) && std::path::Path::new(&record).exists(),
        "{told}"
    );
    let run = [
        "campaign",
        "run",
        "tests/scenarios/kerb.toml",
        "--seeds",
        "1",
        "--out",
        &part,
    ];
    assert!(hil_sim(&run).status.success());
    let before = std::fs::read(&part).expect("there");
    let output = hil_sim(&["campaign", "merge", &part, "--out", &part]);
    assert_eq!(output.status.code(), Some(2));
    assert!(stderr(&output).contains("exists already"), "{}", stderr(&output));
    assert_eq!(std::fs::read(&part).expect("there"), before);
}

/// A wrong command line or port leaves no empty file, because of which the corrected command would fail.
#[test]
fn a_link_command_that_never_began_leaves_no_file() {
    let folder = folder("link-files");
    let file = folder.join("drive.rec");
    let name = file.to_str().expect("utf-8");
    for arguments in [
        &["link", "--port", "no-such-port", "record", "--out", name][..],
        &[
            "link",
            "--port",
            "tcp:127.0.0.1:1",
            "record",
            "--out",
            name,
            "--seconds",
            "0",
        ],
        &["link", "--port", "no-such-port", "look-back", "--out", name],
        &["link", "record", "--out", name],
    ] {
        let output = hil_sim(arguments);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}: {}", stderr(&output));
        assert!(!file.exists(), "{arguments:?}");
    }
}
