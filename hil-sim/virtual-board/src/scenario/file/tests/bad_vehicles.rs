//! Attacks on the reader of vehicle files.

use model::board::BoardScales;
use vehicle_file::parse_vehicle_for;

use super::bad_files::{marked, told};

/// Bad vehicles: a text of the reference vehicle's file, its replacement, and the parts of the
/// message.
const VEHICLES: [(&str, &str, &[&str]); 24] = [
    (
        "wheel_radius_m = 0.25",
        "wheel_radius_m = ^nan",
        &["body.wheel_radius_m = NaN", "0.01 to 2"],
    ),
    (
        "wheel_radius_m = 0.25",
        "wheel_radius_m = ^-inf",
        &["body.wheel_radius_m = -inf", "0.01 to 2"],
    ),
    (
        "wheel_radius_m = 0.25",
        "wheel_radius_m = ^1e308",
        &["body.wheel_radius_m", "0.01 to 2"],
    ),
    (
        "wheel_radius_m = 0.25",
        "wheel_radius_m = ^\"0.25\"",
        &["body.wheel_radius_m = \"0.25\" is not a number"],
    ),
    (
        "wheel_radius_m = 0.25",
        "wheel_radius_m = ^true",
        &["body.wheel_radius_m = true is not a number"],
    ),
    (
        "wheel_radius_m = 0.25",
        "wheel_radius_m = ^[0.25]",
        &["is not a number"],
    ),
    (
        "wheel_radius_m = 0.25",
        "wheel_radius_m = ^2024-01-01",
        &["is not a number"],
    ),
    ("wheel_radius_m = 0.25", "wheel_radius_m = 0,25", &["not valid TOML"]),
    ("wheel_radius_m = 0.25", "wheel_radius_m = ", &["not valid TOML"]),
    ("wheel_radius_m = 0.25", "wheel_radius_m = 0.25 m", &["not valid TOML"]),
    (
        "wheel_radius_m = 0.25",
        "",
        &["body.wheel_radius_m is missing", "0.01 to 2", "(line "],
    ),
    (
        "wheel_radius_m = 0.25",
        "wheel_radius_mm = ^250",
        &["unknown name `body.wheel_radius_mm`", "wheel_radius_m"],
    ),
    (
        "wheel_radius_m = 0.25",
        "wheel_radius_m = 0.25\n^wheel_radius_m = 0.3",
        &["duplicate key"],
    ),
    (
        "[body]",
        "[^wings]\nspan_m = 2\n[body]",
        &["unknown name `wings`", "body"],
    ),
    ("[body]", "[body]\n[^body]", &["not valid TOML"]),
    (
        "arm_mass_kg = 12.24",
        "arm_mass_kg = ^13.7",
        &["body.arm_mass_kg = 13.7", "less than total_mass_kg", "13.6 here"],
    ),
    (
        "minimum_v = 19.0",
        "minimum_v = ^26",
        &["battery.minimum_v = 26", "less than nominal_v"],
    ),
    (
        "overcurrent_a = 30.0",
        "overcurrent_a = 10.0",
        &["drive_motor.current_limit_a = 17", "safety.overcurrent_a"],
    ),
    (
        "law = \"landing\"",
        "law = ^\"landin\"",
        &["control.law = \"landin\"", "\"eq-3.25\", \"landing\""],
    ),
    ("law = \"landing\"", "law = ^1", &["control.law = 1", "\"landing\""]),
    (
        "law = \"landing\"",
        "law = \"eq-3.25\"\nkp = ^2.5",
        &["control.kp = 2.5", "total damping"],
    ),
    (
        "encoder_counts_per_rev = 1024.0",
        "encoder_counts_per_rev = ^48.5",
        &["encoder_counts_per_rev = 48.5", "a whole number"],
    ),
    (
        "maximum_v = 30.0",
        "maximum_v = ^79.0",
        &["battery.maximum_v = 79", "here"],
    ),
    (
        "overcurrent_a = 30.0",
        "overcurrent_a = ^900.0",
        &["safety.overcurrent_a = 900", "here"],
    ),
];

#[test]
fn every_bad_vehicle_is_told_with_its_place() {
    let ranges = BoardScales::EXAMPLE.sensor_ranges();
    for (from, to, parts) in VEHICLES {
        assert!(vehicle_file::REFERENCE.contains(from), "{from}");
        let (text, place) = marked(&vehicle_file::REFERENCE.replacen('^', " ", 9).replacen(from, to, 1));
        let message = parse_vehicle_for("bad.toml", &text, &ranges).expect_err(to).to_string();
        told(&message, to, place, parts);
    }
}
