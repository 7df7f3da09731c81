//! Small inputs that once failed (`tests/cases`), and others of their kind.

use std::path::{Path, PathBuf};
use std::process::Command;

#[path = "support/tool.rs"]
mod tool;
use tool::{WORKSPACE, hil_sim, hil_sim_refuses, stderr};

fn case(name: &str) -> String {
    std::fs::read_to_string(Path::new(WORKSPACE).join("tests/cases").join(name)).expect("a case")
}

/// Writes a file into this test binary's own folder.
fn own(name: &str, text: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("cases");
    std::fs::create_dir_all(&folder).expect("a folder");
    let path = folder.join(name);
    std::fs::write(&path, text).expect("writes");
    path
}

/// Writes a vehicle file into this test binary's own folder: the values of `text`, and the reference vehicle's for all others.
fn own_vehicle(name: &str, text: &str) -> PathBuf {
    let mut whole: toml::Table = vehicle_file::REFERENCE.parse().expect("the reference vehicle");
    for (table, given) in text.parse::<toml::Table>().expect("the case") {
        let known = whole.get_mut(&table).and_then(toml::Value::as_table_mut);
        known
            .expect("a table of the vehicle file")
            .extend(given.as_table().expect("a table").clone());
    }
    own(name, &whole.to_string())
}

fn utf8(path: &Path) -> &str {
    path.to_str().expect("utf-8")
}

#[test]
fn every_case_file_has_its_line() {
    let readme = case("README.md");
    let mut named: Vec<&str> = readme
        .lines()
        .filter_map(|line| line.strip_prefix("| `")?.split('`').next())
        .collect();
    named.sort_unstable();
    let mut files: Vec<String> = std::fs::read_dir(Path::new(WORKSPACE).join("tests/cases"))
        .expect("the folder")
        .map(|entry| entry.expect("an entry").file_name().to_string_lossy().into_owned())
        .filter(|name| name != "README.md")
        .collect();
    files.sort();
    assert_eq!(named, files);
}

/// Where a test of the table of kinds may stand.
const PLACES: [&str; 3] = ["tests", "hil-sim/virtual-board/tests", "hil-sim/board-emulator/tests"];

#[test]
fn every_kind_of_fault_has_its_tests() {
    let readme = case("README.md");
    let (_, kinds) = readme.split_once("## Kinds").expect("the table");
    let (kinds, taken_out) = kinds.split_once("## Taken out").expect("the second table");
    let rows: Vec<Vec<&str>> = kinds
        .lines()
        .filter(|line| line.starts_with("| ") && !line.starts_with("| No."))
        .map(|line| line.split(" | ").collect())
        .collect();
    let numbers: Vec<String> = rows.iter().map(|row| row[0].replace("| ", "")).collect();
    let expected: Vec<String> = (1..=21).map(|number: u32| number.to_string()).collect();
    assert_eq!(numbers, expected);
    let mut open = Vec::new();
    let mut tried = Vec::new();
    for (number, row) in numbers.iter().zip(&rows) {
        let tests: Vec<&str> = row[2].split('`').skip(1).step_by(2).collect();
        if tests.is_empty() {
            open.push(number.as_str());
        }
        for test in tests {
            let (file, name) = test.split_once("::").expect("file::test");
            let test = format!("fn {name}()");
            let found = PLACES.iter().any(|place| {
                let path = Path::new(WORKSPACE).join(place).join(format!("{file}.rs"));
                std::fs::read_to_string(path).is_ok_and(|text| text.contains(&test))
            });
            assert!(found, "kind {number}: {file}.rs has no test {name}");
            tried.push(format!("| {number} | `{file}::{name}` | "));
        }
    }
    // Each test of a kind has been seen to fail.
    for row in &tried {
        let rows: Vec<&str> = taken_out.lines().filter(|line| line.starts_with(row)).collect();
        assert!(!rows.is_empty(), "no row says what was taken out: {row}");
        for row in rows {
            assert_eq!(
                row.split('|').filter(|cell| !cell.trim().is_empty()).count(),
                4,
                "{row}"
            );
        }
    }
    let known = |line: &str| tried.iter().any(|row| line.starts_with(row));
    let mut lines = taken_out
        .lines()
        .filter(|line| line.starts_with("| ") && !line.starts_with("| No."));
    assert!(lines.all(known), "a row of a test that the kinds do not name");
    assert!(open.is_empty(), "kinds without a test: {open:?}");
}

#[test]
fn noise_without_end_is_refused_with_its_range() {
    let output = hil_sim_refuses(&["drive", "tests/cases/link-noise-4g.toml", "--json"]);
    assert_eq!(output.status.code(), Some(2), "{}", stderr(&output));
    let expected = "step[0].bytes = 4294967295: allowed is 0 to 1000000";
    assert!(stderr(&output).contains(expected), "{}", stderr(&output));
    for bytes in ["1000001", "-1", "1e9", "nan"] {
        let text = case("link-noise-4g.toml").replace("4294967295", bytes);
        let output = hil_sim(&["drive", utf8(&own("noise.toml", &text)), "--json"]);
        assert_eq!(output.status.code(), Some(2), "{bytes}: {}", stderr(&output));
    }
}

