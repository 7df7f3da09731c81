//! Vehicle files: one TOML description of a vehicle, checked once. The host tool reads the description, and the
//! firmware's build script turns it into constants.
//!
//! A file holds either every table of [`VehicleParameters`] in SI units, or, for analysis of the
//! planar vehicle alone, one table `[planar]` with the nondimensional numbers
//! `l, alpha, zeta, mu, nu, beta`.
#![forbid(unsafe_code)]

use std::fmt::Write as _;
use std::io::Write as _;
use std::path::Path;

mod error;

pub use error::VehicleFileError;

use model::board::SensorRanges;
use model::dynamics::planar::PlanarParameters;
use model::vehicle::{Field, LeftOut, RENAMED, Vehicle, VehicleParameters};
use toml::{Table, Value};

pub mod place;
mod planar;
mod sets;
mod text;

use place::syntax_error;
use planar::PLANAR_FIELDS;
pub use sets::{Difference, diff, to_toml};
pub use text::{TEXT_MAX_BYTES, open_file, read_bytes, read_text};

/// The contents of a vehicle file.
#[derive(Debug, Clone, PartialEq)]
pub enum VehicleFile {
    /// A whole vehicle in SI units.
    Vehicle(Box<Vehicle<f64>>),
    /// The nondimensional planar vehicle only: enough for analysis, not for driving.
    Planar(PlanarParameters<f64>),
}

/// Reads and checks the vehicle file at `path`.
///
/// # Errors
/// The first error in the file.
pub fn read(path: &Path) -> Result<VehicleFile, VehicleFileError> {
    let (file, text) = file_and_text(path)?;
    parse(&file, &text)
}

fn file_and_text(path: &Path) -> Result<(String, String), VehicleFileError> {
    let file = path.display().to_string();
    match read_text(path) {
        Ok(text) => Ok((file, text)),
        Err(reason) => Err(VehicleFileError::Unreadable { file, reason }),
    }
}

/// Reads and checks a whole vehicle; refuses a `[planar]` file.
///
/// # Errors
/// The first error in the file.
pub fn read_vehicle(path: &Path) -> Result<Vehicle<f64>, VehicleFileError> {
    whole_vehicle(&path.display().to_string(), read(path)?)
}

/// Reads and checks a whole vehicle for a board with these sensors: every limit must be within the sensors' range.
///
/// # Errors
/// The first error in the file.
pub fn read_vehicle_for(path: &Path, ranges: &SensorRanges) -> Result<Vehicle<f64>, VehicleFileError> {
    let (file, text) = file_and_text(path)?;
    parse_vehicle_for(&file, &text, ranges)
}

/// As [`read_vehicle_for`], from a file's text; `file` is the name used in messages.
///
/// # Errors
/// The first error in the text.
pub fn parse_vehicle_for(file: &str, text: &str, ranges: &SensorRanges) -> Result<Vehicle<f64>, VehicleFileError> {
    let vehicle = whole_vehicle(file, parse(file, text)?)?;
    let checked = vehicle.check_on(ranges);
    checked.map_err(|error| VehicleFileError::of_parameter(file, error).placed(text))?;
    Ok(vehicle)
}

/// The text of the reference vehicle's file.
pub const REFERENCE: &str = include_str!("../../../vehicles/reference.toml");
/// Its name in messages.
pub const REFERENCE_NAME: &str = "vehicles/reference.toml";

/// The reference vehicle.
///
/// # Errors
/// The first error in the reference file that was built into this crate.
pub fn reference() -> Result<Vehicle<f64>, VehicleFileError> {
    whole_vehicle(REFERENCE_NAME, parse(REFERENCE_NAME, REFERENCE)?)
}

fn whole_vehicle(file: &str, described: VehicleFile) -> Result<Vehicle<f64>, VehicleFileError> {
    match described {
        VehicleFile::Vehicle(vehicle) => Ok(*vehicle),
        VehicleFile::Planar(_) => Err(VehicleFileError::MissingTable {
            file: file.to_owned(),
            table: TABLES[0].name,
        }),
    }
}

/// Checks the text of a vehicle file; `file` is the name used in messages.
///
/// # Errors
/// The first error in the file.
pub fn parse(file: &str, text: &str) -> Result<VehicleFile, VehicleFileError> {
    let root: Table = text
        .parse()
        .map_err(|error: toml::de::Error| VehicleFileError::Syntax {
            file: file.to_owned(),
            reason: syntax_error(text, &error),
        })?;
    described(file, root).map_err(|error| error.placed(text))
}

