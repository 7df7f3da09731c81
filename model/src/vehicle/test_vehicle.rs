//! The reference vehicle for this crate's tests. These tests cannot use the crate vehicle-file, because that crate
//! depends on this one.

use super::{Field, LeftOut, Vehicle, VehicleParameters};

const FILE: &str = include_str!("../../../vehicles/reference.toml");

/// The value of `field` in the table `table` of [`FILE`], whose every line is a table, a value or a comment.
fn value(table: &str, field: &Field) -> Option<f64> {
    let mut inside = false;
    for line in FILE.lines() {
        let line = line.split('#').next().unwrap_or(line).trim();
        if let Some(head) = line.strip_prefix('[') {
            inside = head.strip_suffix(']') == Some(table);
        } else if inside
            && let Some((key, value)) = line.split_once('=')
            && key.trim() == field.name
        {
            let value = value.trim();
            return match value.strip_prefix('"').and_then(|value| value.strip_suffix('"')) {
                Some(choice) => field.value_of(choice),
                None => value.parse().ok(),
            };
        }
    }
    None
}

/// The reference vehicle.
pub(crate) fn reference() -> Vehicle<f32> {
    let mut parameters =
        VehicleParameters::try_from_source(true, |table, field| match (value(table, field), field.left_out) {
            (Some(value), _) | (None, LeftOut::Value(value)) => Ok(value),
            (None, LeftOut::Rule(_)) => Ok(field.min),
            (None, LeftOut::Refused | LeftOut::OfSpar(_)) => Err(field.name),
        })
        .expect("every field is there");
    parameters.follow_rules(|table, field| value(table, field).is_none());
    Vehicle::new(parameters.cast()).expect("the reference vehicle is good")
}
