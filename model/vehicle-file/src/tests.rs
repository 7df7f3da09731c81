use super::{VehicleFile, parse, to_rust};
use model::vehicle::Vehicle;

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
            vec!["body.wheel_radius_m is not a number", "0.01 to 2"],
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
            "kp = 0.8 ",
            "kp = 2.3 ",
            vec!["control.kp = 2.3", "total damping", "2.199"],
        ),
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

#[test]
fn a_missing_table_is_named() {
    let (head, _) = REFERENCE.split_once("[safety]").expect("table");
    let message = parse("vehicle.toml", head).expect_err("must be refused").to_string();
    assert_eq!(message, "vehicle.toml: table [safety] is missing");
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
    let source = to_rust(&vehicle);
    let mut fields = 0;
    vehicle.parameters().cast::<f32>().for_each(|_, field, value| {
        fields += 1;
        assert!(
            source.contains(&format!("{}: f32::from_bits(0x{:08x})", field.name, value.to_bits())),
            "{}",
            field.name
        );
    });
    assert!(fields > 50, "{fields}");
}
