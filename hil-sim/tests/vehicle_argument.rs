//! `--vehicle FILE.toml` as a script sees it: the file's numbers, overridden by flags; bad files.

use std::path::Path;

use serde_json::Value;

mod vehicle_tool;
use vehicle_tool::{REFERENCE, file, hil_sim, json, reference_with};

/// Every analysis command, with the flags that it needs besides a vehicle, and short enough for a test.
const COMMANDS: [&str; 9] = [
    "equilibrium",
    "simulate --voltage 0.5 --t-end 2 --sample 1",
    "critical",
    "slip-limit --mu-s 0.6",
    "envelope --waveforms step --slopes 0:0.1:2",
    "spatial --u-right 0.3 --u-left 0.2 --t-end 2 --sample 1",
    "lqr",
    "camera --tilt0-deg 5 --t-end 2 --sample 1",
    "coupled --voltage 0.5 --t-end 2 --sample 1",
];

/// Endings of the names of numbers in SI.
const UNITS: [&str; 4] = ["_v", "_m_s", "_deg", "_s"];

/// Asserts that a run ends with exit code 2 and prints nothing; returns its message.
fn refused(line: &str, vehicle: &str) -> String {
    let output = hil_sim(line, Some(vehicle));
    let message = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(2), "{line}: {message}");
    assert!(output.stdout.is_empty(), "{line}");
    message
}

/// The nondimensional numbers of a JSON value, in order; numbers with a unit are there only if the vehicle is known.
fn numbers(value: &Value) -> Vec<f64> {
    match value {
        Value::Number(n) => vec![n.as_f64().unwrap()],
        Value::Array(all) => all.iter().flat_map(numbers).collect(),
        Value::Object(all) => all
            .iter()
            // The numbers that the user did not give are no result.
            .filter(|(name, _)| *name != "taken" && !UNITS.iter().any(|unit| name.ends_with(unit)))
            .flat_map(|(_, value)| numbers(value))
            .collect(),
        _ => Vec::new(),
    }
}

#[track_caller]
fn same(line: &str, a: &Value, b: &Value) {
    let (x, y) = (numbers(a), numbers(b));
    assert!(!x.is_empty() && x.len() == y.len(), "{line}: {a} {b}");
    for (x, y) in x.iter().zip(&y) {
        assert!((x - y).abs() <= 1e-7 * (1.0 + y.abs()), "{line}: {x} {y}");
    }
}

/// A vehicle file gives the same results as the flags that describe the vehicle, computed here from its SI values.
#[test]
fn the_file_is_worth_its_flags() {
    let vehicle = reference_with(
        "changed.toml",
        &[
            ("arm_mass_kg = 12.24", "arm_mass_kg = 11.0"),
            ("half_track_m = 0.25", "half_track_m = 0.3"),
            ("spar_length_m = 0.25", "spar_length_m = 0.3"),
            ("camera_mass_kg = 0.51", "camera_mass_kg = 0.45"),
        ],
    );
    let (mass, r, w) = (13.6, 0.25_f64, (9.81_f64 / 0.25).sqrt());
    let inertia = mass * r * r;
    let damping = 1.065 + 2.0 * 0.0302 * 0.030124 * 43.0 * 43.0 / 0.316;
    // The planar vehicle carries its spar: its numbers are relative to the whole mass. The spatial vehicle does not carry it.
    let (lc, mc) = (0.3_f64, 0.45);
    let whole = mass + mc + 1.53 + 2.04;
    let numbers = |mass: f64| {
        let inertia = mass * r * r;
        format!(
            "--l {} --alpha {} --zeta {} --mu {} --nu {}",
            0.2 / r,
            11.0 / mass,
            damping / (inertia * w),
            0.0561 / inertia,
            2.0 * 43.0 * 43.0 * 0.000_013_4 / inertia
        )
    };
    let (planar, alone) = (numbers(whole), numbers(mass));
    let unit = mc * lc * lc * (9.81 / lc).sqrt();
    let camera = format!(
        "--lm {} --lr {} --mm {} --mr {} --zeta {} --xi {}",
        0.041_666_7 / lc,
        0.041_666_7 / lc,
        1.53 / mc,
        2.04 / mc,
        0.03993 / unit,
        0.0546_f64.powi(2) * 28.0 * 28.0 / 5.853 / unit
    );
    for line in COMMANDS {
        let flags = match line.split(' ').next().unwrap() {
            "spatial" => format!(
                "{alone} --s 1.2 --j0 {} --carried {}",
                0.12 / inertia,
                (whole - mass) / mass
            ),
            "lqr" | "camera" => camera.clone(),
            // No flags describe its spar: `the_reference_vehicle_carries_the_spar_of_chapter_7` checks it.
            "coupled" => continue,
            // The file's gains are relative to wheels and arm.
            "equilibrium" => format!("{planar} --kp {} --kd {}", 0.8 * mass / whole, 10.0 * mass / whole),
            _ => planar.clone(),
        };
        let from_file = json(line, Some(&vehicle));
        same(line, &from_file, &json(&format!("{line} {flags}"), None));
        assert_ne!(from_file, json(line, None), "{line}: the file changes nothing");
    }
}

