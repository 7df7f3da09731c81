use super::{TABLES, Table, Value, VehicleFile, parse, to_rust, to_toml};
use model::dynamics::coupled::Bearing;
use model::vehicle::{LeftOut, Vehicle};
use std::fmt::Write as _;

mod rules;

const REFERENCE: &str = include_str!("../../../vehicles/reference.toml");

fn vehicle(text: &str) -> Vehicle<f64> {
    match parse("vehicle.toml", text) {
        Ok(VehicleFile::Vehicle(vehicle)) => *vehicle,
        other => panic!("{other:?}"),
    }
}

/// The message for the reference file with `from` replaced by `to`.
fn message(from: &str, to: &str) -> String {
    assert!(REFERENCE.contains(from), "{from}");
    parse("vehicle.toml", &REFERENCE.replace(from, to))
        .expect_err("must be refused")
        .to_string()
}

#[test]
fn the_reference_vehicle_has_the_thesis_numbers() {
    let vehicle = vehicle(REFERENCE);
    let planar = vehicle.planar(0.0);
    for (name, value, expected, tolerance) in [
        ("l", planar.l, 0.8, 1e-12),
        ("alpha", planar.alpha, 0.9, 1e-12),
        ("zeta", planar.zeta, 2.2, 1e-3),
        ("mu", planar.mu, 0.066, 1e-4),
        ("nu", planar.nu, 0.0583, 1e-4),
        ("time unit", vehicle.scales().time_s, 0.15964, 1e-5),
        ("speed unit", vehicle.scales().speed_m_s, 1.566, 1e-3),
        ("U a volt", 1.0 / vehicle.scales().voltage_v, 0.24642, 1e-5),
    ] {
        assert!(
            (value - expected).abs() < tolerance,
            "{name}: {value}, expected {expected}"
        );
    }
}

#[test]
fn the_reference_vehicle_has_the_numbers_of_every_model() {
    let vehicle = vehicle(REFERENCE);
    let spatial = vehicle.spatial(0.1, -0.05);
    assert_eq!((spatial.slope_x, spatial.slope_y), (0.1, -0.05));
    assert_eq!((spatial.l, spatial.alpha, spatial.zeta, spatial.mu, spatial.nu), {
        let p = vehicle.planar(0.1);
        (p.l, p.alpha, p.zeta, p.mu, p.nu)
    });
    let camera = vehicle.camera().expect("a camera");
    let coupled = vehicle.coupled(0.2, Bearing::Arm).expect("a camera");
    assert_eq!((coupled.planar, coupled.bearing), (vehicle.planar(0.2), Bearing::Arm));
    for (name, value, expected, tolerance) in [
        ("s", spatial.s, 1.0, 1e-12),
        ("j0", spatial.j0, 0.12 / 0.85, 1e-12),
        ("camera lm", camera.lm, 1.0 / 6.0, 1e-6),
        ("camera lr", camera.lr, 1.0 / 6.0, 1e-6),
        ("camera mm", camera.mm, 3.0, 1e-12),
        ("camera mr", camera.mr, 4.0, 1e-12),
        ("camera zeta", camera.zeta, 0.2, 5e-5),
        ("camera xi", camera.xi, 2.0, 5e-4),
        ("lp", coupled.lp, 1.0, 1e-12),
        ("kc", coupled.kc, 0.0375, 1e-12),
        ("km", coupled.km, 0.1125, 1e-12),
        ("kr", coupled.kr, 0.15, 1e-12),
    ] {
        assert!(
            (value - expected).abs() < tolerance,
            "{name}: {value}, expected {expected}"
        );
    }
}

