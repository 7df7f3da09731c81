//! A set of parameters as the text of a vehicle file.

use std::fmt::{Debug, Write as _};

use model::real::Real;
use model::vehicle::VehicleParameters;

/// The text of a vehicle file that holds these parameters. [`read`](crate::read) gives them back to the bit, also in
/// single precision.
pub fn to_toml<T: Real + Debug>(parameters: &VehicleParameters<T>) -> String {
    let mut text = String::new();
    let mut last = None;
    for number in 0..parameters.count() {
        let (Some((table, field)), Some(value)) = (parameters.field(number), parameters.value(number)) else {
            continue;
        };
        if last != Some(table) {
            let gap = if last.is_some() { "\n" } else { "" };
            let _ = writeln!(text, "{gap}[{table}]");
            last = Some(table);
        }
        let _ = match field.choice(value.to_f64()) {
            Some(choice) => writeln!(text, "{} = {choice:?}", field.name),
            // The shortest digits that give this number again, with a point or an exponent.
            None => writeln!(text, "{} = {value:?}", field.name),
        };
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{VehicleFile, parse, reference};

    #[test]
    fn a_set_comes_back_from_its_text_to_the_bit() {
        let single = reference().expect("valid").parameters().cast::<f32>();
        for set in [single, VehicleParameters { spar: None, ..single }] {
            let Ok(VehicleFile::Vehicle(again)) = parse("set.toml", &to_toml(&set)) else {
                panic!("{}", to_toml(&set))
            };
            assert_eq!(again.parameters().cast::<f32>(), set);
        }
    }
}
