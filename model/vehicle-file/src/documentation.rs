//! Tests that the tables of `docs/vehicle-file.md` agree with the sources.

use std::fmt::Write as _;

use model::vehicle::{RELATIONS, Relation};

use super::*;
use crate::error::quoted;

#[path = "../../../tests/support/generated.rs"]
mod generated;

/// Unit suffixes of names, longest first.
const UNITS: [(&str, &str); 21] = [
    ("_v_s_per_rad", "V s/rad"),
    ("_v_per_rad", "V/rad"),
    ("_n_m_per_a", "N m/A"),
    ("_counts_per_rev", "counts/turn"),
    ("_rad_s2", "rad/s^2"),
    ("_kg_m2", "kg m^2"),
    ("_n_m_s", "N m s"),
    ("_m_s2", "m/s^2"),
    ("_rad_s", "rad/s"),
    ("_per_s", "1/s"),
    ("_m_s", "m/s"),
    ("_n_m", "N m"),
    ("_ohm", "ohm"),
    ("_rad", "rad"),
    ("_kg", "kg"),
    ("_h", "H"),
    ("_a", "A"),
    ("_v", "V"),
    ("_m", "m"),
    ("_s", "s"),
    ("", ""),
];

fn unit(name: &str) -> &'static str {
    UNITS
        .iter()
        .find(|(suffix, _)| name.ends_with(suffix))
        .map_or("", |(_, unit)| unit)
}

fn reference() -> Vehicle<f64> {
    read_vehicle(&generated::root().join("vehicles/reference.toml")).expect("the reference vehicle is good")
}

#[test]
fn the_page_names_every_field() {
    let mut text = String::new();
    let mut last = "";
    let vehicle = reference();
    let parameters = vehicle.parameters();
    for number in 0..parameters.count() {
        let (table, field) = parameters.field(number).expect("a field");
        let value = parameters.value(number).expect("a value");
        if table != last {
            last = table;
            let _ = writeln!(
                text,
                "\n### [{table}]\n\n| No. | Field | Unit | Allowed | Left out | Reference | Meaning |\n|---|---|---|---|---|---|---|"
            );
        }
        let Field {
            name,
            meaning,
            min,
            max,
            left_out,
            whole,
            choices,
        } = field;
        let (unit, meaning) = (unit(name), meaning.trim());
        let allowed = if choices.is_empty() {
            let kind = if *whole { ", whole" } else { "" };
            format!("{min} to {max}{kind}")
        } else {
            quoted(choices)
        };
        let shown = |value| {
            field
                .choice(value)
                .map_or_else(|| value.to_string(), |choice| format!("{choice:?}"))
        };
        let default = match left_out {
            LeftOut::Refused => String::new(),
            LeftOut::Value(value) => shown(*value),
            LeftOut::OfSpar(_) => "allowed without a spar".to_owned(),
            LeftOut::Rule(_) => "[by rule](control.md#gains-by-rule)".to_owned(),
        };
        let value = shown(value);
        let _ = writeln!(
            text,
            "| {number} | `{name}` | {unit} | {allowed} | {default} | {value} | {meaning} |"
        );
    }
    generated::check("vehicle-file.md", "fields", &text);
}

#[test]
fn the_page_names_every_rule_between_fields() {
    let mut text = String::from("| Field | Rule | Why |\n|---|---|---|\n");
    for Relation {
        group,
        field,
        rule,
        why,
    } in RELATIONS
    {
        let _ = writeln!(text, "| `{group}.{field}` | {rule} | {why} |");
    }
    generated::check("vehicle-file.md", "relations", &text);
}

#[test]
fn the_page_names_every_planar_field() {
    let mut text = String::from("| Field | Allowed | Left out | Meaning |\n|---|---|---|---|\n");
    for Field {
        name,
        meaning,
        min,
        max,
        left_out,
        ..
    } in &PLANAR_FIELDS
    {
        let default = match left_out {
            LeftOut::Value(value) => value.to_string(),
            LeftOut::Refused | LeftOut::Rule(_) | LeftOut::OfSpar(_) => String::new(),
        };
        let _ = writeln!(text, "| `{name}` | {min} to {max} | {default} | {meaning} |");
    }
    generated::check("vehicle-file.md", "planar", &text);
}
