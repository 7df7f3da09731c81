//! `drive --record` and `replay` from outside: a replay gives the recorded drive bit for bit, or the tool reports where the two
//! differ. The records of tests/records replay as they were committed.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use firmware::drive_board::SCALES;
use firmware::flight_record::FlightRecord;
use firmware::protocol::message::{Identity, PROTOCOL_VERSION};
use hil_sim::cli::record_files;
use model::tick::VehicleCore;
use model::vehicle::Vehicle;
use record_file::ReadBoot;
use record_file::run::write_run;
use record_file::writer::{RecordFormat, RecordWriter};
use virtual_board::records::first_field;

#[path = "support/tool.rs"]
mod tool;
use tool::{WORKSPACE, hil_sim, stderr};

fn path(name: &str) -> PathBuf {
    Path::new(env!("CARGO_TARGET_TMPDIR")).join(name)
}

/// The record of a drive over the kerb.
fn recorded(name: &str) -> PathBuf {
    let path = path(name);
    // An earlier run of the tests may have left the file, and the tool replaces no record.
    _ = std::fs::remove_file(&path);
    let output = hil_sim(&[
        "drive",
        "kerb",
        "--json",
        "--no-bounds",
        "--record",
        path.to_str().expect("utf-8"),
    ]);
    assert!(output.status.success(), "{}", stderr(&output));
    path
}

/// The file of a vehicle like the reference vehicle, with a top speed of 0.8 m/s instead of 2.5 m/s.
fn slow_vehicle(name: &str) -> PathBuf {
    let reference = std::fs::read_to_string(Path::new(WORKSPACE).join("vehicles/reference.toml")).expect("reads");
    let slow = path(name);
    std::fs::write(&slow, reference.replace("speed_max_m_s = 2.5", "speed_max_m_s = 0.8")).expect("writes");
    slow
}

/// The exit code, the JSON object and the errors of `replay --json`.
fn replay(file: &Path, more: &[&str]) -> (Option<i32>, serde_json::Value, String) {
    let output = hil_sim(&[&["replay", file.to_str().expect("utf-8"), "--json"], more].concat());
    let json = serde_json::from_slice(&output.stdout).unwrap_or_default();
    (output.status.code(), json, stderr(&output))
}

/// The tool refuses a record of another protocol version by its number, and does not guess the meaning of its content.
#[test]
fn a_record_of_another_protocol_is_told() {
    let vehicle = vehicle_file::reference().expect("good");
    let vehicle = Vehicle::new(vehicle.parameters().cast::<f32>()).expect("good");
    for (name, format) in [
        ("older.mcap", RecordFormat::Mcap),
        ("newer.records", RecordFormat::Frames),
    ] {
        let protocol = if format == RecordFormat::Mcap {
            PROTOCOL_VERSION - 1
        } else {
            PROTOCOL_VERSION + 1
        };
        let identity = Identity {
            protocol,
            nonce: 0,
            session: 1,
            sequence: 0,
            time_us: 0,
            about: firmware::link::about(vehicle.parameters(), 0),
        };
        let out = RecordWriter::new(format, Vec::new());
        let boot = ReadBoot {
            identity: Some(identity),
            vehicle: None,
            records: vec![FlightRecord::NONE],
            log: Vec::new(),
        };
        let bytes = write_run(out, &[vehicle], &[boot]).expect("fits");
        let file = path(name);
        std::fs::write(&file, bytes).expect("writes");
        let (code, _, error) = replay(&file, &[]);
        assert_eq!(code, Some(2), "{error}");
        let told = format!("records of protocol {protocol}, this tool reads {PROTOCOL_VERSION}");
        assert!(error.contains(&told), "{error}");
    }
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
    // 24 s, except the last tick, which may still be under way.
    assert!(json["ticks"].as_u64().expect("ticks") >= 23_999, "{json}");
    let bytes = std::fs::metadata(&file).expect("there").len();
    assert!(bytes < 24_000 * 40, "{bytes} bytes");
}

