//! The commands of chapters 6 to 8 as a script sees them: JSON keys, numbers, exit codes, messages.

use std::process::{Command, Output};

use serde_json::Value;

fn hil_sim(line: &str) -> Output {
    Command::new(env!("CARGO_BIN_EXE_hil-sim"))
        .args(line.split_whitespace())
        .output()
        .unwrap()
}

/// The one JSON object on stdout.
fn json(line: &str) -> Value {
    let output = hil_sim(&format!("{line} --json"));
    let text = String::from_utf8(output.stdout).unwrap();
    assert!(
        output.status.success(),
        "{line}: {}",
        String::from_utf8_lossy(&output.stderr)
    );
    assert_eq!(text.trim_end().lines().count(), 1, "{line}: {text}");
    serde_json::from_str(&text).unwrap()
}

fn keys(value: &Value) -> Vec<&str> {
    let mut keys: Vec<&str> = value.as_object().unwrap().keys().map(String::as_str).collect();
    keys.sort_unstable();
    keys
}

fn array(value: &Value, key: &str) -> Vec<f64> {
    value[key]
        .as_array()
        .unwrap()
        .iter()
        .map(|x| x.as_f64().unwrap())
        .collect()
}

fn number(value: &Value, key: &str) -> f64 {
    value[key].as_f64().unwrap()
}

/// Asserts exit code 2 and a message that names the flag.
fn refused(line: &str, flag: &str) {
    let output = hil_sim(line);
    let message = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(2), "{line}: {message}");
    assert!(message.contains(flag) && output.stdout.is_empty(), "{line}: {message}");
}

#[test]
fn lqr_prints_gains_poles_and_residual() {
    let result = json("lqr");
    assert_eq!(keys(&result), ["gains", "poles", "riccati_residual"]);
    for (gain, want) in array(&result, "gains")
        .iter()
        .zip([-92.06057, 6.84090, -49.14485, -6.49598])
    {
        assert!((gain - want).abs() < 1e-5);
    }
    assert!(number(&result, "riccati_residual") < 1e-12);
    assert_eq!(result["poles"].as_array().unwrap().len(), 4);
    // Another spar and other weights: the heavier the control, the smaller the gains.
    let spar = "lqr --lm 0.2 --lr 0.25 --mm 2 --mr 5 --zeta 0.3 --xi 1.5 --q 100,1,0,0";
    let (cheap, dear) = (json(&format!("{spar} --r 0.1")), json(&format!("{spar} --r 10")));
    assert!(array(&cheap, "gains")[0].abs() > 2.0 * array(&dear, "gains")[0].abs());
}

#[test]
fn camera_prints_the_run() {
    let result = json("camera --ax 0.1 --ay 0.1 --t-end 120 --sample 0.5");
    assert_eq!(
        keys(&result),
        [
            "phi",
            "phi_rate",
            "recovered",
            "t",
            "theta",
            "theta_amplitude_deg",
            "theta_rate",
            "v"
        ]
    );
    assert!((number(&result, "theta_amplitude_deg") - 0.8799).abs() < 5e-5);
    assert_eq!(array(&result, "t").len(), 241);
    assert!(array(&result, "v").iter().any(|v| v.abs() > 0.1));
    // Given gains, in scientific notation, and no control.
    let by_hand = json(
        "camera --ax 0.1 --ay 0.1 --t-end 120 --sample 0.5 --gains -9.206056976760e1,6.840898588,-49.14484644734,-6.495979961",
    );
    assert!((number(&by_hand, "theta_amplitude_deg") - number(&result, "theta_amplitude_deg")).abs() < 1e-7);
    let free = json("camera --ax 0.1 --ay 0.1 --t-end 120 --sample 0.5 --gains none");
    assert!((number(&free, "theta_amplitude_deg") - 5.93).abs() < 5e-3 && array(&free, "v").iter().all(|v| *v == 0.0));
    // A spar that is lost and a spar that recovers.
    assert_eq!(json("camera --tilt0-deg 19")["recovered"], Value::Bool(false));
    assert_eq!(json("camera --tilt0-deg 18.9")["recovered"], Value::Bool(true));
    let limited = json("camera --tilt0-deg -39 --v-max 10");
    assert_eq!(limited["recovered"], Value::Bool(true));
    assert!(array(&limited, "v").iter().all(|v| v.abs() <= 10.0));
}

