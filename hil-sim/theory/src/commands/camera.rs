//! `hil-sim camera`: the camera spar alone, tilted or shaken.

use clap::Args;

use crate::analysis::camera::Experiment;
use crate::analysis::lqr::regulator;
use crate::analysis::series::{degrees, largest};
use crate::commands::camera_arguments::{CameraArguments, WeightArguments};
use crate::commands::si::{WithUnits, beside};
use crate::commands::span::SpanArguments;
use crate::commands::values::{LARGEST_INPUT, available, finite, numbers, require, within};
use report::error::CommandError;
use report::output::{OutputArguments, Report};
use report::plot::{Chart, Columns, Series};

/// Flags of `camera`.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub struct Arguments {
    #[command(flatten)]
    camera: CameraArguments,
    /// Gains of v = -g.x: the optimal ones, four numbers, or no control
    #[arg(long, value_name = "auto|G1,G2,G3,G4|none", default_value = "auto", value_parser = gains, allow_hyphen_values = true)]
    gains: Gains,
    #[command(flatten)]
    weights: WeightArguments,
    /// Tilt of the spar at the start, deg
    #[arg(long, value_name = "DEG", default_value_t = 0.0, value_parser = finite, allow_hyphen_values = true)]
    tilt0_deg: f64,
    /// Horizontal acceleration of the axle, x'' = ax cos t, in g
    #[arg(long, default_value_t = 0.0, value_parser = finite, allow_hyphen_values = true)]
    ax: f64,
    /// Vertical acceleration of the axle, y'' = ay sin t, in g
    #[arg(long, default_value_t = 0.0, value_parser = finite, allow_hyphen_values = true)]
    ay: f64,
    /// Limit of the motor voltage either way, > 0; unlimited if not given
    #[arg(long, value_parser = finite, allow_hyphen_values = true)]
    v_max: Option<f64>,
    #[command(flatten)]
    span: SpanArguments,
    #[command(flatten)]
    output: OutputArguments,
}

const EXAMPLES: &str = "\
Examples:
  hil-sim camera --tilt0-deg 10
  hil-sim camera --vehicle vehicles/reference.toml --ax 0.1 --ay 0.1
  hil-sim camera --v-max 10 --tilt0-deg 39 --out out/camera";

/// Source of the gains.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Gains {
    Optimal,
    Given([f64; 4]),
    Uncontrolled,
}

fn gains(text: &str) -> Result<Gains, String> {
    match text {
        "auto" => Ok(Gains::Optimal),
        "none" => Ok(Gains::Uncontrolled),
        list => numbers(list)
            .map(Gains::Given)
            .map_err(|e| format!("{e}, auto or none")),
    }
}

/// Runs the command.
///
/// # Errors
/// [`CommandError::Input`] on bad parameters, [`CommandError::Other`] where the motion cannot be followed.
pub fn run(arguments: &Arguments) -> Result<(), CommandError> {
    let (camera, si) = arguments.camera.resolve()?;
    let weights = arguments.weights.resolve()?;
    let gains = match arguments.gains {
        Gains::Optimal => Some(regulator(&camera, &weights)?.gains),
        Gains::Given(gains) => Some(gains),
        Gains::Uncontrolled => None,
    };
    let v_max = available("--v-max", arguments.v_max)?;
    let tilt = arguments.tilt0_deg;
    require("--tilt0-deg", tilt, tilt.abs() <= 180.0, "between -180 and 180")?;
    let (t_end, sample) = arguments.span.resolve(100.0)?;
    let experiment = Experiment {
        v_max,
        tilt0: tilt.to_radians(),
        shake: [
            within("--ax", arguments.ax, LARGEST_INPUT)?,
            within("--ay", arguments.ay, LARGEST_INPUT)?,
        ],
        ..Experiment::new(camera, gains)
    };
    let result = experiment.run(t_end, sample);
    let reached = result.t.last().copied().unwrap_or(0.0);
    // Only a runaway ballast may end a run early.
    let turned_over = result.phi.iter().any(|phi| phi.abs() >= std::f64::consts::TAU);
    if !turned_over && reached < t_end - 1.001 * sample {
        return Err(CommandError::Other(format!(
            "the motion cannot be followed beyond t = {reached}"
        )));
    }
    let angles = Chart::new("Camera spar", "time (1/w_c)", "angle (deg)")
        .with(Series::new("spar", &result.t, &degrees(&result.theta)))
        .with(Series::new("ballast", &result.t, &degrees(&result.phi)));
    let outcome = WithUnits {
        result: &result,
        units: si.units(),
        taken: Vec::new(),
    };
    let voltage = largest(&result.v);
    let report = Report::new("camera", &outcome)
        .line(
            "amplitude in the last third (deg)",
            format!("{:.6}", result.theta_amplitude_deg.unwrap_or(f64::NAN)),
        )
        .line("recovered", result.recovered)
        .line(
            "largest voltage",
            beside(format!("{voltage:.6}"), si.volts(voltage), "V"),
        )
        .columns(Columns::named(&[
            ("t", &result.t),
            ("theta", &result.theta),
            ("phi", &result.phi),
            ("theta_rate", &result.theta_rate),
            ("phi_rate", &result.phi_rate),
            ("v", &result.v),
        ]))
        .chart("angles", angles);
    arguments.output.emit(&report)
}