#[test]
fn the_reference_vehicle_carries_the_spar_of_chapter_7() {
    // The spar is that of ch. 7 within the rounding of the file; the damping is 2.2 within 3e-4.
    let flags = "--zeta 2.2 --mu 0.066 --nu 0";
    let line = format!("coupled --voltage 2 --t-end 20 --sample 20 {flags}");
    let (from_file, thesis) = (json(&line, Some(REFERENCE)), json(&line, None));
    let [a, b] = [&from_file, &thesis].map(|v| v["psi_max_deg"].as_f64().unwrap());
    assert!((a - b).abs() < 2e-3 * b && a != b, "{a} {b}");
    // With another spar the vehicle differs; its masses alone determine the voltage that holds it on the slope.
    let heavy = reference_with("heavy.toml", &[("ballast_mass_kg = 2.04", "ballast_mass_kg = 4.08")]);
    let hold = json("coupled --beta 0.2 --t-end 1 --sample 1", Some(&heavy))["voltage"][0]
        .as_f64()
        .unwrap();
    let want = (1.0 + (0.51 + 1.53 + 4.08) / 13.6) * 0.2_f64.sin();
    assert!((hold - want).abs() < 1e-12, "{hold} {want}");
    // The flags scale the vehicle's spar as a whole.
    let hold = json("coupled --beta 0.2 --kr 0.1 --t-end 1 --sample 1", Some(&heavy))["voltage"][0]
        .as_f64()
        .unwrap();
    let want = (1.0 + 0.1 * (0.51 + 1.53 + 4.08) / 4.08) * 0.2_f64.sin();
    assert!((hold - want).abs() < 1e-12, "{hold} {want}");
}

#[test]
fn a_planar_file_gives_the_slope_too_and_flags_override() {
    let planar = file(
        "planar.toml",
        "[planar]\nl = 1.1\nalpha = 0.8\nzeta = 1.5\nmu = 0.1\nnu = 0.02\nbeta = 0.2\n",
    );
    let flags = "--l 1.1 --alpha 0.8 --zeta 1.5 --mu 0.1 --nu 0.02";
    for line in COMMANDS {
        let slope = match line.split(' ').next().unwrap() {
            "lqr" | "camera" => continue,
            "spatial" => "--slope-x",
            // The envelope takes its slopes from its own flag.
            "envelope" => "--ramp-time 5 --beta",
            _ => "--beta",
        };
        let with = json(line, Some(&planar));
        same(line, &with, &json(&format!("{line} {flags} {slope} 0.2"), None));
        // A flag overrides the file.
        same(
            line,
            &json(&format!("{line} --mu 0.3"), Some(&planar)),
            &json(
                &format!("{line} {} {slope} 0.2", flags.replace("--mu 0.1", "--mu 0.3")),
                None,
            ),
        );
    }
    let level = file("level.toml", "[planar]\nl = 0.8\nalpha = 0.9\nzeta = 2.2\nmu = 0.066\n");
    let flags = "critical --l 0.8 --alpha 0.9 --zeta 2.2 --mu 0.066 --nu 0 --beta 0";
    assert_eq!(json("critical", Some(&level)), json(flags, None));
}

