//! The reference vehicle for tests of this crate, which cannot use the vehicle-file crate: that one uses this.

use super::{Vehicle, VehicleParameters};

const FILE: &str = include_str!("../../../vehicles/reference.toml");

/// The number of `name` in the table `table` of [`FILE`], whose every line is a table, a number or a comment.
fn number(table: &str, name: &str) -> Option<f32> {
    let mut inside = false;
    for line in FILE.lines() {
        let line = line.split('#').next().unwrap_or(line).trim();
        if let Some(head) = line.strip_prefix('[') {
            inside = head.strip_suffix(']') == Some(table);
        } else if inside
            && let Some((key, value)) = line.split_once('=')
            && key.trim() == name
        {
            return value.trim().parse().ok();
        }
    }
    None
}

/// The reference vehicle.
pub(crate) fn reference() -> Vehicle<f32> {
    let parameters =
        VehicleParameters::try_from_source(true, |table, field| number(table, field.name).ok_or(field.name));
    Vehicle::new(parameters.expect("every field is there")).expect("the reference vehicle is good")
}