#[test]
fn a_vehicle_that_is_no_number_ends_the_run_with_its_reason() {
    let vehicle = case("vehicle-that-is-nan.toml");
    assert!(vehicle.contains("motor_mass_kg = 0.0"));
    for (from, to) in [
        ("", ""),
        ("motor_distance_m = 5.0", "motor_distance_m = 4.0"),
        ("2.43876275695425", "2.0"),
    ] {
        assert!(vehicle.contains(from), "{from} is not in the file");
        let file = own_vehicle("nan.toml", &vehicle.replacen(from, to, 1));
        let output = hil_sim(&[
            "drive",
            "tests/cases/nan-passes.toml",
            "--json",
            "--vehicle",
            utf8(&file),
        ]);
        let message = stderr(&output);
        assert_eq!(output.status.code(), Some(1), "{to}: {message}");
        assert!(output.stdout.is_empty(), "{to}: the tool prints a result all the same");
        assert!(
            message.contains("left the plant's validity") && message.contains("nan-passes.toml (seed 1)"),
            "{to}: {message}"
        );
    }
    // The reference vehicle, whose state stays finite, keeps the same bounds.
    let output = hil_sim(&["drive", "tests/cases/nan-passes.toml", "--json"]);
    assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
}

#[test]
fn a_motor_stiffer_than_any_substep_is_simulated_without_a_panic() {
    let vehicle = case("vehicle-that-panics.toml");
    for (from, to) in [
        ("", ""),
        ("resistance_ohm = 0.002", "resistance_ohm = 0.001"),
        ("gear_ratio = 28.0", "gear_ratio = 1000.0"),
        ("rotor_inertia_kg_m2 = 0.000001", "rotor_inertia_kg_m2 = 0.0"),
    ] {
        assert!(vehicle.contains(from), "{from}");
        let file = own_vehicle("stiff.toml", &vehicle.replacen(from, to, 1));
        let output = hil_sim(&[
            "drive",
            "tests/cases/nan-passes.toml",
            "--json",
            "--vehicle",
            utf8(&file),
        ]);
        assert_eq!(output.status.code(), Some(0), "{to}: {}", stderr(&output));
        let json: serde_json::Value = serde_json::from_slice(&output.stdout).expect("one object");
        let metrics = json["metrics"].as_array().expect("metrics");
        let value = |name: &str| metrics.iter().find(|m| m["name"] == name).expect("there")["value"].as_f64();
        assert!(value("spar_peak_deg").expect("a number") < 90.0, "{to}");
    }
}

#[test]
fn a_metric_that_is_no_number_is_null_and_fails_its_bound() {
    let text = "title = \"t\"\nduration_s = 1.0\n[metrics]\nemergency_stop_ms = [0.0, 1000.0]\n";
    let output = hil_sim(&["drive", utf8(&own("null.toml", text)), "--json"]);
    assert_eq!(output.status.code(), Some(1), "{}", stderr(&output));
    let json: serde_json::Value = serde_json::from_slice(&output.stdout).expect("one object");
    assert!(json["checks"][0]["value"].is_null() && json["checks"][0]["ok"] == false);
}

/// A record whose metadata claim a name of gigabytes: the tool reads it within the memory of every refusal.
#[test]
fn a_damaged_length_in_a_record_asks_for_no_memory() {
    for length in [0xE000_0000_u32, u32::MAX] {
        let body = [&length.to_le_bytes()[..], b"board"].concat();
        let mut file = b"\x89MCAP0\r\n\x0C".to_vec();
        file.extend((body.len() as u64).to_le_bytes());
        file.extend(body);
        let path = own("damaged-length.mcap", "");
        std::fs::write(&path, file).expect("writes");
        let output = hil_sim_refuses(&["replay", utf8(&path)]);
        let message = stderr(&output);
        assert_eq!(output.status.code(), Some(2), "{message}");
        assert!(message.contains("damaged-length.mcap"), "{message}");
    }
}

