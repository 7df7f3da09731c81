//! `drive --record` and `replay` from outside: what was driven comes back bit for bit, or it is told where it does not.

use std::path::{Path, PathBuf};

#[path = "support/tool.rs"]
mod tool;
use tool::{WORKSPACE, hil_sim, stderr};

fn path(name: &str) -> PathBuf {
    Path::new(env!("CARGO_TARGET_TMPDIR")).join(name)
}

/// The record of a drive over the kerb.
fn recorded(name: &str) -> PathBuf {
    let path = path(name);
    // Of an earlier run of the tests: the tool replaces no record.
    _ = std::fs::remove_file(&path);
    let output = hil_sim(&["drive", "kerb", "--json", "--record", path.to_str().expect("utf-8")]);
    assert!(output.status.success(), "{}", stderr(&output));
    path
}

/// What `replay --json` says: exit code, object, errors.
fn replay(file: &Path, more: &[&str]) -> (Option<i32>, serde_json::Value, String) {
    let output = hil_sim(&[&["replay", file.to_str().expect("utf-8"), "--json"], more].concat());
    let json = serde_json::from_slice(&output.stdout).unwrap_or_default();
    (output.status.code(), json, stderr(&output))
}

#[test]
fn a_recorded_drive_replays_to_the_bit() {
    let file = recorded("kerb.records");
    let (code, json, error) = replay(&file, &[]);
    assert_eq!(code, Some(0), "{error}");
    assert_eq!(
        (&json["ok"], &json["difference"]),
        (&true.into(), &serde_json::Value::Null)
    );
    // 24 s, but for the last tick, which may still be under way.
    assert!(json["ticks"].as_u64().expect("ticks") >= 23_999, "{json}");
    let bytes = std::fs::metadata(&file).expect("there").len();
    assert!(bytes < 24_000 * 40, "{bytes} bytes");
}

/// A vehicle that may not go as fast drives as recorded until it is told to.
#[test]
fn another_vehicle_differs_from_a_tick_that_is_named() {
    let file = recorded("kerb-other.records");
    let reference = std::fs::read_to_string(Path::new(WORKSPACE).join("vehicles/reference.toml")).expect("reads");
    let other = path("other-gains.toml");
    std::fs::write(&other, reference.replace("speed_max_m_s = 2.5", "speed_max_m_s = 0.8")).expect("writes");
    let (code, json, error) = replay(&file, &["--vehicle", other.to_str().expect("utf-8")]);
    assert_eq!(code, Some(1));
    let found = &json["difference"];
    // It is told to drive 1 m/s at 4 s, and gets beyond 0.8 m/s within a second.
    let at_s = found["at_s"].as_f64().expect("a time");
    assert!((4.0..5.0).contains(&at_s), "{json}");
    assert!(found["field"].as_str().expect("a name").contains("duty"), "{json}");
    assert!(error.contains(&format!("tick {}", found["tick"])), "{error}");
}

#[test]
fn what_is_cut_missing_or_no_record_is_told() {
    let file = recorded("kerb-cut.records");
    let bytes = std::fs::read(&file).expect("reads");
    let cut = path("cut.records");
    std::fs::write(&cut, &bytes[..bytes.len() / 3]).expect("writes");
    let (code, json, error) = replay(&cut, &[]);
    assert_eq!(code, Some(0), "what was written before is a whole drive: {error}");
    assert!(
        (6_000..12_000).contains(&json["ticks"].as_u64().expect("ticks")),
        "{json}"
    );

    // Bytes lost in the middle: the ticks before them replay, and the rest is named.
    let hole = path("hole.records");
    let (start, end) = (bytes.len() / 3, bytes.len() / 2);
    std::fs::write(&hole, [&bytes[..start], &bytes[end..]].concat()).expect("writes");
    let (code, json, error) = replay(&hole, &[]);
    assert_eq!(code, Some(1));
    assert!(
        error.contains("are missing") && json["difference"].is_null(),
        "{error} {json}"
    );
    assert!(json["lost_blocks"].as_u64().expect("blocks") > 0);

    // The middle of a drive alone: what the vehicle knew by then is not in it.
    let late = path("late.records");
    std::fs::write(&late, &bytes[bytes.len() / 2..]).expect("writes");
    let (code, _, error) = replay(&late, &[]);
    assert_eq!(code, Some(2));
    assert!(error.contains("boot"), "{error}");

    for (name, contents) in [
        ("empty.records", &b""[..]),
        ("noise.records", b"\x01\x02no records\x00"),
    ] {
        std::fs::write(path(name), contents).expect("writes");
        let (code, _, error) = replay(&path(name), &[]);
        assert_eq!(code, Some(2), "{name}");
        assert!(error.contains("no records in it"), "{error}");
    }
    assert_eq!(replay(&path("nowhere.records"), &[]).0, Some(2));
}

#[test]
fn a_record_that_cannot_be_written_is_told_before_the_drive() {
    let output = hil_sim(&["drive", "kerb", "--json", "--record", "/nowhere/at/all.records"]);
    assert_eq!(output.status.code(), Some(2), "{}", stderr(&output));
    assert!(output.stdout.is_empty());
}