#[test]
fn spatial_prints_the_run_and_its_balances() {
    let result = json("spatial --u-right 0.6 --u-left 0.4 --t-end 10 --sample 0.1");
    let want = [
        "constraint_residual",
        "energy_residual",
        "phi",
        "phi_rate",
        "psi",
        "rate_l",
        "rate_r",
        "t",
        "theta_l",
        "theta_r",
        "x",
        "y",
    ];
    assert_eq!(keys(&result), want);
    for (key, end) in [("x", 3.7394), ("y", 1.9051), ("psi", 0.9007)] {
        assert!((array(&result, key)[100] - end).abs() < 5e-5, "{key}");
    }
    for key in ["energy_residual", "constraint_residual"] {
        assert!(array(&result, key).iter().all(|r| r.abs() < 1e-9), "{key}");
    }
    // From a state, on a plane inclined both ways, with the yaw inertia of thin wheels.
    let tilted = json(
        "spatial --l 0.9 --alpha 0.8 --zeta 1.5 --mu 0.08 --s 1.2 --j0 0.04 --slope-x 0.1 --slope-y -0.05 \
         --u-right 0.3 --u-left 0.2 --state0 1,2,0.5,0.1,0.2,-0.3,0.4,-0.1,0.2 --t-end 5 --sample 5",
    );
    assert_eq!((array(&tilted, "x")[0], array(&tilted, "phi_rate")[0]), (1.0, 0.2));
    assert!(array(&tilted, "energy_residual")[1].abs() < 1e-10);
}

#[test]
fn coupled_prints_the_run_or_the_limit() {
    let result = json("coupled --voltage 2 --t-end 20 --sample 1");
    let want = [
        "gamma",
        "gamma_rate",
        "outcome",
        "phi",
        "phi_max_deg",
        "phi_rate",
        "psi",
        "psi_max_deg",
        "psi_rate",
        "t",
        "taken",
        "theta",
        "theta_rate",
        "v",
        "voltage",
    ];
    assert_eq!(keys(&result), want);
    assert_eq!(result["outcome"], "ok");
    assert!((number(&result, "psi_max_deg") - 4.76).abs() < 5e-3);
    let limit = json("coupled --critical --controlled false --kr 0.15");
    assert_eq!(
        (keys(&limit), &limit["outcome"]),
        (vec!["critical", "outcome", "taken"], &Value::from("whirl"))
    );
    assert!((number(&limit, "critical") - 4.0847).abs() < 5e-5);
    assert_eq!(json("coupled --critical --kr 0.15")["outcome"], "tumble");
    let over = json("coupled --voltage 3 --sample 1");
    assert_eq!(over["outcome"], "tumble");
}

#[test]
fn bad_input_is_refused_with_the_flag_and_what_is_allowed() {
    for (line, flag) in [
        ("lqr --lr 0", "--lr"),
        ("lqr --mr nan", "--mr"),
        ("lqr --q 1,2,3", "--q"),
        ("lqr --q -1,0,0,0", "--q"),
        ("lqr --r 0", "--r"),
        ("lqr --zeta 0 --xi 0 --q 0,0,0,0", "--q and --r"),
        ("camera --gains 1,2", "--gains"),
        ("camera --v-max 0", "--v-max"),
        ("camera --tilt0-deg 181", "--tilt0-deg"),
        ("camera --t-end 0", "--t-end"),
        ("spatial --alpha 1", "--alpha"),
        ("spatial --s -1", "--s"),
        ("spatial --slope-y 1.6", "--slope-y"),
        ("spatial --state0 1,2,3", "--state0"),
        ("spatial --sample inf", "--sample"),
        ("coupled --kr 0", "--kr"),
        ("coupled --beta 0.6", "--beta"),
        ("coupled --controlled maybe", "--controlled"),
        ("coupled --bearing none", "--bearing"),
        ("coupled --critical --voltage 3", "--voltage"),
        ("coupled --unknown 3", "--unknown"),
    ] {
        refused(line, flag);
    }
}