/// The coupled model's numbers directly from SI units, not through the units of ch. 7: (8.5), corrected.
#[test]
fn a_spar_of_any_proportions_is_scaled_by_the_vehicle() {
    let mut text = REFERENCE.to_owned();
    for (from, to) in [
        ("spar_length_m = 0.25", "spar_length_m = 0.4"),
        ("camera_mass_kg = 0.51", "camera_mass_kg = 0.7"),
        ("motor_mass_kg = 1.53", "motor_mass_kg = 1.1"),
        ("ballast_mass_kg = 2.04", "ballast_mass_kg = 3.0"),
        ("motor_distance_m = 0.0416667", "motor_distance_m = 0.09"),
        ("ballast_distance_m = 0.0416667", "ballast_distance_m = 0.06"),
        ("half_track_m = 0.25", "half_track_m = 0.3"),
    ] {
        assert!(text.contains(from), "{from}");
        text = text.replace(from, to);
    }
    let vehicle = vehicle(&text);
    let found = vehicle.coupled(0.1, Bearing::Inertial).expect("a camera");
    let (mass, radius) = (13.6, 0.25_f64);
    let damping = mass * radius * radius * (9.81 / radius).sqrt();
    for (name, value, expected) in [
        ("lp", found.lp, 0.4 / radius),
        ("lm", found.lm, 0.09 / radius),
        ("lr", found.lr, 0.06 / radius),
        ("kc", found.kc, 0.7 / mass),
        ("km", found.km, 1.1 / mass),
        ("kr", found.kr, 3.0 / mass),
        ("zeta_c", found.zeta_c, 0.03993 / damping),
        ("xi_c", found.xi_c, 0.0546_f64.powi(2) * 28.0 * 28.0 / 5.853 / damping),
        ("s", vehicle.spatial(0.0, 0.0).s, 1.2),
    ] {
        assert!(
            (value - expected).abs() < 1e-14 * (1.0 + expected.abs()),
            "{name}: {value}, expected {expected}"
        );
    }
    let (head, tail) = REFERENCE.split_once("[spar]").expect("table");
    let (_, tail) = tail.split_once("[imu]").expect("table");
    let without = self::vehicle(&format!("{head}[imu]{tail}"));
    assert!(without.camera().is_none() && without.coupled(0.0, Bearing::Arm).is_none());
}

#[test]
fn bad_files_are_refused_with_file_field_and_range() {
    for (from, to, parts) in [
        (
            "wheel_radius_m = 0.25",
            "wheel_radius_m = nan",
            vec!["body.wheel_radius_m = NaN", "0.01 to 2"],
        ),
        (
            "wheel_radius_m = 0.25",
            "wheel_radius_m = inf",
            vec!["body.wheel_radius_m = inf", "0.01 to 2"],
        ),
        (
            "wheel_radius_m = 0.25",
            "",
            vec!["body.wheel_radius_m is missing", "0.01 to 2"],
        ),
        (
            "wheel_radius_m = 0.25",
            "wheel_radius_m = \"wide\"",
            vec!["body.wheel_radius_m = \"wide\" is not a number", "0.01 to 2"],
        ),
        (
            "arm_mass_kg = 12.24",
            "arm_mass_kg = 13.6",
            vec!["body.arm_mass_kg = 13.6", "alpha", "13.6 here"],
        ),
        (
            "arm_length_m = 0.20",
            "arm_length_m = 0",
            vec!["body.arm_length_m = 0", "0.005 to 2"],
        ),
        (
            "arm_length_m = 0.20",
            "arm_length_m = -0.2",
            vec!["body.arm_length_m = -0.2", "0.005 to 2"],
        ),
        (
            "[body]",
            "[body]\nwings = 2",
            vec!["unknown name `body.wings`", "wheel_radius_m"],
        ),
        (
            "[body]",
            "[wings]\nspan = 2\n[body]",
            vec!["unknown name `wings`", "drive_motor"],
        ),
        ("[safety]", "[guard]", vec!["unknown name `guard`", "safety"]),
        ("[body]", "[body", vec!["not valid TOML"]),
        (
            "minimum_v = 19.0",
            "minimum_v = 27.0",
            vec!["battery.minimum_v = 27", "less than nominal_v", "25.2 here"],
        ),
    ] {
        let message = message(from, to);
        assert!(message.starts_with("vehicle.toml: "), "{message}");
        for part in parts {
            assert!(message.contains(part), "{to:?}: {message:?} lacks {part:?}");
        }
    }
}

