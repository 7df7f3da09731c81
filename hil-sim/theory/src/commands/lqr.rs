//! `hil-sim lqr`: the optimal regulator of the camera spar.

use clap::Args;
use serde::Serialize;

use crate::analysis::lqr::{Regulator, regulator};
use crate::commands::camera_arguments::{CameraArguments, WeightArguments};
use crate::commands::si::SparSiUnits;
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

/// The regulator as JSON, in SI units too where a vehicle file gives the scales.
#[derive(Debug, Serialize)]
struct LqrJson<'a> {
    #[serde(flatten)]
    result: &'a Regulator,
    #[serde(flatten)]
    units: Option<SparSiUnits>,
    /// Gains on the spar's and the ballast's angle, V/rad, and on their rates, V s/rad.
    #[serde(skip_serializing_if = "Option::is_none")]
    gains_v: Option<[f64; 4]>,
    #[serde(skip_serializing_if = "Option::is_none")]
    poles_per_s: Option<&'a [[f64; 2]]>,
}

/// Runs the command.
///
/// # Errors
/// [`CommandError::Input`] on bad parameters or weights without an optimal regulator.
pub fn run(arguments: &Arguments) -> Result<(), CommandError> {
    let (camera, si) = arguments.camera.resolve()?;
    let result = regulator(&camera, &arguments.weights.resolve()?)?;
    let (gains_v, poles_per_s) = (si.gains_v(result.gains), si.poles_per_s(&result.poles));
    let outcome = LqrJson {
        result: &result,
        units: si.units(),
        gains_v,
        poles_per_s: poles_per_s.as_deref(),
    };
    let mut report = Report::new("lqr", &outcome);
    // With the vehicle file's names, so that the lines can be copied there.
    for (name, gain) in ["spar_gain", "ballast_gain", "spar_rate_gain", "ballast_rate_gain"]
        .iter()
        .zip(result.gains)
    {
        report = report.line(*name, format!("{gain:.6}"));
    }
    // The user copies the lines above unchanged; separate lines give the SI values.
    for (place, gain_v) in gains_v.into_iter().flatten().enumerate() {
        let (name, unit) = [
            ("spar", "V/rad"),
            ("ballast", "V/rad"),
            ("spar's rate", "V s/rad"),
            ("ballast's rate", "V s/rad"),
        ][place];
        report = report.line(format!("on the {name}"), format!("{gain_v:.3} {unit}"));
    }
    for (place, [re, im]) in result.poles.into_iter().enumerate() {
        let pole = format!("{re:.6} {im:+.6}i");
        report = report.line(
            "pole",
            match poles_per_s.as_ref().and_then(|poles| poles.get(place)) {
                Some([re, im]) => format!("{pole} ({re:.3} {im:+.3}i 1/s)"),
                None => pole,
            },
        );
    }
    report = report.line("Riccati residual", format!("{:.1e}", result.riccati_residual));
    arguments.output.emit(&report)
}