#[test]
fn bad_files_end_with_2_and_name_file_field_and_range() {
    let cases = [
        (
            reference_with("nan.toml", &[("wheel_radius_m = 0.25", "wheel_radius_m = nan")]),
            vec!["nan.toml: body.wheel_radius_m = NaN", "0.01 to 2"],
        ),
        (
            reference_with("heavy-arm.toml", &[("arm_mass_kg = 12.24", "arm_mass_kg = 13.6")]),
            vec!["heavy-arm.toml: body.arm_mass_kg = 13.6", "alpha", "13.6 here"],
        ),
        (
            reference_with("missing.toml", &[("ballast_mass_kg = 2.04", "")]),
            vec!["missing.toml: spar.ballast_mass_kg is missing", "0.005 to 500"],
        ),
        (
            file("alpha.toml", "[planar]\nl = 0.8\nalpha = 1.0\nzeta = 2.2\nmu = 0.066\n"),
            vec!["alpha.toml: planar.alpha = 1", "0.000001 to 0.999999"],
        ),
        (file("broken.toml", "[planar\n"), vec!["broken.toml: not valid TOML"]),
        ("no/such/file.toml".to_owned(), vec!["no/such/file.toml: "]),
    ];
    for line in COMMANDS {
        for (vehicle, parts) in &cases {
            let message = refused(line, vehicle);
            for part in parts {
                assert!(message.contains(part), "{line}: {message}");
            }
        }
    }
    // The message about a slope too steep for the loaded vehicle, or for any vehicle, names the file.
    let steep = file(
        "steep.toml",
        "[planar]\nl = 0.8\nalpha = 0.9\nzeta = 2.2\nmu = 0.066\nbeta = 1.0\n",
    );
    for line in ["critical", "slip-limit", "simulate --voltage 1", "coupled"] {
        let message = refused(line, &steep);
        assert!(
            message.contains("steep.toml: planar.beta is 1, must be within"),
            "{message}"
        );
        let message = refused(&format!("{line} --beta 0.9"), &steep);
        assert!(message.contains("--beta is 0.9, must be within"), "{message}");
    }
}

#[test]
fn a_vehicle_without_a_spar_has_no_camera_commands() {
    let text = std::fs::read_to_string(REFERENCE).unwrap();
    let (head, tail) = text.split_once("[spar]").unwrap();
    let bare = file(
        "bare.toml",
        &format!("{head}[imu]{}", tail.split_once("[imu]").unwrap().1),
    );
    let planar = file(
        "bare-planar.toml",
        "[planar]\nl = 0.8\nalpha = 0.9\nzeta = 2.2\nmu = 0.066\n",
    );
    for (line, vehicle) in [
        ("lqr", &bare),
        ("camera", &bare),
        ("coupled", &bare),
        ("lqr", &planar),
        ("camera", &planar),
    ] {
        let message = refused(line, vehicle);
        assert!(
            message.contains(vehicle.as_str()) && message.contains("[spar]"),
            "{message}"
        );
    }
    assert!(json("critical", Some(&bare))["critical"].is_number());
}