/// A kp with which Eq. 3.25 is unstable is refused if Eq. 3.25 is the law; the landing law reads no kp. The
/// list's default kp is refused too, on a vehicle with less damping than the thesis's.
#[test]
fn an_unstable_kp_is_refused_where_eq_3_25_flies() {
    const EQ_3_25: &str = "law = \"eq-3.25\"";
    let flown_by = |law: &str, kp: &str, text: &str| {
        let text = text.replace("law = \"landing\"", &format!("{kp}\n{law}"));
        parse("vehicle.toml", &text)
            .map(drop)
            .map_err(|error| error.to_string())
    };
    // Ten times the resistance: zeta is 0.4.
    let little_damped = REFERENCE.replace("resistance_ohm = 0.316", "resistance_ohm = 3.16");
    for (text, kp, bound) in [
        (REFERENCE, "kp = 2.3", "2.199"),
        (REFERENCE, "kp = 2.2", "2.199"),
        (&little_damped, "", "control.kp = 0.8"),
        (&little_damped, "kp = 0.5", "control.kp = 0.5"),
    ] {
        assert_eq!(flown_by("law = \"landing\"", kp, text), Ok(()), "{kp}");
        let message = flown_by(EQ_3_25, kp, text).expect_err("must be refused");
        for part in ["control.kp = ", "total damping", bound] {
            assert!(message.contains(part), "{message:?} lacks {part:?}");
        }
    }
    assert_eq!(flown_by(EQ_3_25, "kp = 2.19", REFERENCE), Ok(()));
    assert_eq!(flown_by(EQ_3_25, "kp = 0.05", &little_damped), Ok(()));
}

/// The whole reference vehicle without each field in turn. The reader uses the stated value, or the rule's
/// value, or names the field as missing. The gains by rule are those of the reference.
#[test]
fn a_field_that_is_left_out_has_its_stated_value_or_is_missing() {
    let reference = vehicle(REFERENCE);
    let root: Table = to_toml(reference.parameters()).parse().expect("it is TOML");
    let (mut stated, mut ruled, mut missing) = (0, 0, 0);
    for table in TABLES {
        for field in table.fields {
            let mut root = root.clone();
            let values = root.get_mut(table.name).and_then(Value::as_table_mut);
            let removed = values.expect("every table").remove(field.name);
            assert!(removed.is_some(), "{}.{}", table.name, field.name);
            let read = parse("vehicle.toml", &root.to_string());
            let name = format!("{}.{}", table.name, field.name);
            match (field.left_out, read) {
                (LeftOut::Value(default), Ok(VehicleFile::Vehicle(vehicle))) => {
                    let parameters = vehicle.parameters();
                    let number = parameters.number_of(table.name, field.name).expect("a field");
                    assert_eq!(parameters.value(number), Some(default), "{name}");
                    assert!(field.allows(default), "{name}");
                    stated += 1;
                }
                (LeftOut::Rule(_), Ok(VehicleFile::Vehicle(vehicle))) => {
                    assert_eq!(*vehicle, reference, "{name}");
                    ruled += 1;
                }
                (LeftOut::Refused | LeftOut::OfSpar(_), Err(error)) => {
                    assert!(error.to_string().contains(&name), "{error}");
                    missing += 1;
                }
                (_, read) => panic!("{name}: {read:?}"),
            }
        }
    }
    assert!(stated > 10 && missing > 30, "{stated} stated, {missing} missing");
    assert_eq!(ruled, 4);
}

#[test]
fn a_table_that_may_be_left_out_as_a_whole_is_still_a_table() {
    let (head, rest) = REFERENCE.split_once("[estimator]").expect("table");
    let (_, tail) = rest.split_once("[safety]").expect("table");
    let without = vehicle(&format!("{head}[safety]{tail}"));
    assert_eq!(without.parameters().estimator.tilt_time_constant_s, 2.0);
    let number = parse("vehicle.toml", &format!("estimator = 3\n{head}[safety]{tail}"));
    let message = number.expect_err("must be refused").to_string();
    assert_eq!(
        message,
        "vehicle.toml: estimator = 3 is not a table: its fields stand below [estimator] (line 1, column 13)"
    );
}

#[test]
fn a_missing_table_is_named() {
    let (head, _) = REFERENCE.split_once("[safety]").expect("table");
    let message = parse("vehicle.toml", head).expect_err("must be refused").to_string();
    assert_eq!(message, "vehicle.toml: table [safety] is missing");
}

