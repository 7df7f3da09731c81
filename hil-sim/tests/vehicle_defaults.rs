//! The values that the analysis commands take from a vehicle file where no flag overrides them.

use std::path::Path;
use std::process::{Command, Output};

use serde_json::Value;

const REFERENCE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../vehicles/reference.toml");

fn hil_sim(line: &str, vehicle: &str) -> Output {
    let output = Command::new(env!("CARGO_BIN_EXE_hil-sim"))
        .args(line.split_whitespace())
        .args(["--vehicle", vehicle])
        .output()
        .expect("runs");
    let message = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{line}: {message}");
    output
}

fn json(line: &str, vehicle: &str) -> Value {
    serde_json::from_slice(&hil_sim(&format!("{line} --json"), vehicle).stdout).expect("JSON")
}

/// For a vehicle that cannot stand on every slope of the thesis's figures, the envelope covers the slopes on which it can.
#[test]
fn the_envelope_goes_as_far_as_the_vehicle_can_stand() {
    let small = concat!(env!("CARGO_MANIFEST_DIR"), "/../vehicles/small.toml");
    let json = json("envelope --waveforms step", small);
    let betas: Vec<f64> = json["rows"]
        .as_array()
        .expect("rows")
        .iter()
        .map(|row| row["beta"].as_f64().expect("a number"))
        .collect();
    assert_eq!(betas.len(), 41);
    // arm 2.4 of 3 kg, 0.06 m long, wheels of 0.1 m: asin(0.8 x 0.6) = 0.5007 rad is the steepest.
    let (first, last) = (betas[0], betas[40]);
    assert!(
        (first + 0.4).abs() < 1e-9 && last > 0.45 && last < 0.5007,
        "{first} to {last}"
    );
    assert!(
        json["rows"]
            .as_array()
            .expect("rows")
            .iter()
            .all(|row| row["critical_v"].as_f64() > Some(0.0))
    );
}

/// The poles are those of the file's gains, which flags override, and the table calls unstable poles unstable.
#[test]
fn the_poles_are_those_of_the_files_gains() {
    let text = std::fs::read_to_string(REFERENCE).expect("reads");
    let file = Path::new(env!("CARGO_TARGET_TMPDIR")).join("own-gains.toml");
    let own = text.replace("\n[control]\n", "\n[control]\nkp = 0.5\nkd = 5.0\n");
    assert_ne!(own, text);
    std::fs::write(&file, own).expect("writes");
    let file = file.to_str().expect("utf-8");
    let poles = |line: &str, vehicle: &str| json(line, vehicle)["poles_closed"].clone();
    let own = poles("equilibrium", file);
    assert_eq!(own, poles("equilibrium --kp 0.5 --kd 5", REFERENCE));
    assert_ne!(own, poles("equilibrium", REFERENCE));
    // (3.26) is stable only with kp below zeta, 2.1995 here.
    for (kp, unstable) in [("2.1", false), ("2.3", true)] {
        let output = hil_sim(&format!("equilibrium --beta 0 --kp {kp}"), REFERENCE);
        let text = String::from_utf8_lossy(&output.stdout).into_owned();
        assert_eq!(text.contains("unstable"), unstable, "{text}");
    }
}