/// The contents of a file's root table.
fn described(file: &str, mut root: Table) -> Result<VehicleFile, VehicleFileError> {
    for (old, new) in rename(&mut root) {
        // Not `eprintln!`, which panics when the reader has closed the stream. A path may contain characters that act
        // on a terminal.
        let file = file.escape_debug();
        let _ = writeln!(
            std::io::stderr(),
            "{file}: `{old}` is called `{new}` now: please rename it"
        );
    }
    if root.contains_key("duration_s") {
        return Err(VehicleFileError::Scenario { file: file.to_owned() });
    }
    let with_spar = TABLES
        .iter()
        .any(|table| table.of_spar && root.contains_key(table.name));
    let reader = Reader {
        file,
        root: &root,
        with_spar,
    };
    if root.contains_key(PLANAR) {
        reader.only_known(&[PLANAR])?;
        return reader.planar().map(VehicleFile::Planar);
    }
    let tables: Vec<&str> = TABLES.iter().map(|table| table.name).collect();
    reader.only_known(&tables)?;
    let tables = || TABLES.iter().filter(|table| with_spar || !table.of_spar);
    // An unknown name may be a misspelt field that is also missing.
    for table in tables().filter(|table| root.contains_key(table.name)) {
        reader.only_known_fields(table.name, table.fields)?;
    }
    reader.whole(tables())?;
    for table in tables() {
        reader.only_known_fields(table.name, table.fields)?;
    }
    let mut parameters = VehicleParameters::try_from_source(with_spar, |table, field| reader.value(table, field))?;
    parameters.follow_rules(|table, field| reader.written(table, field).is_none());
    Vehicle::new(parameters)
        // The firmware uses single precision: a value that is out of range there is refused here too.
        .and_then(|vehicle| Vehicle::new(parameters.cast::<f32>()).map(|_| vehicle))
        .map(|vehicle| VehicleFile::Vehicle(Box::new(vehicle)))
        .map_err(|error| VehicleFileError::of_parameter(file, error))
}

const PLANAR: &str = "planar";

const TABLES: &[model::vehicle::Table] = VehicleParameters::<f64>::TABLES;

/// Replaces the old names of [`RENAMED`] by the new names, unless the file has both; returns the replaced pairs. A
/// file with an old name is read as if it had the new name, and a line on standard error asks for the change.
fn rename(root: &mut Table) -> Vec<(&'static str, &'static str)> {
    let mut met = Vec::new();
    for (old, new) in RENAMED.iter().copied() {
        let (holder, from, to) = match (old.split_once('.'), new.split_once('.')) {
            (Some((table, from)), Some((_, to))) => (root.get_mut(table).and_then(Value::as_table_mut), from, to),
            _ => (Some(&mut *root), old, new),
        };
        if let Some(holder) = holder
            && !holder.contains_key(to)
            && let Some(value) = holder.remove(from)
        {
            holder.insert(to.to_owned(), value);
            met.push((old, new));
        }
    }
    met
}

/// A value as the file writes it. A long value is cut off.
fn shown(value: &Value) -> String {
    const LONGEST: usize = 40;
    let text = value.to_string();
    match text.char_indices().nth(LONGEST) {
        Some((end, _)) => format!("{}...", &text[..end]),
        None => text,
    }
}

/// A file's root table, read with the file's name in every message.
struct Reader<'a> {
    file: &'a str,
    root: &'a Table,
    with_spar: bool,
}

