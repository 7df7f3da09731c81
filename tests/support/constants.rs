//! The constants of the sources, and the numbers that a page gives beside their names.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use super::files::files;

/// A constant's definition: its file, below the root, and its expression.
#[derive(Debug, Clone)]
struct Definition {
    file: String,
    kind: String,
    expression: String,
}

/// Every constant of the sources, by name; some names are defined in several files.
pub struct Constants(BTreeMap<String, Vec<Definition>>);

impl Constants {
    /// Reads the sources below `root`.
    pub fn of(root: &Path) -> Self {
        let mut all: BTreeMap<String, Vec<Definition>> = BTreeMap::new();
        let name_of = |path: &PathBuf| path.strip_prefix(root).expect("below").to_string_lossy().into_owned();
        for path in files(root, &["rs"]) {
            let text = std::fs::read_to_string(&path).expect("a source");
            for rest in text.split("const ").skip(1) {
                let Some((name, rest)) = rest.split_once(": ") else {
                    continue;
                };
                let Some((definition, _)) = rest.split_once(';') else {
                    continue;
                };
                let Some((kind, expression)) = definition.split_once(" = ") else {
                    continue;
                };
                if name
                    .chars()
                    .all(|c| c.is_ascii_uppercase() || c.is_ascii_digit() || c == '_')
                {
                    all.entry(name.to_owned()).or_default().push(Definition {
                        file: name_of(&path),
                        kind: kind.to_owned(),
                        expression: expression.to_owned(),
                    });
                }
            }
        }
        Self(all)
    }

    /// The values of a constant in each of its files, or in `file` alone; a duration in us. Empty if the name is no constant or its
    /// value is no number.
    pub fn values(&self, name: &str, file: Option<&str>) -> Vec<f64> {
        let definitions = self.0.get(name).map_or(&[][..], Vec::as_slice);
        definitions
            .iter()
            .filter(|definition| file.is_none_or(|file| definition.file == file))
            .filter_map(|definition| self.value(&definition.expression, &definition.file, 0))
            .collect()
    }

    /// Whether a constant is a duration, whose value is in us.
    pub fn is_duration(&self, name: &str) -> bool {
        self.0
            .get(name)
            .is_some_and(|all| all.iter().any(|one| one.kind == "Duration"))
    }

    /// The value of an expression of numbers, constants, `+ - * /` and `Duration::from_...`, from left to right with
    /// products first; `None` if it contains anything else.
    fn value(&self, expression: &str, file: &str, depth: usize) -> Option<f64> {
        if depth > 8 {
            return None;
        }
        let expression = expression.trim();
        let expression = expression.split_once(" as ").map_or(expression, |(value, _)| value);
        for (function, factor) in [("from_secs", 1e6), ("from_millis", 1e3), ("from_micros", 1.0)] {
            if let Some(inner) = expression.strip_prefix(&format!("Duration::{function}(")) {
                return Some(factor * self.value(inner.strip_suffix(')')?, file, depth + 1)?);
            }
        }
        for operator in [" + ", " - ", " * ", " / "] {
            if let Some((left, right)) = expression.rsplit_once(operator) {
                let (left, right) = (self.value(left, file, depth + 1)?, self.value(right, file, depth + 1)?);
                return Some(match operator {
                    " + " => left + right,
                    " - " => left - right,
                    " * " => left * right,
                    _ => left / right,
                });
            }
        }
        let plain: String = expression.chars().filter(|c| *c != '_').collect();
        let plain = ["f32", "f64", "u16", "u32", "u64", "usize"]
            .iter()
            .find_map(|kind| plain.strip_suffix(kind))
            .unwrap_or(&plain);
        if let Ok(number) = plain.parse() {
            return Some(number);
        }
        let definitions = self.0.get(expression.rsplit("::").next()?)?;
        let own = definitions.iter().find(|definition| definition.file == file);
        let definition = own.or_else(|| definitions.first().filter(|_| definitions.len() == 1))?;
        self.value(&definition.expression, &definition.file, depth + 1)
    }
}

/// Names of constants in brackets, with the sentence before the bracket.
pub struct Citation {
    /// The sentence up to the bracket, from an earlier bracket on.
    pub sentence: String,
    pub names: Vec<String>,
    /// The file that is said to define them.
    pub file: Option<String>,
}

/// The citations in the prose of a page: `(`NAME`, `NAME` in `FILE`)`.
pub fn citations(prose: &str) -> Vec<Citation> {
    let mut found = Vec::new();
    for block in prose
        .split("\n\n")
        .flat_map(|block| block.split("\n- "))
        .flat_map(|block| block.split('|'))
    {
        let block = block.split_whitespace().collect::<Vec<_>>().join(" ");
        for (at, _) in block.match_indices("(`") {
            let Some((inside, _)) = block[at + 1..].split_once(')') else {
                continue;
            };
            let (names, file) = match inside.split_once(" in ") {
                Some((names, file)) => (names, file.split('`').nth(1).map(str::to_owned)),
                None => (inside, None),
            };
            let names = names.split('`').skip(1).step_by(2).map(str::to_owned).collect();
            // A number before an earlier bracket belongs to that bracket.
            let since = block[..at].rsplit("`)").next().unwrap_or_default();
            let sentence = since.rsplit(". ").next().unwrap_or_default().to_owned();
            found.push(Citation { sentence, names, file });
        }
    }
    found
}

/// The numbers of a sentence, each with the word behind it, which may be its unit.
pub fn numbers(sentence: &str) -> Vec<(f64, String)> {
    let words: Vec<&str> = sentence.split(' ').collect();
    words
        .iter()
        .enumerate()
        .filter_map(|(at, word)| {
            let number = word.trim_end_matches(',').replace(',', "").parse().ok()?;
            let unit = words
                .get(at + 1)
                .map_or("", |unit| unit.trim_end_matches([',', ';', ':']));
            Some((number, unit.to_owned()))
        })
        .collect()
}

/// Converts a number with this unit into the unit of the constant of this name; `None` if the two units do not fit.
pub fn in_unit_of(constant: &str, is_duration: bool, number: f64, unit: &str, tick_us: f64) -> Option<f64> {
    let has = |suffix: &str| constant.ends_with(suffix);
    let us = match unit {
        "us" => Some(number),
        "ms" => Some(1e3 * number),
        "s" => Some(1e6 * number),
        "ticks" => Some(tick_us * number),
        _ => None,
    };
    if is_duration || has("_US") {
        us
    } else if has("_MS") {
        us.map(|us| us / 1e3)
    } else if has("_TICKS") {
        us.map(|us| us / tick_us)
    } else if has("_RAD_S") {
        (unit == "rad/s").then_some(number)
    } else if has("_M_S2") {
        (unit == "m/s^2").then_some(number)
    } else if has("_M_S") {
        (unit == "m/s").then_some(number)
    } else if has("_RAD") {
        match unit {
            "rad" => Some(number),
            "deg" => Some(number.to_radians()),
            _ => None,
        }
    } else if has("_S") {
        us.map(|us| us / 1e6)
    } else if has("_A") {
        (unit == "A").then_some(number)
    } else if has("_V") {
        (unit == "V").then_some(number)
    } else if has("_PERCENT") {
        (unit == "%").then_some(number)
    } else if has("_SHARE") {
        (unit == "%").then_some(number / 100.0)
    } else if has("_BYTES") {
        match unit {
            "bytes" => Some(number),
            "KiB" => Some(1024.0 * number),
            "MiB" => Some(1024.0 * 1024.0 * number),
            _ => None,
        }
    } else {
        None
    }
}