/// From an empty to a whole file: the message names everything that is missing at once, and nothing that is
/// optional.
#[test]
fn everything_that_is_missing_is_named_at_once() {
    let message = parse("my.toml", "[body]\nwheel_radius_m = 0.1\n")
        .expect_err("must be refused")
        .to_string();
    for part in [
        "[imu]",
        "  [battery]",
        "  arm_mass_kg =    # 0.01 to 2000: Mass m",
        "vehicles/small.toml",
    ] {
        assert!(message.contains(part), "{part}: {message}");
    }
    for part in [
        "wheel_radius_m",
        "[spar]",
        "[estimator]",
        "[safety]\n  [",
        "tilt_time_constant_s",
    ] {
        assert!(!message.contains(part), "{part}: {message}");
    }
    // With the values of a whole file, the named fields make a whole file.
    let mut text = String::new();
    let small: Table = include_str!("../../../vehicles/small.toml").parse().expect("TOML");
    let mut table = String::new();
    for line in parse("my.toml", "").expect_err("nothing").to_string().lines().skip(1) {
        if let Some(name) = line.trim().strip_prefix('[').and_then(|rest| rest.strip_suffix(']')) {
            table = name.to_owned();
            let _ = writeln!(text, "[{table}]");
        } else if let Some((name, _)) = line.trim().split_once(" =") {
            let _ = writeln!(text, "{name} = {}", small[&table][name]);
        }
    }
    parse("my.toml", &text).expect("whole");
    // An unknown name is reported as such, although the field that it should be is missing too.
    let message = parse("my.toml", "[body]\nwheel_diameter_m = 0.1\n")
        .expect_err("unknown")
        .to_string();
    assert!(message.contains("unknown name `body.wheel_diameter_m`"), "{message}");
}

#[test]
fn a_planar_file_is_checked_too() {
    let good = "[planar]\nl = 0.8\nalpha = 0.9\nzeta = 2.2\nmu = 0.066\nbeta = 0.0873\n";
    match parse("p.toml", good) {
        Ok(VehicleFile::Planar(p)) => assert_eq!((p.l, p.alpha, p.nu, p.beta), (0.8, 0.9, 0.0, 0.0873)),
        other => panic!("{other:?}"),
    }
    for (from, to) in [
        ("alpha = 0.9", "alpha = 1.0"),
        ("l = 0.8", "l = -1"),
        ("mu = 0.066", "mu = nan"),
    ] {
        let message = parse("p.toml", &good.replace(from, to))
            .expect_err("must be refused")
            .to_string();
        let field = from.split(' ').next().expect("name");
        assert!(message.contains(&format!("p.toml: planar.{field} = ")), "{message}");
        assert!(message.contains("allowed is"), "{message}");
    }
}

#[test]
fn the_generated_source_holds_every_value_to_the_bit() {
    let vehicle = vehicle(REFERENCE);
    let parameters = vehicle.parameters().cast::<f32>();
    let source = to_rust(&vehicle);
    // Name and number of every line `name: number,`, in order.
    let written: Vec<(&str, f32)> = source
        .lines()
        .filter_map(|line| line.trim().trim_end_matches(',').split_once(": "))
        .filter_map(|(name, number)| Some((name, number.parse().ok()?)))
        .collect();
    assert_eq!(written.len(), usize::from(parameters.count()));
    for (number, (name, value)) in (0..).zip(written) {
        assert_eq!(parameters.field(number).expect("a field").1.name, name);
        assert_eq!(
            parameters.value(number).expect("a value").to_bits(),
            value.to_bits(),
            "{name}"
        );
    }
}

#[test]
fn names_of_version_0_1_are_still_read() {
    let whole = to_toml(vehicle(REFERENCE).parameters());
    let mut text = whole.clone();
    for (old, new) in super::RENAMED.iter().copied() {
        let last = |name: &'static str| name.split('.').next_back().expect("a name");
        let (table, field) = (format!("[{new}]"), format!("\n{} = ", last(new)));
        assert!(text.contains(&table) || text.contains(&field), "{new}");
        text = text
            .replace(&table, &format!("[{old}]"))
            .replace(&field, &format!("\n{} = ", last(old)));
    }
    assert_ne!(text, whole);
    assert_eq!(vehicle(&text), vehicle(REFERENCE));
    // Both names at once are an error, not a choice.
    let message = parse(
        "vehicle.toml",
        &REFERENCE.replace("arm_radius_m = 0.10", "arm_radius_m = 0.1\nchassis_radius_m = 0.1"),
    );
    let message = message.expect_err("must be refused").to_string();
    assert!(message.contains("unknown name `imu.chassis_radius_m`"), "{message}");
}
