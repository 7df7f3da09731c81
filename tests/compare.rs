//! The laws side by side, through the command, on a vehicle other than the reference.

use serde_json::Value;

#[path = "support/tool.rs"]
mod tool;
use tool::hil_sim;

/// The best step found settles before every law and keeps within its grip, and the landing law settles before Eq. 3.25 with its
/// swing damped. On the whole vehicle the landing law finishes every course without a fault.
#[test]
fn the_comparison_of_another_vehicle_tells_the_laws_apart() {
    let folder = std::env::temp_dir().join(format!("compare-{}", std::process::id()));
    let to = folder.to_str().expect("utf-8");
    let out = hil_sim(&["compare", "--vehicle", "vehicles/small.toml", "--json", "--out", to]);
    assert!(out.status.success(), "{}", String::from_utf8_lossy(&out.stderr));
    let found: Value = serde_json::from_slice(&out.stdout).expect("one object");

    let steps = found["planar"]["steps"].as_array().expect("steps");
    let time = |law: &str| {
        let step = steps.iter().find(|step| step["law"] == law).expect("flown");
        step["settling"]["time"].as_f64().unwrap_or(f64::INFINITY)
    };
    let best = steps
        .iter()
        .find(|step| step["law"] == "best step found")
        .expect("found");
    let grip_mu = 0.6;
    assert!(
        best["grip_needed"].as_f64().expect("a number") <= grip_mu + 1e-3,
        "{best}"
    );
    for law in [
        "open loop",
        "Eq. 3.25 alone",
        "Eq. 3.25, swing damped",
        "landing, no governor",
        "landing",
    ] {
        assert!(time("best step found") < time(law), "{law}");
    }
    assert!(time("landing") < time("Eq. 3.25, swing damped"), "{steps:?}");

    let flights = found["flights"].as_array().expect("flights");
    let courses: Vec<&Value> = flights.iter().map(|flight| &flight["course"]).step_by(4).collect();
    assert!(courses.len() >= 14 && flights.len() == 4 * courses.len(), "{courses:?}");
    for flight in flights.iter().filter(|flight| flight["law"] == "landing") {
        assert_eq!(
            (&flight["finished"], &flight["faults"]),
            (&Value::Bool(true), &Value::from("none")),
            "{flight}"
        );
        assert!(
            flight["settling"].is_null() || flight["settling"]["time"].is_f64(),
            "{flight}"
        );
        assert!(flight["energy_j"].as_f64().expect("a number") > 0.0, "{flight}");
    }
    let page = std::fs::read_to_string(folder.join("index.html")).expect("the page");
    assert_eq!(page.matches("<svg").count(), 1 + courses.len());
    std::fs::remove_dir_all(folder).expect("removed");
}

/// The tool refuses a missing vehicle file and an impossible directory before any drive.
#[test]
fn a_bad_file_and_a_bad_directory_are_told() {
    let run = |arguments: &[&str]| {
        let out = hil_sim(&[&["compare"], arguments].concat());
        (out.status.code(), String::from_utf8_lossy(&out.stderr).into_owned())
    };
    let (code, text) = run(&["--vehicle", "no-such.toml"]);
    assert!(code == Some(2) && text.contains("no-such.toml"), "{code:?} {text}");
    let (code, text) = run(&["--out", "/dev/null/x"]);
    assert!(code == Some(2) && text.contains("--out"), "{code:?} {text}");
}
