//! The flags of `drive`, and what they name: scenario, vehicles.

use std::ops::RangeInclusive;
use std::path::{Path, PathBuf};

use clap::{Args, ValueEnum};
use firmware::drive_board::SCALES;
use model::vehicle::Vehicle;
use report::error::CommandError;
use virtual_board::scenario::file::{DEFAULT, DEFAULT_NAME};
use virtual_board::scenario::{Scenario, shipped};

/// Flags of `drive`.
#[derive(Debug, Args, Default)]
#[command(after_help = EXAMPLES)]
pub struct Arguments {
    /// Scenario file, or the name of a shipped scenario; the slope drive if left out
    pub scenario: Option<PathBuf>,
    /// Vehicle file; the scenario's, or the reference vehicle, if left out. Another vehicle than that is judged only by what
    /// holds of any: its faults, its mode at the end, and what is counted
    #[arg(long, value_name = "FILE")]
    pub vehicle: Option<PathBuf>,
    /// Vehicle file of the simulated vehicle, where it is another than the one that the firmware is given
    #[arg(long, value_name = "FILE")]
    pub plant_vehicle: Option<PathBuf>,
    /// Directory for the trace (CSV), the plots (SVG) and the firmware's log; out/drive if left out, none with --json
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// File for the record of every tick, which `replay` reads, NAME.mcap for other tools too; must not exist
    #[arg(long, value_name = "FILE", conflicts_with = "seeds")]
    pub record: Option<PathBuf>,
    /// Seed of the sensors' noise, instead of the scenario's
    #[arg(long, value_parser = crate::cli::campaign::seed, allow_negative_numbers = true)]
    pub seed: Option<u64>,
    /// First and last seed: one run for each, on all cores, and a table of what they spread over. Writes no files: not with
    /// --out, --record or --seed, which give one run
    #[arg(long, value_parser = crate::cli::campaign::seeds, value_name = "FIRST:LAST", conflicts_with_all = ["seed", "out"])]
    pub seeds: Option<RangeInclusive<u64>>,
    /// Leave the scenario's bounds aside: the run is reported, not judged
    #[arg(long)]
    pub no_bounds: bool,
    /// Print exactly one JSON object on stdout: the metrics and their bounds
    #[arg(long)]
    pub json: bool,
    /// What drives: the firmware's tasks on a virtual board, or the flashed ELF on an emulated one
    #[arg(long, value_enum, default_value_t)]
    pub board: BoardKind,
    /// ELF to run on the emulated board; the workspace's own, built if needed, if left out
    #[arg(long, value_name = "ELF")]
    pub firmware: Option<PathBuf>,
}

const EXAMPLES: &str = "\
Examples:
  hil-sim drive
  hil-sim drive kerb --seed 12 --json
  hil-sim drive my-scenario.toml --vehicle my-vehicle.toml --no-bounds
  hil-sim drive kerb --seeds 1:50
  hil-sim drive kerb --record kerb.mcap --out out/kerb
  hil-sim drive kerb --board emulated";

/// What runs a scenario.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, ValueEnum)]
pub enum BoardKind {
    /// The firmware's tasks in lockstep virtual time.
    #[default]
    Virtual,
    /// The release ELF on the emulated part.
    Emulated,
}

/// The scenario's file in messages.
pub fn file_name(arguments: &Arguments) -> std::path::Display<'_> {
    arguments
        .scenario
        .as_deref()
        .unwrap_or(Path::new(DEFAULT_NAME))
        .display()
}

/// The scenario that the flags name, the firmware's vehicle, and the simulated vehicle. For another vehicle than the
/// scenario's, only the bounds that apply to any vehicle remain.
///
/// # Errors
/// [`CommandError::Input`] on a bad file.
pub fn load_run(arguments: &Arguments) -> Result<(Scenario, Vehicle<f64>, Vehicle<f64>), CommandError> {
    let mut scenario = load_scenario(arguments)?;
    let (told, simulated) = load_vehicles(
        arguments.vehicle.as_deref(),
        arguments.plant_vehicle.as_deref(),
        &scenario,
    )?;
    if arguments.vehicle.is_some() {
        let own = load_vehicle(scenario.vehicle.as_deref()).ok();
        scenario.flown_by(&told, own.as_ref());
    }
    Ok((scenario, told, simulated))
}

/// The scenario that the flags name, with the changes that other flags make.
///
/// # Errors
/// [`CommandError::Input`] on a bad file.
pub fn load_scenario(arguments: &Arguments) -> Result<Scenario, CommandError> {
    let scenario = match &arguments.scenario {
        Some(path) => shipped::find(path),
        None => Scenario::parse(DEFAULT_NAME, DEFAULT),
    };
    let mut scenario = scenario.map_err(|error| CommandError::Input(error.to_string()))?;
    scenario.seed = arguments.seed.unwrap_or(scenario.seed);
    if arguments.no_bounds {
        scenario.metrics.clear();
    }
    Ok(scenario)
}

/// The vehicle of `path`, or the reference vehicle.
///
/// # Errors
/// [`CommandError::Input`] on a bad file.
pub fn load_vehicle(path: Option<&Path>) -> Result<Vehicle<f64>, CommandError> {
    let vehicle = match path {
        Some(path) => vehicle_file::read_vehicle_for(path, &SCALES.sensor_ranges()),
        None => vehicle_file::reference(),
    };
    vehicle.map_err(|error| CommandError::Input(error.to_string()))
}

/// The firmware's vehicle, from `vehicle` or else from the scenario, and the simulated vehicle: the same, unless
/// `plant_vehicle` names another.
///
/// # Errors
/// [`CommandError::Input`] on a bad file.
pub fn load_vehicles(
    vehicle: Option<&Path>,
    plant_vehicle: Option<&Path>,
    scenario: &Scenario,
) -> Result<(Vehicle<f64>, Vehicle<f64>), CommandError> {
    let told = load_vehicle(vehicle.or(scenario.vehicle.as_deref()))?;
    let simulated = match plant_vehicle {
        Some(path) => load_vehicle(Some(path))?,
        None => told,
    };
    Ok((told, simulated))
}

/// The vehicle in the board's single precision.
///
/// # Errors
/// [`CommandError::Other`]: the vehicle is not valid in single precision.
pub fn vehicle_f32(vehicle: &Vehicle<f64>) -> Result<Vehicle<f32>, CommandError> {
    Vehicle::new(vehicle.parameters().cast::<f32>()).map_err(|error| CommandError::Other(error.to_string()))
}