/// A vehicle with a lower top speed replays as recorded until a speed beyond its limit is commanded.
#[test]
fn another_vehicle_differs_from_a_tick_that_is_named() {
    let file = recorded("kerb-other.records");
    let other = slow_vehicle("other-gains.toml");
    let (code, json, error) = replay(&file, &["--vehicle", other.to_str().expect("utf-8")]);
    assert_eq!(code, Some(1));
    let found = &json["difference"];
    // The command at 4 s is 1 m/s, and the vehicle gets beyond 0.8 m/s within a second.
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
    assert_eq!(code, Some(0), "the part before the cut does not replay: {error}");
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

    // The second half of a drive: the record lacks the vehicle's state at its beginning.
    let late = path("late.records");
    std::fs::write(&late, &bytes[bytes.len() / 2..]).expect("writes");
    let (code, _, error) = replay(&late, &[]);
    assert_eq!(code, Some(2));
    assert!(error.contains("boot") && error.contains("--csv"), "{error}");

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

/// An MCAP file replays as a file of frames does, even if it is truncated, and contains the vehicle that drove.
#[test]
fn an_mcap_file_replays_with_its_own_vehicle_as_far_as_it_goes() {
    let file = path("kerb-slow.mcap");
    _ = std::fs::remove_file(&file);
    let slow = slow_vehicle("slow.toml");
    let [slow, name] = [&slow, &file].map(|path| path.to_str().expect("utf-8"));
    let output = hil_sim(&[
        "drive",
        "kerb",
        "--json",
        "--no-bounds",
        "--vehicle",
        slow,
        "--record",
        name,
    ]);
    assert!(output.status.success(), "{}", stderr(&output));
    let (code, json, error) = replay(&file, &[]);
    assert_eq!((code, &json["ok"]), (Some(0), &true.into()), "{error}");
    let ticks = json["ticks"].as_u64().expect("ticks");
    assert!(ticks >= 23_999, "{json}");
    // The reference vehicle drives otherwise.
    let reference = Path::new(WORKSPACE).join("vehicles/reference.toml");
    assert_eq!(
        replay(&file, &["--vehicle", reference.to_str().expect("utf-8")]).0,
        Some(1)
    );

    let bytes = std::fs::read(&file).expect("reads");
    let (cut, mut before) = (path("cut.mcap"), 0);
    for share in [10, 25, 50, 90] {
        std::fs::write(&cut, &bytes[..bytes.len() * share / 100]).expect("writes");
        let (code, json, error) = replay(&cut, &[]);
        assert_eq!(code, Some(0), "{share} %: {error}");
        let there = json["ticks"].as_u64().expect("ticks");
        assert!(there > before && there < ticks, "{share} %: {there}");
        before = there;
    }
    assert!(before > ticks * 8 / 10, "{before} of {ticks} ticks in 90 % of the file");

    // The first second alone, written as another MCAP file.
    let again = path("again.mcap");
    _ = std::fs::remove_file(&again);
    let (code, json, error) = replay(&file, &["--until", "1", "--mcap", again.to_str().expect("utf-8")]);
    assert_eq!((code, &json["ticks"]), (Some(0), &1000.into()), "{error}");
    let (code, json, error) = replay(&again, &[]);
    assert_eq!((code, &json["ticks"]), (Some(0), &1000.into()), "{error}");
    // The new file has the log of that second, unchanged.
    let log = |path: &Path| record_files::read(path).expect("readable").boots.remove(0).log;
    let (of_drive, of_second) = (log(&file), log(&again));
    let within = of_drive.iter().take_while(|line| line.time_us <= 1_000_000).count();
    assert!(within > 2 && within < of_drive.len(), "{of_drive:?}");
    assert_eq!(of_second, of_drive[..within]);
    // `--mcap` replaces no file.
    assert_eq!(replay(&file, &["--mcap", again.to_str().expect("utf-8")]).0, Some(2));
}

/// A board that loses its supply in a drive boots again. The record has both boots, and each replays from its first
/// tick.
#[test]
fn a_drive_over_a_boot_of_the_board_replays_boot_by_boot() {
    const POWER_IS_BACK_S: f64 = 4.5;
    let mut scenario = String::from("title = \"boots\"\nduration_s = 14.0\nseed = 1\n");
    for (at_s, action) in [
        (1.0, "\"arm\""),
        (2.0, "\"drive\"\nspeed_m_s = 0.5"),
        // At rest, where the gyros are calibrated.
        (3.0, "\"drive\"\nspeed_m_s = 0.0"),
        (4.0, "\"battery-contact\"\nconnected = false"),
        (POWER_IS_BACK_S, "\"battery-contact\"\nconnected = true"),
        // By now the arm has swung out, and the gyros are calibrated.
        (10.0, "\"arm\""),
        (11.0, "\"drive\"\nspeed_m_s = 0.5"),
    ] {
        writeln!(scenario, "\n[[step]]\nat_s = {at_s:?}\naction = {action}").expect("a string");
    }
    let file = path("boots.toml");
    std::fs::write(&file, scenario).expect("writes");
    for name in ["boots.records", "boots.mcap"] {
        let record = path(name);
        _ = std::fs::remove_file(&record);
        let [file, record_name] = [&file, &record].map(|path| path.to_str().expect("utf-8"));
        let out = path("boots-out");
        // With `--out` the tool also proves that the drive itself replays.
        let out = ["--out", out.to_str().expect("utf-8")];
        let output = hil_sim(&[&["drive", file, "--record", record_name], &out[..]].concat());
        assert!(output.status.success(), "{}", stderr(&output));
        let (code, json, error) = replay(&record, &[]);
        assert_eq!((code, &json["ok"]), (Some(0), &true.into()), "{error} {json}");
        let boots = json["boots"].as_array().expect("boots");
        assert_eq!(boots.len(), 2, "{json}");
        // The vehicle is armed and drives in both boots: a core that kept state from the first boot would differ in the second.
        let read = record_files::read(&record).expect("readable");
        for boot in &read.boots {
            assert_eq!(boot.records[0].tick, 1);
            assert!(boot.records.iter().filter(|record| record.actuation.enable).count() > 1000);
        }
        let shown = hil_sim(&["replay", record_name]);
        let shown = String::from_utf8_lossy(&shown.stdout).into_owned();
        assert!(shown.contains("boot 2: ") && shown.contains("bit for bit"), "{shown}");
        let (code, _, error) = replay(&record, &["--as-test", "boots"]);
        assert!(code == Some(2) && error.contains("2 boots"), "{error}");
    }
    // The file's time is the run's time, and the messages of the two boots do not mix.
    let bytes = std::fs::read(path("boots.mcap")).expect("reads");
    let messages = mcap::MessageStream::new(&bytes).expect("MCAP");
    let mut boots = Vec::new();
    let (mut restart_s, mut second_booted_s) = (0.0, 0.0);
    for message in messages.map(|message| message.expect("good")) {
        let at_s = message.log_time as f64 * 1e-9;
        let text = String::from_utf8_lossy(&message.data);
        if message.channel.topic == "/events" {
            if text.contains("the board restarts") {
                restart_s = at_s;
            }
            // A spell has the time of its start, and is reported at its end.
            continue;
        }
        boots.push(at_s >= POWER_IS_BACK_S);
        if message.channel.topic == "/log" && text.contains("reset by brown-out") {
            second_booted_s = at_s;
        }
    }
    assert!(boots.is_sorted() && boots.contains(&true));
    // The board boots within 20 ms of its supply, and its first status follows within 50 ms.
    assert!(
        (POWER_IS_BACK_S..POWER_IS_BACK_S + 0.02).contains(&second_booted_s),
        "{second_booted_s}"
    );
    assert!(
        (second_booted_s..second_booted_s + 0.05).contains(&restart_s),
        "{restart_s}"
    );
}

/// The tool refuses a record that makes no test before it writes anything.
#[test]
fn only_a_short_record_that_replays_becomes_a_test() {
    let file = recorded("kerb-as-test.records");
    let slow = slow_vehicle("as-test.toml");
    for (more, code, why) in [
        (&["--as-test", "../kerb"][..], 2, "must be of a-z"),
        (&["--as-test", "kerb"], 2, "--until"),
        (&["--as-test", "kerb", "--until", "nan"], 2, "more than 0"),
        (
            &[
                "--as-test",
                "kerb",
                "--until",
                "9",
                "--vehicle",
                slow.to_str().expect("utf-8"),
            ],
            1,
            "drives otherwise",
        ),
    ] {
        let (found, _, error) = replay(&file, more);
        assert!(
            found == Some(code) && error.contains(why),
            "{more:?}: {found:?} {error}"
        );
    }
    assert!(!Path::new(WORKSPACE).join("tests/records/kerb.records").exists());
}

/// Every committed record replays bit for bit. An intended change of behaviour is committed with the records that
/// `UPDATE_RECORDS=1` writes: the same samples and commands, with the new actuations.
#[test]
fn every_committed_record_replays() {
    let folder = Path::new(WORKSPACE).join("tests/records");
    let mut files: Vec<PathBuf> = std::fs::read_dir(&folder)
        .expect("a folder")
        .map(|entry| entry.expect("an entry").path())
        .filter(|path| path.extension().is_some_and(|extension| extension == "records"))
        .collect();
    files.sort();
    assert!(!files.is_empty(), "{}", folder.display());
    for path in files {
        let shown = path.display();
        let mut file = record_files::read(&path).expect("readable");
        assert_eq!((file.lost_blocks, file.unreadable), (0, 0), "{shown}");
        let other = path.with_extension("toml");
        let vehicle = if other.exists() {
            vehicle_file::read_vehicle(&other)
        } else {
            vehicle_file::reference()
        };
        let vehicle = vehicle.unwrap_or_else(|error| panic!("{error}"));
        let vehicle = Vehicle::new(vehicle.parameters().cast::<f32>()).expect("valid");
        let mut core = VehicleCore::new(&vehicle, &SCALES);
        let mut differs = None;
        let [boot] = &mut file.boots[..] else {
            panic!("{shown}: {} boots", file.boots.len())
        };
        for (record, tick) in boot.records.iter_mut().zip(1_u32..) {
            assert_eq!(
                record.tick, tick,
                "{shown}: the ticks do not begin at the boot, or have a gap"
            );
            let actuation = core.step(&record.sample, &record.command).actuation;
            differs = differs.or_else(|| first_field(record.actuation, actuation).map(|field| (tick, field)));
            record.actuation = actuation;
        }
        assert!(
            boot.records.iter().any(|record| record.actuation.enable),
            "{shown}: the vehicle is never armed"
        );
        let Some((tick, (field, recorded, replayed))) = differs else {
            continue;
        };
        assert!(
            std::env::var_os("UPDATE_RECORDS").is_some(),
            "{shown}: tick {tick}: {field} is {replayed}, the record has {recorded}. If that is meant: \
             UPDATE_RECORDS=1 cargo test -p hil-sim --test replay every_committed"
        );
        let out = RecordWriter::new(RecordFormat::Frames, Vec::new());
        boot.log.clear();
        let bytes = write_run(out, &[vehicle], &file.boots).expect("fits");
        std::fs::write(&path, bytes).expect("writes");
    }
}
