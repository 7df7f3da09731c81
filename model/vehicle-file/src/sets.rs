//! A set of parameters as the text of a vehicle file, and the differences of two sets.

use std::fmt::{self, Write as _};

use model::real::Real;
use model::vehicle::{Field, VehicleParameters};

/// Table, field and value of every parameter, in order.
fn named<T: Real>(parameters: &VehicleParameters<T>) -> Vec<(&'static str, &'static Field, T)> {
    (0..parameters.count())
        .filter_map(|number| {
            let (table, field) = parameters.field(number)?;
            Some((table, field, parameters.value(number)?))
        })
        .collect()
}

/// The text of a vehicle file with these parameters. [`parse`](crate::parse) reads the text back to the bit, also
/// from single precision.
///
/// ```
/// # let text = include_str!("../../../vehicles/reference.toml");
/// use vehicle_file::{VehicleFile, parse, to_toml};
/// let Ok(VehicleFile::Vehicle(vehicle)) = parse("reference.toml", text) else { panic!() };
/// let Ok(VehicleFile::Vehicle(again)) = parse("again.toml", &to_toml(vehicle.parameters())) else { panic!() };
/// assert_eq!(vehicle, again);
/// ```
pub fn to_toml<T: Real>(parameters: &VehicleParameters<T>) -> String {
    let mut text = String::new();
    let mut last = None;
    for (table, field, value) in named(parameters) {
        if last != Some(table) {
            let gap = if last.is_some() { "\n" } else { "" };
            let _ = writeln!(text, "{gap}[{table}]");
            last = Some(table);
        }
        let _ = match field.choice(value.to_f64()) {
            Some(choice) => writeln!(text, "{} = {choice:?}", field.name),
            // The shortest digits that read back as this number, with a point or an exponent.
            None => writeln!(text, "{} = {value:?}", field.name),
        };
    }
    text
}

/// A parameter in which two sets differ.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Difference<T> {
    /// The table of the vehicle file.
    pub table: &'static str,
    /// The field.
    pub name: &'static str,
    /// The first set's value; `None` if that set has no such parameter.
    pub before: Option<T>,
    /// The second set's value; `None` if that set has no such parameter.
    pub after: Option<T>,
}

/// `table.field: before -> after`; a set without the parameter has `-`.
impl<T: fmt::Debug> fmt::Display for Difference<T> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let shown = |value: &Option<T>| value.as_ref().map_or("-".to_owned(), |value| format!("{value:?}"));
        let Self {
            table,
            name,
            before,
            after,
        } = self;
        write!(f, "{table}.{name}: {} -> {}", shown(before), shown(after))
    }
}

/// The differences of two sets: the parameters of `before` in order, then the parameters that only `after` has.
pub fn diff<T: Real>(before: &VehicleParameters<T>, after: &VehicleParameters<T>) -> Vec<Difference<T>> {
    let (before, after) = (named(before), named(after));
    let value = |set: &[(&'static str, &'static Field, T)], table: &str, name: &str| {
        set.iter()
            .find(|(group, field, _)| *group == table && field.name == name)
            .map(|(.., value)| *value)
    };
    let only_after = after
        .iter()
        .filter(|(table, field, _)| value(&before, table, field.name).is_none());
    before
        .iter()
        .chain(only_after)
        .map(|(table, field, _)| Difference {
            table,
            name: field.name,
            before: value(&before, table, field.name),
            after: value(&after, table, field.name),
        })
        .filter(|difference| difference.before != difference.after)
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{VehicleFile, parse, reference};

    fn read(text: &str) -> VehicleParameters<f64> {
        match parse("set.toml", text) {
            Ok(VehicleFile::Vehicle(vehicle)) => *vehicle.parameters(),
            other => panic!("{other:?}\n{text}"),
        }
    }

    #[test]
    fn a_set_comes_back_from_its_text_to_the_bit() {
        let set = *reference().expect("valid").parameters();
        assert_eq!(read(&to_toml(&set)), set);
        // In single precision, as a board reports the set.
        let single = set.cast::<f32>();
        assert_eq!(read(&to_toml(&single)).cast::<f32>(), single);
        assert!(to_toml(&single).contains("\n[control]\n"));
        assert!(to_toml(&single).contains("wheel_radius_m = 0.25\n"), "no digits of f64");
        let without = VehicleParameters { spar: None, ..single };
        assert_eq!(read(&to_toml(&without)).cast::<f32>(), without);
    }

    /// Reading goes through double precision, which must not round to another number of single precision.
    #[test]
    fn every_number_of_single_precision_comes_back() {
        for step in 0..400_000_u32 {
            let number = f32::from_bits(step.wrapping_mul(0x9E37_79B9) & 0x7FFF_FFFF);
            if number.is_finite() {
                let again: f64 = format!("{number:?}").parse().expect("a number");
                assert_eq!((again as f32).to_bits(), number.to_bits(), "{number:?}");
            }
        }
    }

    #[test]
    fn a_difference_names_the_parameter_and_both_values() {
        let before = reference().expect("valid").parameters().cast::<f32>();
        assert_eq!(diff(&before, &before), []);
        let mut after = before;
        after.control.ki = 0.05;
        after.body.wheel_radius_m = 0.26;
        let told: Vec<String> = diff(&before, &after).iter().map(ToString::to_string).collect();
        let ki = before.control.ki;
        assert_eq!(
            told,
            [
                "body.wheel_radius_m: 0.25 -> 0.26".to_owned(),
                format!("control.ki: {ki:?} -> 0.05")
            ]
        );
        let without = VehicleParameters { spar: None, ..after };
        let lost = diff(&after, &without);
        let found = diff(&without, &after);
        assert_eq!((lost.len(), found.len()), (24, 24));
        assert!(lost.iter().all(|d| d.before.is_some() && d.after.is_none()));
        assert!(found.iter().all(|d| d.before.is_none() && d.after.is_some()));
        assert!(lost[0].to_string().ends_with("-> -"), "{}", lost[0]);
    }
}
