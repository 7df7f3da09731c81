//! Vehicle files: one TOML description of a vehicle, checked once, used by the host tool and turned
//! into constants by the firmware's build script.
//!
//! A file holds either every table of [`VehicleParameters`] in SI units, or, for analysis of the
//! planar vehicle alone, one table `[planar]` with the nondimensional numbers
//! `l, alpha, zeta, mu, nu, beta`.
#![forbid(unsafe_code)]

use std::fmt::Write as _;
use std::path::Path;

use model::dynamics::planar::PlanarParameters;
use model::vehicle::{
    BatteryParameters, BodyParameters, CameraMotorParameters, CameraParameters, ControlParameters,
    DriveMotorParameters, EstimatorParameters, Field, ImuParameters, ParameterError, SafetyParameters, Vehicle,
    VehicleParameters,
};
use toml::{Table, Value};

mod sets;

pub use sets::{Difference, diff, to_toml};

/// What is wrong with a vehicle file. Every message names the file, and where there is one the field
/// and its allowed range.
#[derive(Debug, thiserror::Error)]
pub enum VehicleFileError {
    /// The file cannot be read.
    #[error("{file}: {reason}")]
    Unreadable {
        /// The file.
        file: String,
        /// Why.
        reason: String,
    },
    /// The file is not TOML.
    #[error("{file}: not valid TOML: {reason}")]
    Syntax {
        /// The file.
        file: String,
        /// Where and why.
        reason: String,
    },
    /// A table is missing.
    #[error("{file}: table [{table}] is missing")]
    MissingTable {
        /// The file.
        file: String,
        /// The table.
        table: &'static str,
    },
    /// A field is missing.
    #[error("{file}: {table}.{name} is missing: allowed is {min} to {max}")]
    MissingField {
        /// The file.
        file: String,
        /// The table.
        table: &'static str,
        /// The field.
        name: &'static str,
        /// Smallest allowed value.
        min: f64,
        /// Largest allowed value.
        max: f64,
    },
    /// A field is not a number.
    #[error("{file}: {table}.{name} is not a number: allowed is {min} to {max}")]
    NotANumber {
        /// The file.
        file: String,
        /// The table.
        table: &'static str,
        /// The field.
        name: &'static str,
        /// Smallest allowed value.
        min: f64,
        /// Largest allowed value.
        max: f64,
    },
    /// A name that means nothing here.
    #[error("{file}: unknown name `{name}`: allowed here is {allowed}")]
    Unknown {
        /// The file.
        file: String,
        /// The name with its table.
        name: String,
        /// The names that are known at this place.
        allowed: String,
    },
    /// A value out of range, or values that contradict each other.
    #[error("{file}: {error}")]
    Parameter {
        /// The file.
        file: String,
        /// The field, its value and what is allowed.
        error: ParameterError,
    },
}

/// What a vehicle file describes.
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
/// The first thing wrong with it.
pub fn read(path: &Path) -> Result<VehicleFile, VehicleFileError> {
    let file = path.display().to_string();
    let text = std::fs::read_to_string(path).map_err(|error| VehicleFileError::Unreadable {
        file: file.clone(),
        reason: error.to_string(),
    })?;
    parse(&file, &text)
}

/// Reads and checks a whole vehicle; a `[planar]` file is refused.
///
/// # Errors
/// The first thing wrong with the file.
pub fn read_vehicle(path: &Path) -> Result<Vehicle<f64>, VehicleFileError> {
    whole_vehicle(&path.display().to_string(), read(path)?)
}

/// The text of the reference vehicle's file.
pub const REFERENCE: &str = include_str!("../../../vehicles/reference.toml");
/// Its name in messages.
pub const REFERENCE_NAME: &str = "vehicles/reference.toml";

/// The reference vehicle.
///
/// # Errors
/// The first thing wrong with the file that this crate was built with.
pub fn reference() -> Result<Vehicle<f64>, VehicleFileError> {
    whole_vehicle(REFERENCE_NAME, parse(REFERENCE_NAME, REFERENCE)?)
}

fn whole_vehicle(file: &str, described: VehicleFile) -> Result<Vehicle<f64>, VehicleFileError> {
    match described {
        VehicleFile::Vehicle(vehicle) => Ok(*vehicle),
        VehicleFile::Planar(_) => Err(VehicleFileError::MissingTable {
            file: file.to_owned(),
            table: BodyParameters::<f64>::TABLE,
        }),
    }
}

/// Checks the text of a vehicle file; `file` is the name used in messages.
///
/// # Errors
/// The first thing wrong with it.
pub fn parse(file: &str, text: &str) -> Result<VehicleFile, VehicleFileError> {
    let root: Table = text
        .parse()
        .map_err(|error: toml::de::Error| VehicleFileError::Syntax {
            file: file.to_owned(),
            reason: error.to_string().trim_end().replace('\n', "\n  "),
        })?;
    let reader = Reader { file, root: &root };
    if root.contains_key(PLANAR) {
        reader.only_known(&[PLANAR])?;
        return reader.planar().map(VehicleFile::Planar);
    }
    reader.only_known(&TABLES)?;
    let camera = if root.contains_key(CameraParameters::<f64>::TABLE)
        || root.contains_key(CameraMotorParameters::<f64>::TABLE)
    {
        Some((
            CameraParameters::try_from_fields(
                reader.table(CameraParameters::<f64>::TABLE, CameraParameters::<f64>::FIELDS)?,
            )?,
            CameraMotorParameters::try_from_fields(reader.table(
                CameraMotorParameters::<f64>::TABLE,
                CameraMotorParameters::<f64>::FIELDS,
            )?)?,
        ))
    } else {
        None
    };
    macro_rules! group {
        ($group:ident) => {
            $group::try_from_fields(reader.table($group::<f64>::TABLE, $group::<f64>::FIELDS)?)?
        };
    }
    let parameters = VehicleParameters {
        body: group!(BodyParameters),
        drive_motor: group!(DriveMotorParameters),
        camera,
        imu: group!(ImuParameters),
        battery: group!(BatteryParameters),
        control: group!(ControlParameters),
        estimator: group!(EstimatorParameters),
        safety: group!(SafetyParameters),
    };
    Vehicle::new(parameters)
        // The firmware has it in single precision: what is on the edge there is refused here too.
        .and_then(|vehicle| Vehicle::new(parameters.cast::<f32>()).map(|_| vehicle))
        .map(|vehicle| VehicleFile::Vehicle(Box::new(vehicle)))
        .map_err(|error| VehicleFileError::Parameter {
            file: file.to_owned(),
            error,
        })
}

