//! `hil-sim check` from outside, and small vehicles from their files to their drives.

use std::path::{Path, PathBuf};

#[path = "support/tool.rs"]
mod tool;
use tool::{WORKSPACE, hil_sim, stderr};

/// The small vehicle with `from` replaced by `to`.
fn changed(name: &str, from: &str, to: &str) -> PathBuf {
    let small = std::fs::read_to_string(Path::new(WORKSPACE).join("vehicles/small.toml")).expect("reads");
    assert!(small.contains(from), "{from}");
    let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    std::fs::write(&path, small.replace(from, to)).expect("writes");
    path
}

#[test]
fn every_vehicle_that_is_shipped_is_sound() {
    let mut vehicles = 0;
    for entry in std::fs::read_dir(Path::new(WORKSPACE).join("vehicles")).expect("the folder") {
        let path = entry.expect("readable").path();
        let output = hil_sim(&["check", path.to_str().expect("utf-8"), "--json"]);
        assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
        let json: serde_json::Value = serde_json::from_slice(&output.stdout).expect("one object");
        assert_eq!((&json["ok"], &json["findings"]), (&true.into(), &serde_json::json!([])));
        vehicles += 1;
    }
    assert!(vehicles >= 2);
}

/// The table lists the poles of both laws, and calls a law whose oscillations grow unstable.
#[test]
fn poles_and_limits_are_told_and_an_unstable_law_is_named() {
    let output = hil_sim(&["check", "vehicles/small.toml"]);
    let table = String::from_utf8_lossy(&output.stdout).into_owned();
    for told in [
        "poles of the landing law",
        "poles of Eq. 3.25",
        "whirl_slope_deg",
        "whirl_slope_v",
        "grip_limit_v",
    ] {
        assert!(table.contains(told), "{told}: {table}");
    }
    assert!(!table.contains("unstable"), "{table}");
    // The gains of Eq. 3.25 do not follow from the vehicle: with the reference vehicle's gains, bearings without drag and motors
    // of twice the resistance make it unstable.
    let free = changed(
        "free.toml",
        "bearing_damping_n_m_s = 0.02",
        "bearing_damping_n_m_s = 0.0",
    );
    let free_running = std::fs::read_to_string(&free)
        .expect("reads")
        .replace("resistance_ohm = 1.3", "resistance_ohm = 2.6");
    std::fs::write(&free, free_running).expect("writes");
    let output = hil_sim(&["check", free.to_str().expect("utf-8")]);
    let table = String::from_utf8_lossy(&output.stdout).into_owned();
    let line = table
        .lines()
        .find(|line| line.starts_with("poles of Eq. 3.25"))
        .expect("the poles");
    assert!(
        line.ends_with("unstable") && line.contains(" that this file's `law` leaves unused"),
        "{line}"
    );
    assert_eq!(output.status.code(), Some(0), "the landing law is stable: {table}");
}

#[test]
fn a_design_that_cannot_work_ends_with_1_and_a_bad_file_with_2() {
    let buried = changed("buried.toml", "arm_length_m = 0.06", "arm_length_m = 0.11");
    let output = hil_sim(&["check", buried.to_str().expect("utf-8")]);
    assert_eq!(output.status.code(), Some(1));
    let table = String::from_utf8_lossy(&output.stdout);
    assert!(
        table.contains("error: body.arm_length_m: the arm's centre of mass hangs 0.11 m below"),
        "{table}"
    );
    assert!(stderr(&output).contains("body.arm_length_m"), "{}", stderr(&output));

    let doubtful = changed(
        "doubtful.toml",
        "yaw_inertia_kg_m2 = 0.015",
        "yaw_inertia_kg_m2 = 0.001",
    );
    let output = hil_sim(&["check", doubtful.to_str().expect("utf-8")]);
    assert_eq!(output.status.code(), Some(0), "a warning is no error");
    assert!(String::from_utf8_lossy(&output.stdout).contains("warning: body.yaw_inertia_kg_m2"));

    let unknown = changed("unknown.toml", "arm_length_m", "arm_span_m");
    let output = hil_sim(&["check", unknown.to_str().expect("utf-8")]);
    assert_eq!(output.status.code(), Some(2));
}

/// The voltage that `check` reports for holding on a slope is the voltage with which the simulated vehicle holds.
#[test]
fn the_hold_that_check_tells_is_the_one_that_the_vehicle_needs() {
    let smooth = changed(
        "smooth.toml",
        "coulomb_friction_n_m = 0.02",
        "coulomb_friction_n_m = 0.0",
    );
    let vehicle = smooth.to_str().expect("utf-8");
    let output = hil_sim(&["check", vehicle, "--json"]);
    let json: serde_json::Value = serde_json::from_slice(&output.stdout).expect("one object");
    let numbers = json["numbers"].as_array().expect("numbers");
    let number = |name: &str| {
        let number = numbers.iter().find(|number| number["name"] == name).expect(name);
        number["value"].as_f64().expect("a number")
    };
    let hold_a = number("hold_current_10_deg_a");

    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("hold");
    std::fs::create_dir_all(&folder).expect("a folder");
    let scenario = folder.join("hold.toml");
    let text = "title = \"hold\"\nduration_s = 20.0\nchocked_until_armed = true\n\
         [terrain.plane]\nslope_x_rad = 0.174533\n[[step]]\nat_s = 2.0\naction = \"arm\"\n";
    std::fs::write(&scenario, text).expect("writes");
    let output = hil_sim(&[
        "drive",
        scenario.to_str().expect("utf-8"),
        "--vehicle",
        vehicle,
        "--out",
        folder.to_str().expect("utf-8"),
    ]);
    assert!(output.status.success(), "{}", stderr(&output));
    let trace = std::fs::read_to_string(folder.join("trace.csv")).expect("the trace");
    let mut lines = trace.lines();
    let columns: Vec<&str> = lines.next().expect("names").split(',').collect();
    let column = columns
        .iter()
        .position(|name| *name == "true_left_current_a")
        .expect("the current");
    let last: Vec<f64> = lines
        .rev()
        .take(200)
        .map(|line| line.split(',').nth(column).expect("a value").parse().expect("a number"))
        .collect();
    let mean_a = last.iter().sum::<f64>() / last.len() as f64;
    assert!((mean_a / hold_a - 1.0).abs() < 0.03, "{mean_a} A for {hold_a} A");
}

