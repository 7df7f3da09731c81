//! `hil-sim lqr`: the optimal regulator of the camera spar.

use clap::Args;

use crate::analysis::lqr::regulator;
use crate::commands::camera_arguments::{CameraArguments, WeightArguments};
use report::error::CommandError;
use report::output::{OutputArguments, Report};

/// Flags of `lqr`.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub struct Arguments {
    #[command(flatten)]
    camera: CameraArguments,
    #[command(flatten)]
    weights: WeightArguments,
    #[command(flatten)]
    output: OutputArguments,
}

const EXAMPLES: &str = "\
Examples:
  hil-sim lqr
  hil-sim lqr --vehicle vehicles/reference.toml --q 10000,100,0,0 --r 1";

/// Runs the command.
///
/// # Errors
/// [`CommandError::Input`] on bad parameters or weights without an optimal regulator.
pub fn run(arguments: &Arguments) -> Result<(), CommandError> {
    let result = regulator(&arguments.camera.resolve()?, &arguments.weights.resolve()?)?;
    let mut report = Report::new("lqr", &result);
    // Under the names of the vehicle file, so that the lines can be copied there.
    for (name, gain) in ["spar_gain", "ballast_gain", "spar_rate_gain", "ballast_rate_gain"]
        .iter()
        .zip(result.gains)
    {
        report = report.line(*name, format!("{gain:.6}"));
    }
    for [re, im] in result.poles {
        report = report.line("pole", format!("{re:.6} {im:+.6}i"));
    }
    report = report.line("Riccati residual", format!("{:.1e}", result.riccati_residual));
    arguments.output.emit(&report)
}