const PLANAR: &str = "planar";

const TABLES: [&str; 9] = [
    BodyParameters::<f64>::TABLE,
    DriveMotorParameters::<f64>::TABLE,
    CameraParameters::<f64>::TABLE,
    CameraMotorParameters::<f64>::TABLE,
    ImuParameters::<f64>::TABLE,
    BatteryParameters::<f64>::TABLE,
    ControlParameters::<f64>::TABLE,
    EstimatorParameters::<f64>::TABLE,
    SafetyParameters::<f64>::TABLE,
];

/// The nondimensional planar vehicle; `beta` may be left out (0).
const PLANAR_FIELDS: [Field; 6] = {
    const fn field(name: &'static str, meaning: &'static str, min: f64, max: f64) -> Field {
        Field {
            name,
            meaning,
            min,
            max,
        }
    }
    [
        field("l", "l / r", 0.001, 100.0),
        field("alpha", "m / (M + m)", 0.000_001, 0.999_999),
        field("zeta", "total damping", 0.0, 1000.0),
        field("mu", "wheel inertia", 0.0, 100.0),
        field("nu", "reflected rotor inertia", 0.0, 100.0),
        field("beta", "slope, rad", -1.5, 1.5),
    ]
};

struct Reader<'a> {
    file: &'a str,
    root: &'a Table,
}

impl<'a> Reader<'a> {
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

    /// The source of a group's values: the table, checked for unknown names.
    fn table<'s>(
        &'s self,
        table: &'static str,
        fields: &'static [Field],
    ) -> Result<impl FnMut(&'static Field) -> Result<f64, VehicleFileError> + use<'a, 's>, VehicleFileError> {
        let Some(Value::Table(values)) = self.root.get(table) else {
            return Err(VehicleFileError::MissingTable {
                file: self.file.to_owned(),
                table,
            });
        };
        if let Some(name) = values.keys().find(|key| !fields.iter().any(|f| f.name == key.as_str())) {
            let known: Vec<&str> = fields.iter().map(|f| f.name).collect();
            return Err(self.unknown(format!("{table}.{name}"), &known));
        }
        Ok(move |field: &'static Field| {
            let Field { name, min, max, .. } = *field;
            let file = || self.file.to_owned();
            match values.get(name) {
                None => Err(VehicleFileError::MissingField {
                    file: file(),
                    table,
                    name,
                    min,
                    max,
                }),
                Some(Value::Float(x)) => Ok(*x),
                Some(Value::Integer(i)) => Ok(*i as f64),
                Some(_) => Err(VehicleFileError::NotANumber {
                    file: file(),
                    table,
                    name,
                    min,
                    max,
                }),
            }
        })
    }

    fn planar(&self) -> Result<PlanarParameters<f64>, VehicleFileError> {
        let mut source = self.table(PLANAR, &PLANAR_FIELDS)?;
        let mut value = |field: &'static Field| match source(field) {
            Err(VehicleFileError::MissingField {
                name: "beta" | "nu", ..
            }) => Ok(0.0),
            Ok(value) if !field.allows(value) => Err(VehicleFileError::Parameter {
                file: self.file.to_owned(),
                error: model::vehicle::OutOfRange {
                    group: PLANAR,
                    field: *field,
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
    let p = vehicle.parameters().cast::<f32>();
    let mut source = String::from(
        "/// The vehicle this firmware was built for.\npub const PARAMETERS: model::vehicle::VehicleParameters<f32> = model::vehicle::VehicleParameters {\n",
    );
    macro_rules! group {
        ($name:literal, $type:literal, $group:expr) => {{
            source.push_str($name);
            let _ = write!(source, "model::vehicle::{} {{ ", $type);
            $group.for_each(|field, value| {
                let _ = write!(source, "{}: f32::from_bits(0x{:08x}), ", field.name, value.to_bits());
            });
            source.push_str("}");
        }};
    }
    group!("body: ", "BodyParameters", p.body);
    group!(",\ndrive_motor: ", "DriveMotorParameters", p.drive_motor);
    match &p.camera {
        None => source.push_str(",\ncamera: None"),
        Some((camera, motor)) => {
            group!(",\ncamera: Some((", "CameraParameters", camera);
            group!(", ", "CameraMotorParameters", motor);
            source.push_str("))");
        }
    }
    group!(",\nimu: ", "ImuParameters", p.imu);
    group!(",\nbattery: ", "BatteryParameters", p.battery);
    group!(",\ncontrol: ", "ControlParameters", p.control);
    group!(",\nestimator: ", "EstimatorParameters", p.estimator);
    group!(",\nsafety: ", "SafetyParameters", p.safety);
    source.push_str(",\n};\n");
    source
}

#[cfg(test)]
mod documentation;
#[cfg(test)]
mod tests;
