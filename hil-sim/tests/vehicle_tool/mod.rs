//! The analysis commands, run from outside with or without a vehicle file.

use std::path::Path;
use std::process::{Command, Output};

use serde_json::Value;

/// The reference vehicle's file.
pub const REFERENCE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../vehicles/reference.toml");

/// Runs `hil-sim` with these words and this vehicle to its end.
pub fn hil_sim(line: &str, vehicle: Option<&str>) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_hil-sim"));
    command.args(line.split_whitespace());
    if let Some(file) = vehicle {
        command.args(["--vehicle", file]);
    }
    command.output().unwrap()
}

/// The object that a successful run prints with `--json`.
pub fn json(line: &str, vehicle: Option<&str>) -> Value {
    let output = hil_sim(&format!("{line} --json"), vehicle);
    let message = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{line}: {message}");
    serde_json::from_slice(&output.stdout).unwrap()
}

/// Writes a file into the test's own folder; its path.
pub fn file(name: &str, text: &str) -> String {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(env!("CARGO_CRATE_NAME"));
    std::fs::create_dir_all(&folder).unwrap();
    let path = folder.join(name);
    std::fs::write(&path, text).unwrap();
    path.to_str().unwrap().to_owned()
}

/// Writes the reference vehicle's file with these changes; its path.
pub fn reference_with(name: &str, changes: &[(&str, &str)]) -> String {
    let mut text = std::fs::read_to_string(REFERENCE).unwrap();
    for (from, to) in changes {
        assert!(text.contains(from), "{from}");
        text = text.replace(from, to);
    }
    file(name, &text)
}