/// A robot for the palm of a hand: wheels of 30 mm, 0.5 kg, 6 V, two gearmotors with a continuous current of 0.4 A. `check` finds
/// nothing to doubt; the robot arms, because only measured currents heat the model of its motors, and drives.
#[test]
fn a_vehicle_in_the_palm_of_a_hand_drives() {
    let mut text = std::fs::read_to_string(Path::new(WORKSPACE).join("vehicles/small.toml")).expect("reads");
    for (field, value) in [
        ("wheel_radius_m", "0.03"),
        ("total_mass_kg", "0.5"),
        ("arm_mass_kg", "0.38"),
        ("arm_length_m", "0.015"),
        ("wheels_inertia_kg_m2", "0.00007"),
        ("half_track_m", "0.04"),
        ("yaw_inertia_kg_m2", "0.0003"),
        ("bearing_damping_n_m_s", "0.0003"),
        ("torque_constant_n_m_per_a", "0.0035"),
        ("back_emf_constant_v_s_per_rad", "0.0035"),
        ("resistance_ohm", "4.0"),
        ("inductance_h", "0.001"),
        ("rotor_inertia_kg_m2", "0.00000003"),
        ("current_limit_a", "1.2"),
        ("continuous_current_a", "0.4"),
        ("winding_time_constant_s", "8.0"),
        ("coulomb_friction_n_m", "0.003"),
        ("encoder_counts_per_rev", "28"),
        ("arm_radius_m", "0.01"),
        ("nominal_v", "6.0"),
        ("minimum_v", "4.8"),
        ("maximum_v", "7.2"),
        ("speed_max_m_s", "0.5"),
        ("acceleration_max_m_s2", "0.5"),
        ("overcurrent_a", "2.0"),
    ] {
        let line = text.lines().find(|line| line.split(' ').next() == Some(field));
        let line = line.unwrap_or_else(|| panic!("{field}")).to_owned();
        text = text.replacen(&line, &format!("{field} = {value}"), 1);
    }
    let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join("palm.toml");
    std::fs::write(&path, text).expect("writes");
    let vehicle = path.to_str().expect("utf-8");
    let output = hil_sim(&["check", vehicle, "--json"]);
    let json: serde_json::Value = serde_json::from_slice(&output.stdout).expect("one object");
    assert_eq!((&json["ok"], &json["findings"]), (&true.into(), &serde_json::json!([])));
    for scenario in ["slope-drive", "figure-of-eight"] {
        let output = hil_sim(&["drive", scenario, "--vehicle", vehicle, "--json"]);
        assert!(output.status.success(), "{}", stderr(&output));
        let json: serde_json::Value = serde_json::from_slice(&output.stdout).expect("one object");
        let metrics = json["metrics"].as_array().expect("metrics");
        let value = |name: &str| {
            let metric = metrics.iter().find(|metric| metric["name"] == name).expect(name);
            metric["value"].as_f64().unwrap_or(f64::NAN)
        };
        assert_eq!((value("faults"), value("final_mode")), (0.0, 1.0), "{scenario}");
        // The vehicle drives as far as its top speed allows, follows its reference, and stops.
        assert!(value("distance_m") > 15.0, "{scenario}: {json}");
        assert!(
            value("speed_error_rms_m_s") < 0.05 && value("phi_peak_deg") < 45.0,
            "{scenario}: {json}"
        );
        assert!(value("hold_drift_m") < 0.05, "{scenario}: {json}");
    }
}

#[test]
fn the_small_vehicle_drives_the_slope_and_the_eight() {
    for scenario in ["slope-drive", "figure-of-eight"] {
        let arguments = [
            "drive",
            scenario,
            "--no-bounds",
            "--vehicle",
            "vehicles/small.toml",
            "--json",
        ];
        let output = hil_sim(&arguments);
        assert!(output.status.success(), "{}", stderr(&output));
        let json: serde_json::Value = serde_json::from_slice(&output.stdout).expect("one object");
        let metrics = json["metrics"].as_array().expect("metrics");
        let value = |name: &str| {
            let metric = metrics.iter().find(|metric| metric["name"] == name).expect(name);
            metric["value"].as_f64().expect("a number")
        };
        assert_eq!(
            (value("faults"), value("final_mode"), value("late_ticks")),
            (0.0, 1.0, 0.0)
        );
        // The requirements on the reference vehicle: the vehicle follows its reference, its arm swings less than half way to the
        // horizontal, and the vehicle stops.
        assert!(value("speed_error_rms_m_s") < 0.08, "{scenario}: {json}");
        assert!(
            value("phi_peak_deg") < 45.0 && value("hold_drift_m") < 0.05,
            "{scenario}: {json}"
        );
    }
}
