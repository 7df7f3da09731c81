//! `hil-sim lqr`: the optimal regulator of the camera spar.

use clap::Args;
use model::dynamics::camera::CameraParameters;
use serde::Serialize;

use crate::analysis::camera::Experiment;
use crate::analysis::lqr::{Regulator, regulator};
use crate::analysis::series::degrees;
use crate::commands::camera_arguments::{CameraArguments, WeightArguments};
use crate::commands::si::{SparSi, SparSiUnits};
use report::error::CommandError;
use report::output::{OutputArguments, Report};
use report::plot::{Chart, Series};

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

/// Tilt of the spar at rest from which its return is drawn, deg.
const DRAWN_TILT_DEG: f64 = 5.0;
/// How far the slowest motion decays in the drawn time: e^-5, below a hundredth.
const DRAWN_DECAYS: f64 = 5.0;
/// Samples of the drawn return.
const RETURN_SAMPLES: f64 = 600.0;

/// The spar's return from a tilt under the regulator's gains, and its poles, as charts with their names.
fn charts(camera: &CameraParameters<f64>, result: &Regulator, si: SparSi) -> [(&'static str, Chart); 3] {
    let slowest = result.poles.iter().map(|pole| -pole[0]).fold(f64::INFINITY, f64::min);
    let t_end = DRAWN_DECAYS / slowest;
    let experiment = Experiment {
        tilt0: DRAWN_TILT_DEG.to_radians(),
        ..Experiment::new(*camera, Some(result.gains))
    };
    let run = experiment.run(t_end, t_end / RETURN_SAMPLES);
    let (time, volts, per_time) = match si.units() {
        Some(_) => ("time, s", "voltage of the ballast motor, V", "1/s"),
        None => ("time (1/w_c)", "v", "w_c"),
    };
    let t: Vec<f64> = run.t.iter().map(|t| si.seconds(*t).unwrap_or(*t)).collect();
    let v: Vec<f64> = run.v.iter().map(|v| si.volts(*v).unwrap_or(*v)).collect();
    let title = format!("Released {DRAWN_TILT_DEG} deg off the vertical");
    let angles = Chart::new(title, time, "angle, deg")
        .with(Series::new("spar", &t, &degrees(&run.theta)))
        .with(Series::new("ballast", &t, &degrees(&run.phi)));
    let voltage = Chart::new("Voltage that the regulator asks for, not limited", time, volts)
        .with(Series::new("voltage", &t, &v));
    let mut poles = Chart::new(
        "Poles of the closed loop",
        format!("real part, {per_time}"),
        format!("imaginary part, {per_time}"),
    )
    .marks();
    let in_si = si.poles_per_s(&result.poles);
    for (number, [re, im]) in (1..).zip(in_si.as_deref().unwrap_or(&result.poles)) {
        poles = poles.with(Series::new(format!("pole {number}"), &[*re], &[*im]));
    }
    [("angles", angles), ("voltage", voltage), ("poles", poles)]
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
    if arguments.output.draws() {
        for (name, chart) in charts(&camera, &result, si) {
            report = report.chart(name, chart);
        }
    }
    arguments.output.emit(&report)
}
