//! What the command line does with a board's parameters.

use std::io::Write;
use std::path::{Path, PathBuf};

use clap::Subcommand;
use model::vehicle::{Field, Vehicle};
use report::error::CommandError;
use theory::analysis::design_check::{Severity, check};

use super::console::Console;
use super::files::into_new_file;
use super::session::Link;
use super::wire::Wire;

/// What to do with parameters.
#[derive(Debug, Subcommand)]
pub(super) enum ParameterAction {
    /// Shows every parameter as the board has it, with its range and meaning
    #[command(after_help = "Examples:\n  hil-sim link --port /dev/ttyACM0 parameters list")]
    List,
    /// Changes parameters, stores the set in the board's flash and puts it in force
    #[command(
        after_help = "Examples:\n  hil-sim link --port /dev/ttyACM0 parameters set control.speed_max_m_s=1 control.comfort_s=0.2"
    )]
    Set {
        /// `table.name=value`, as in the vehicle file; several at once
        #[arg(required = true)]
        assignments: Vec<String>,
    },
    /// Goes back to the set the firmware was built with
    #[command(
        after_help = "Examples:\n  hil-sim link --port /dev/ttyACM0 parameters built-in",
        alias = "defaults"
    )]
    BuiltIn,
    /// Writes the board's set to a vehicle file
    #[command(after_help = "Examples:\n  hil-sim link --port /dev/ttyACM0 parameters dump my-vehicle.toml")]
    Dump {
        /// The file; must not exist
        file: PathBuf,
    },
    /// Stores a vehicle file's set in the board and puts it in force
    #[command(after_help = "Examples:\n  hil-sim link --port /dev/ttyACM0 parameters load my-vehicle.toml")]
    Load {
        /// The file
        file: PathBuf,
    },
    /// Shows how the board's set differs from a vehicle file's, the board's value first; exit code 1 if it does
    #[command(after_help = "Examples:\n  hil-sim link --port /dev/ttyACM0 parameters diff my-vehicle.toml")]
    Diff {
        /// The file
        file: PathBuf,
    },
}

/// One action on the board's parameters.
pub(super) fn parameters_of<W: Wire, O: Write>(
    link: &mut Link<W>,
    action: &ParameterAction,
    console: &mut Console<O>,
) -> Result<(), CommandError> {
    match action {
        ParameterAction::List => {
            let parameters = link.parameters()?;
            for number in 0..parameters.count() {
                if let (Some((table, field)), Some(value)) = (parameters.field(number), parameters.value(number)) {
                    console.line(&format!("{table}.{} = {value}   {}", field.name, about(field)))?;
                }
            }
            Ok(())
        }
        ParameterAction::Set { assignments } => {
            link.set(assignments)?;
            console.line("stored, and in force")
        }
        ParameterAction::BuiltIn => {
            link.built_in()?;
            console.line("the set that the firmware was built with is stored, and in force")
        }
        ParameterAction::Dump { file } => {
            let text = vehicle_file::to_toml(&link.parameters()?);
            into_new_file("FILE", file, |out| Ok(out.write_all(text.as_bytes())?))?;
            console.line(&format!("wrote {}", file.display()))
        }
        ParameterAction::Load { file } => {
            let wanted = read_drivable(file)?.parameters().cast::<f32>();
            let differences = link.load(file, &wanted)?;
            for difference in &differences {
                console.line(&difference.to_string())?;
            }
            console.line(&format!("parameters changed: {}", differences.len()))
        }
        ParameterAction::Diff { file } => {
            let wanted = read(file)?.parameters().cast::<f32>();
            let differences = link.differences(file, &wanted)?;
            for difference in &differences {
                console.line(&difference.to_string())?;
            }
            if differences.is_empty() {
                Ok(())
            } else {
                Err(CommandError::Checks(format!(
                    "parameters that differ: {}",
                    differences.len()
                )))
            }
        }
    }
}

/// The vehicle of a file.
fn read(file: &Path) -> Result<Vehicle<f64>, CommandError> {
    vehicle_file::read_vehicle(file).map_err(|error| CommandError::Input(error.to_string()))
}

/// As [`read`], for a board that is to drive with the set.
fn read_drivable(file: &Path) -> Result<Vehicle<f64>, CommandError> {
    let vehicle = read(file)?;
    match check(&vehicle).of(Severity::Error).next() {
        None => Ok(vehicle),
        Some(finding) => Err(CommandError::Input(format!(
            "{}: such a vehicle cannot be driven: {}: {} (`hil-sim check` shows everything)",
            file.display(),
            finding.field,
            finding.text
        ))),
    }
}

/// A parameter's range or choices, and its meaning.
fn about(field: &Field) -> String {
    let meaning = field.meaning.trim();
    if field.choices.is_empty() {
        return format!("{} to {}: {meaning}", field.min, field.max);
    }
    let choices: Vec<String> = field
        .choices
        .iter()
        .enumerate()
        .map(|(value, name)| format!("{value} ({name})"))
        .collect();
    format!("{}: {meaning}", choices.join(", "))
}
