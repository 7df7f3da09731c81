//! `hil-sim kernel`: the arm's viability kernel, and the share of it that the flown barrier keeps.

use std::path::PathBuf;

use clap::Args;
use model::control::landing::LandingLaw;
use model::sample::TICK_S;
use model::vehicle::{BRIDGE_SHARE, Vehicle};
use serde::Serialize;
use vehicle_file::VehicleFile;

use crate::analysis::kernel::{Comparison, TorqueLimits, compare};
use crate::commands::values::{finite, require, slope};
use report::error::CommandError;
use report::output::{OutputArguments, Report};
use report::plot::{Chart, Columns, Series};

/// Flags of `kernel`.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub struct Arguments {
    /// Vehicle file: a whole vehicle in SI units
    #[arg(long, value_name = "FILE.toml")]
    vehicle: PathBuf,
    /// Slope, rad, uphill positive
    #[arg(long, default_value_t = 0.0873, value_parser = finite, allow_hyphen_values = true)]
    beta: f64,
    /// Speed at which the arm is to be stopped, m/s: the faster, the less voltage is left
    #[arg(long, value_name = "M_S", default_value_t = 0.0, value_parser = finite, allow_hyphen_values = true)]
    speed: f64,
    /// Points of the grid to either side, 41 to 321
    #[arg(long, value_name = "N", default_value_t = 161)]
    grid: usize,
    #[command(flatten)]
    output: OutputArguments,
}

const EXAMPLES: &str = "\
Examples:
  hil-sim kernel --vehicle vehicles/reference.toml
  hil-sim kernel --vehicle vehicles/reference.toml --beta 0.2 --speed 1.5 --json";

/// Least and most points of the grid.
const GRID: std::ops::RangeInclusive<usize> = 41..=321;

/// What the command prints with `--json`.
#[derive(Debug, Serialize)]
struct KernelJson {
    slope_rad: f64,
    speed_m_s: f64,
    phi_max_rad: f64,
    grip_mu: f64,
    /// Largest torque by current and largest voltage, nondimensional.
    torque_max: f64,
    voltage_max: f64,
    grid: usize,
    #[serde(flatten)]
    comparison: Comparison,
}

/// Runs the command.
///
/// # Errors
/// [`CommandError::Input`] on a file without a whole vehicle, and on numbers out of range.
pub fn run(arguments: &Arguments) -> Result<(), CommandError> {
    let file = arguments.vehicle.display();
    let vehicle = match vehicle_file::read(&arguments.vehicle) {
        Ok(VehicleFile::Vehicle(vehicle)) => *vehicle,
        Ok(VehicleFile::Planar(_)) => {
            return Err(CommandError::Input(format!(
                "{file}: a table [planar] has no motors: this command needs a whole vehicle"
            )));
        }
        Err(error) => return Err(CommandError::Input(error.to_string())),
    };
    slope("--beta", arguments.beta)?;
    require(
        "--speed",
        arguments.speed,
        arguments.speed.abs() <= 100.0,
        "within 100 m/s",
    )?;
    if !GRID.contains(&arguments.grid) {
        return Err(CommandError::Input(format!(
            "--grid is {}: must be 41 to 321",
            arguments.grid
        )));
    }
    let single = Vehicle::new(vehicle.parameters().cast::<f32>())
        .map_err(|error| CommandError::Input(format!("{file}: {error}")))?;
    let (scales, p) = (vehicle.scales(), vehicle.parameters());
    let law = LandingLaw::new(&single, TICK_S);
    let limits = TorqueLimits {
        balance: *law.balance(),
        zeta: single.planar(0.0).zeta,
        torque: law.barrier().torque(),
        voltage: scales.voltage_from_si(BRIDGE_SHARE * p.battery.nominal_v) as f32,
        wheel_rate: (arguments.speed / scales.speed_m_s) as f32,
        beta: arguments.beta as f32,
        grip_mu: Some(single.parameters().control.grip_mu),
    };
    let phi_max_rad = p.safety.phi_max_rad;
    let comparison = compare(&limits, law.barrier(), law.planned_mu(), phi_max_rad, arguments.grid);
    let chart = Chart::new(
        "Viability of the arm",
        "arm angle phi (rad)",
        "largest phi' (1/time unit)",
    )
    .with(Series::new(
        "kernel: some torque keeps it",
        &comparison.phi,
        &comparison.kernel_rate,
    ))
    .with(Series::new(
        "the flown barrier keeps it",
        &comparison.phi,
        &comparison.barrier_rate,
    ));
    let columns = Columns::named(&[
        ("phi", &comparison.phi),
        ("kernel_rate", &comparison.kernel_rate),
        ("barrier_rate", &comparison.barrier_rate),
    ]);
    let outcome = KernelJson {
        slope_rad: arguments.beta,
        speed_m_s: arguments.speed,
        phi_max_rad,
        grip_mu: p.control.grip_mu,
        torque_max: f64::from(limits.torque),
        voltage_max: f64::from(limits.voltage),
        grid: arguments.grid,
        comparison,
    };
    let percent = |share: f64| format!("{:.2} %", 100.0 * share);
    let found = &outcome.comparison;
    let report = Report::new("kernel", &outcome)
        .line(
            "states that can be kept within phi_max with grip",
            percent(found.viable_share),
        )
        .line("of these the flown barrier keeps", percent(found.kept_share))
        .line(
            "states from which a whirl can be avoided",
            percent(found.avoidable_share),
        )
        .line("of these the flown barrier avoids", percent(found.avoided_share))
        .columns(columns)
        .chart("kernel", chart);
    arguments.output.emit(&report)
}