impl Reader<'_> {
    fn only_known(&self, known: &[&str]) -> Result<(), VehicleFileError> {
        match self.root.keys().find(|key| !known.contains(&key.as_str())) {
            None => Ok(()),
            Some(name) => Err(self.unknown(name.clone(), known)),
        }
    }

    fn unknown(&self, name: String, known: &[&str]) -> VehicleFileError {
        VehicleFileError::Unknown {
            file: self.file.to_owned(),
            name,
            allowed: known.join(", "),
        }
    }

    /// Refuses a missing table, unless all its fields are optional, and refuses unknown names in the table.
    fn only_known_fields(&self, table: &'static str, fields: &[Field]) -> Result<(), VehicleFileError> {
        if !self.root.contains_key(table) && fields.iter().all(|field| field.is_optional(self.with_spar)) {
            return Ok(());
        }
        let values = self.table(table)?;
        match values.keys().find(|key| !fields.iter().any(|f| f.name == key.as_str())) {
            None => Ok(()),
            Some(name) => {
                let known: Vec<&str> = fields.iter().map(|f| f.name).collect();
                Err(self.unknown(format!("{table}.{name}"), &known))
            }
        }
    }

    /// Names all missing tables and fields at once. The reader of a single missing table or field reports that one.
    fn whole<'t>(&self, tables: impl Iterator<Item = &'t model::vehicle::Table>) -> Result<(), VehicleFileError> {
        let (mut count, mut single, mut skeleton) = (0, true, String::new());
        for table in tables {
            let values = self.root.get(table.name).and_then(Value::as_table);
            let required = table.fields.iter().filter(|field| !field.is_optional(self.with_spar));
            let missing: Vec<&Field> = required
                .filter(|field| values.is_none_or(|values| !values.contains_key(field.name)))
                .collect();
            if missing.is_empty() {
                continue;
            }
            single = count == 0 && (values.is_none() || missing.len() == 1);
            count += missing.len();
            let _ = writeln!(skeleton, "  [{}]", table.name);
            for field in missing {
                let Field { name, min, max, .. } = field;
                let _ = match field.choices {
                    [] => writeln!(skeleton, "  {name} =    # {min} to {max}: {}", field.meaning.trim()),
                    choices => writeln!(
                        skeleton,
                        "  {name} =    # {}: {}",
                        error::quoted(choices),
                        field.meaning.trim()
                    ),
                };
            }
        }
        if single {
            return Ok(());
        }
        Err(VehicleFileError::MissingFields {
            file: self.file.to_owned(),
            count,
            skeleton: skeleton.trim_end().to_owned(),
        })
    }

    fn table(&self, table: &'static str) -> Result<&Table, VehicleFileError> {
        match self.root.get(table) {
            Some(Value::Table(values)) => Ok(values),
            Some(value) => Err(VehicleFileError::NotATable {
                file: self.file.to_owned(),
                table,
                value: shown(value),
            }),
            None => Err(VehicleFileError::MissingTable {
                file: self.file.to_owned(),
                table,
            }),
        }
    }

    /// The file's value of one field.
    fn written(&self, table: &str, field: &Field) -> Option<&Value> {
        self.root.get(table)?.as_table()?.get(field.name)
    }

    /// The value of one field. A field that is left to its rule has the smallest allowed value until the rule sets
    /// it.
    fn value(&self, table: &'static str, field: &'static Field) -> Result<f64, VehicleFileError> {
        let Field {
            name,
            min,
            max,
            choices,
            ..
        } = *field;
        let file = || self.file.to_owned();
        let written = self.written(table, field);
        match (written, field.left_out) {
            (None, LeftOut::Value(value)) => return Ok(value),
            (None, LeftOut::OfSpar(value)) if !self.with_spar => return Ok(value),
            (None, LeftOut::Rule(_)) => return Ok(min),
            _ => {}
        }
        match written {
            value if !choices.is_empty() => value
                .and_then(Value::as_str)
                .and_then(|value| field.value_of(value))
                .ok_or_else(|| VehicleFileError::NotAChoice {
                    file: file(),
                    table,
                    name,
                    value: value.map(shown),
                    choices,
                }),
            None => Err(VehicleFileError::MissingField {
                file: file(),
                table,
                name,
                min,
                max,
            }),
            Some(Value::Float(x)) => Ok(*x),
            Some(Value::Integer(i)) => Ok(*i as f64),
            Some(value) => Err(VehicleFileError::NotANumber {
                file: file(),
                table,
                name,
                value: shown(value),
                min,
                max,
            }),
        }
    }

    fn planar(&self) -> Result<PlanarParameters<f64>, VehicleFileError> {
        self.only_known_fields(PLANAR, &PLANAR_FIELDS)?;
        let value = |field: &'static Field| match self.value(PLANAR, field) {
            Ok(value) if !field.allows(value) => Err(VehicleFileError::Parameter {
                file: self.file.to_owned(),
                error: model::vehicle::OutOfRange {
                    group: PLANAR,
                    field,
                    value,
                }
                .into(),
            }),
            other => other,
        };
        let [l, alpha, zeta, mu, nu, beta] = &PLANAR_FIELDS;
        Ok(PlanarParameters {
            l: value(l)?,
            alpha: value(alpha)?,
            zeta: value(zeta)?,
            mu: value(mu)?,
            nu: value(nu)?,
            beta: value(beta)?,
        })
    }
}

/// Rust source of the vehicle's parameters as `f32` constants, exact to the bit:
/// `pub const PARAMETERS: model::vehicle::VehicleParameters<f32> = …;`.
pub fn to_rust(vehicle: &Vehicle<f64>) -> String {
    // The values' debug form is an expression: structs by name, each number in the shortest decimal form that
    // reads back as the same bits.
    format!(
        "/// The vehicle this firmware was built for.\n\
         pub const PARAMETERS: model::vehicle::VehicleParameters<f32> = {{\n\
         #[allow(clippy::wildcard_imports)] // Whatever groups there are.\n\
         use model::vehicle::*;\n\
         {:#?}\n}};\n",
        vehicle.parameters().cast::<f32>()
    )
}

#[cfg(test)]
mod documentation;
#[cfg(test)]
mod tests;