/// Each number in SI is the nondimensional number times a scale that is computed here: sqrt(g r) for the speed at theta' = 1, and for
/// voltages the voltage at which both motors give (M+m) g r (3.11), with the whole mass for the planar vehicle, which carries its spar.
#[test]
fn a_whole_vehicle_gives_volts_speeds_and_degrees() {
    let r = 0.25_f64;
    let (time, speed) = ((r / 9.81).sqrt(), (9.81 * r).sqrt());
    let volts_of = |mass: f64| mass * 9.81 * r / (2.0 * 0.0302 * 43.0 / 0.316);
    let (volts, alone) = (volts_of(13.6 + 0.51 + 1.53 + 2.04), volts_of(13.6));
    let near = |value: &Value, want: f64| {
        let value = value.as_f64().unwrap();
        assert!((value - want).abs() < 1e-3 * want.abs(), "{value} {want}");
    };
    let times = |json: &Value, number: &str, scale: f64| json[number].as_f64().unwrap() * scale;
    for (line, pairs) in [
        ("critical", &[("critical", "critical_v", volts)][..]),
        ("critical --quantity reference", &[("critical", "critical_m_s", speed)]),
        (
            "slip-limit --mu-s 0.6",
            &[
                ("critical_voltage", "critical_voltage_v", volts),
                ("whirl_voltage", "whirl_voltage_v", volts),
            ],
        ),
        (
            "equilibrium --voltage 0.5",
            &[
                ("phi", "phi_deg", 1_f64.to_degrees()),
                ("theta_rate", "speed_m_s", speed),
            ],
        ),
    ] {
        let said = json(line, Some(REFERENCE));
        for (number, in_si, scale) in pairs {
            near(&said[*in_si], times(&said, number, *scale));
            assert!(json(line, None).get(in_si).is_none(), "{line}: {in_si} of no vehicle");
        }
    }
    let row = &json("envelope --waveforms step --slopes 0.1:0.1:1", Some(REFERENCE))["rows"][0];
    near(&row["critical_v"], times(row, "critical", volts));
    near(&row["beta_deg"], 0.1_f64.to_degrees());
    // The table and the page have the chart in both kinds of units.
    let out = Path::new(env!("CARGO_TARGET_TMPDIR")).join("envelope-in-si");
    let out = out.to_str().unwrap();
    json(
        &format!("envelope --waveforms step --slopes 0.1:0.2:2 --out {out}"),
        Some(REFERENCE),
    );
    let table = std::fs::read_to_string(format!("{out}/envelope.csv")).unwrap();
    let rows: Vec<Vec<&str>> = table.lines().map(|line| line.split(',').collect()).collect();
    assert_eq!(rows[0], ["beta", "step", "beta_deg", "step_v"]);
    let number = |column: usize| Value::from(rows[1][column].parse::<f64>().unwrap());
    near(&number(2), 0.1_f64.to_degrees());
    near(&number(3), number(1).as_f64().unwrap() * volts);
    let chart = std::fs::read_to_string(format!("{out}/envelope-critical_v.svg")).unwrap();
    assert!(chart.contains("slope beta (deg)") && chart.contains("critical voltage of both motors (V)"));
    let equilibrium = json("equilibrium --voltage 0.5", Some(REFERENCE));
    near(&equilibrium["voltage_v"], 0.5 * volts);
    for (number, in_si) in [("poles", "poles_per_s"), ("poles_closed", "poles_closed_per_s")] {
        near(
            &equilibrium[in_si][0][0],
            equilibrium[number][0][0].as_f64().unwrap() / time,
        );
    }
    // The voltage that holds the whole weight, and the arm's angle, on 0.1 rad.
    let holds = json("equilibrium --beta 0.1", Some(REFERENCE));
    near(&holds["voltage_v"], volts * 0.1_f64.sin());
    near(&holds["phi"], (17.68 * 0.25 * 0.1_f64.sin() / (12.24 * 0.2)).asin());
    for (line, unit_v) in [
        ("simulate --voltage 0.5 --t-end 1 --sample 1", volts),
        ("coupled --t-end 1 --sample 1", alone),
        ("spatial --t-end 1 --sample 1", volts),
    ] {
        let run = json(line, Some(REFERENCE));
        near(&run["voltage_unit_v"], unit_v);
        near(&run["speed_unit_m_s"], speed);
        near(&run["time_unit_s"], time);
    }
    let text = String::from_utf8(hil_sim("critical", Some(REFERENCE)).stdout).unwrap();
    assert!(text.contains(" V)"), "{text}");
}

/// The same for the spar: times in units of sqrt(l_c / g), voltages in units of that at which the ballast motor gives m_c g l_c.
#[test]
fn a_whole_vehicle_gives_the_regulator_in_volts() {
    let near = |value: &Value, want: f64| {
        let value = value.as_f64().unwrap();
        assert!((value - want).abs() < 1e-3 * want.abs(), "{value} {want}");
    };
    let text = std::fs::read_to_string(REFERENCE).unwrap();
    let number = |table: &str, name: &str| -> f64 {
        let table = text.split(&format!("\n[{table}]")).nth(1).unwrap();
        let line = table
            .lines()
            .find(|line| line.starts_with(&format!("{name} =")))
            .unwrap();
        let value = line.split('=').nth(1).unwrap().split('#').next().unwrap();
        value.trim().parse().unwrap()
    };
    let motor = |name| number("ballast_motor", name);
    let (length, mass) = (number("spar", "spar_length_m"), number("spar", "camera_mass_kg"));
    let torque_per_volt = motor("torque_constant_n_m_per_a") * motor("gear_ratio") / motor("resistance_ohm");
    let (time, volts) = ((length / 9.81).sqrt(), mass * 9.81 * length / torque_per_volt);

    let lqr = json("lqr", Some(REFERENCE));
    near(&lqr["time_unit_s"], time);
    near(&lqr["voltage_unit_v"], volts);
    for (place, scale) in [volts, volts, volts * time, volts * time].into_iter().enumerate() {
        near(&lqr["gains_v"][place], scale * lqr["gains"][place].as_f64().unwrap());
    }
    near(&lqr["poles_per_s"][0][0], lqr["poles"][0][0].as_f64().unwrap() / time);
    near(&json("camera --tilt0-deg 5", Some(REFERENCE))["voltage_unit_v"], volts);
    for line in ["lqr", "camera --tilt0-deg 5"] {
        assert!(json(line, None).get("voltage_unit_v").is_none(), "{line} of no vehicle");
        let text = String::from_utf8(hil_sim(line, Some(REFERENCE)).stdout).unwrap();
        assert!(text.contains(" V"), "{text}");
    }
}