#[test]
fn files_that_never_end_are_refused() {
    let long = own("long.toml", "");
    let file = std::fs::File::options().write(true).open(&long).expect("opens");
    file.set_len(100 << 20).expect("a sparse file");
    let mut endless = vec![std::env::temp_dir()];
    if cfg!(unix) {
        endless.push("/dev/zero".into());
        // An earlier run may have left the pipe: writing to the pipe would wait for a reader.
        let pipe = own("beside-the-pipe", "").with_file_name("pipe");
        let _ = std::fs::remove_file(&pipe);
        let made = Command::new("mkfifo").arg(&pipe).status().expect("mkfifo runs");
        assert!(made.success(), "{made}");
        endless.push(pipe);
    }
    // Files of records and of results may be long.
    for path in &endless {
        let merged = own("merged.jsonl", "").with_file_name("no-such-file.jsonl");
        for arguments in [
            &["replay", utf8(path)][..],
            &["replay", utf8(path), "--repair", utf8(&merged)],
            &["campaign", "merge", utf8(path), "--out", utf8(&merged)],
        ] {
            let output = hil_sim_refuses(arguments);
            let message = stderr(&output);
            assert_eq!(output.status.code(), Some(2), "{arguments:?}: {message}");
            assert!(
                message.contains(utf8(path)) && message.contains("not a regular file"),
                "{arguments:?}: {message}"
            );
        }
    }
    for path in [long].iter().chain(&endless) {
        for arguments in [
            &["drive", "--vehicle", utf8(path)][..],
            &["drive", "--plant-vehicle", utf8(path)],
            &["drive", utf8(path)],
            &["equilibrium", "--vehicle", utf8(path)],
        ] {
            let output = hil_sim_refuses(arguments);
            let message = stderr(&output);
            assert_eq!(output.status.code(), Some(2), "{arguments:?}: {message}");
            assert!(
                message.contains(utf8(path))
                    && (message.contains("not a regular file") || message.contains("allowed is 0 to 1048576")),
                "{arguments:?}: {message}"
            );
        }
    }
}

#[test]
fn what_a_file_says_acts_on_no_terminal_and_on_no_page() {
    let acts = |bytes: &[u8]| {
        let text = String::from_utf8_lossy(bytes).into_owned();
        text.chars()
            .any(|c| (c.is_control() && c != '\n' && c != '\t') || ('\u{202a}'..='\u{202e}').contains(&c))
    };
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("title-escape");
    let shown = hil_sim(&["drive", "tests/cases/title-escape.toml", "--out", utf8(&folder)]);
    let page = std::fs::read(folder.join("index.html")).expect("a page");
    let json = hil_sim(&["drive", "tests/cases/title-escape.toml", "--json"]);
    let spreads = hil_sim(&["drive", "tests/cases/title-escape.toml", "--seeds", "1:2"]);
    let renamed = own("title\u{1b}[2J.toml", include_str!("cases/title-escape.toml"));
    let group = hil_sim(&["campaign", "run", utf8(&renamed), "--seeds", "1:1"]);
    for (what, bytes) in [
        ("spreads", &spreads.stdout),
        ("campaign", &group.stdout),
        ("table", &shown.stdout),
        ("errors", &shown.stderr),
        ("JSON", &json.stdout),
        ("page", &page),
    ] {
        assert!(!bytes.is_empty() || what == "errors", "{what}");
        assert!(!acts(bytes), "{what}: {}", String::from_utf8_lossy(bytes));
    }
    // The title's second line must not pass for a line of the tool.
    assert!(
        !String::from_utf8_lossy(&shown.stdout)
            .lines()
            .any(|line| line == "LINE2")
    );
    let value: serde_json::Value = serde_json::from_slice(&json.stdout).expect("one object");
    assert!(value["scenario"].as_str().expect("a title").contains('\u{1b}'));

    // Escapes in names and values, and in a file that is not TOML.
    let texts = [
        "title = \"x\"\nduration_s = 1.0\n\"\\u001b[2J\" = 1",
        "title = \"x\"\nduration_s = 1.0\n[metrics]\n\"\\u001b[2J\" = [0.0, 1.0]",
        "title = \"x\"\nduration_s = 1.0\n[[step]]\nat_s = 0.1\naction = \"\\u009b2J\"",
        "title = \u{1b}[2J",
    ];
    for (index, text) in texts.iter().enumerate() {
        let refused = hil_sim(&["drive", utf8(&own(&format!("escape-{index}.toml"), text))]);
        assert_eq!(refused.status.code(), Some(2), "{text}");
        assert!(!acts(&refused.stderr), "{}", stderr(&refused));
    }
    for arguments in [
        ["drive", "no\u{1b}[2Jfile.toml"],
        ["simulate", "--vehicle=no\u{1b}[2Jfile.toml"],
    ] {
        let refused = hil_sim(&arguments);
        assert_eq!(refused.status.code(), Some(2), "{arguments:?}");
        assert!(!acts(&refused.stderr), "{}", stderr(&refused));
    }
    let vehicle = "[body]\n\"arm\\u001b[2J\" = 1.0";
    let refused = hil_sim(&["drive", "--vehicle", utf8(&own_vehicle("escape", vehicle))]);
    assert_eq!(refused.status.code(), Some(2));
    assert!(!acts(&refused.stderr), "{}", stderr(&refused));
}
