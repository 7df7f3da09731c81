//! `hil-sim simulate`: one run of the planar vehicle, open loop or under the speed law.

use clap::Args;
use model::dynamics::planar::PlanarParameters;

use crate::analysis::input::Input;
use crate::analysis::series::last;
use crate::analysis::simulate::{PlanarRun, simulate, simulate_f32};
use crate::commands::planar_arguments::{LawArguments, PlanarArguments, StartArguments, WaveformArguments};
use crate::commands::si::{Si, WithUnits, beside};
use crate::commands::span::SpanArguments;
use crate::commands::taken::told;
use crate::commands::values::{LARGEST_INPUT, LARGEST_START, available, finite, require, within};
use crate::commands::vehicle_argument::Source;
use report::error::CommandError;
use report::output::{OutputArguments, Report};
use report::plot::{Chart, Columns, Series};

/// Largest number of fixed steps of a run: the longest run in the vehicle's own ticks, which takes
/// seconds to compute.
const MOST_FIXED_STEPS: f64 = 2e7;

/// Flags of `simulate`.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub struct Arguments {
    #[command(flatten)]
    vehicle: PlanarArguments,
    /// Open loop: the final nondimensional voltage; the voltage starts from the hold voltage, sin(beta)
    #[arg(long, value_name = "U", value_parser = finite, allow_hyphen_values = true, required_unless_present = "reference")]
    voltage: Option<f64>,
    /// Closed loop: the final reference speed theta'; the reference starts from 0
    #[arg(long, value_name = "R", value_parser = finite, allow_hyphen_values = true, conflicts_with = "voltage")]
    reference: Option<f64>,
    #[command(flatten)]
    law: LawArguments,
    #[command(flatten)]
    shape: WaveformArguments,
    /// Voltage available either way
    #[arg(long, value_name = "U", value_parser = finite, allow_hyphen_values = true)]
    u_max: Option<f64>,
    #[command(flatten)]
    start: StartArguments,
    #[command(flatten)]
    span: SpanArguments,
    /// Use the vehicle's own arithmetic: fixed RK4 steps in f32, one voltage per step
    #[arg(long, requires = "dt")]
    f32: bool,
    /// Length of the fixed step in time units, at most --sample; needed with --f32
    #[arg(long, value_name = "H", requires = "f32", value_parser = finite, allow_hyphen_values = true)]
    dt: Option<f64>,
    #[command(flatten)]
    output: OutputArguments,
}

const EXAMPLES: &str = "\
Examples:
  hil-sim simulate --voltage 2
  hil-sim simulate --vehicle vehicles/reference.toml --reference 1 --u-max 5 --out out/simulate
  hil-sim simulate --voltage 2 --f32 --dt 0.01";

/// Runs the command.
///
/// # Errors
/// [`CommandError::Input`] on bad parameters.
pub fn run(arguments: &Arguments) -> Result<(), CommandError> {
    let vehicle = arguments.vehicle.resolve()?;
    let p = vehicle.parameters;
    let input = input(arguments, &p, &vehicle.source)?;
    let start = [
        0.0,
        within("--phi0", arguments.start.phi(&vehicle)?, LARGEST_START)?,
        within("--theta-rate0", arguments.start.theta_rate0, LARGEST_START)?,
        0.0,
    ];
    let (t_end, sample) = arguments.span.resolve(60.0)?;
    let run = match arguments.dt {
        Some(dt) => {
            let least = t_end / MOST_FIXED_STEPS;
            require(
                "--dt",
                dt,
                dt > 0.0 && dt >= least,
                &format!("positive and at least {least} for this --t-end"),
            )?;
            require("--dt", dt, dt <= sample, &format!("at most --sample = {sample}"))?;
            simulate_f32(&p, &input, start, t_end, sample, dt)
        }
        None => simulate(&p, &input, start, t_end, sample).map_err(|e| CommandError::Other(e.to_string()))?,
    };
    let si = vehicle.si();
    let mut taken = vehicle.taken;
    if arguments.reference.is_some() {
        taken.extend(arguments.law.taken(&vehicle.source));
    }
    let outcome = WithUnits {
        result: &run,
        units: si.units(),
        taken,
    };
    arguments.output.emit(&report(&outcome, si))
}

fn input(arguments: &Arguments, p: &PlanarParameters<f64>, source: &Source) -> Result<Input, CommandError> {
    let (waveform, ramp_time) = arguments.shape.resolve()?;
    let u_max = available("--u-max", arguments.u_max)?;
    let step = match (arguments.voltage, arguments.reference) {
        (_, Some(reference)) => Input::reference_step(
            arguments.law.resolve(p, source)?,
            within("--reference", reference, LARGEST_INPUT)?,
        ),
        (Some(voltage), None) => Input::voltage_step(p, within("--voltage", voltage, LARGEST_INPUT)?),
        (None, None) => return Err(CommandError::Input("give --voltage U or --reference R".into())),
    };
    Ok(Input {
        u_max,
        ..step.shaped(waveform, ramp_time)
    })
}

fn report<'a>(outcome: &'a WithUnits<'a, PlanarRun>, si: Si) -> Report<'a, WithUnits<'a, PlanarRun>> {
    let run = outcome.result;
    let columns = Columns::named(&[
        ("t", &run.t),
        ("theta", &run.theta),
        ("phi", &run.phi),
        ("theta_rate", &run.theta_rate),
        ("phi_rate", &run.phi_rate),
        ("voltage", &run.voltage),
        ("friction", &run.friction),
        ("normal", &run.normal),
    ]);
    let motion = Chart::new("Motion", "time (1/w)", "rad, rad per time unit")
        .with(Series::new("phi", &run.t, &run.phi))
        .with(Series::new("theta'", &run.t, &run.theta_rate))
        .with(Series::new("phi'", &run.t, &run.phi_rate));
    let forces = Chart::new("Contact forces", "time (1/w)", "force over (M+m) g")
        .with(Series::new("friction", &run.t, &run.friction))
        .with(Series::new("normal", &run.t, &run.normal));
    let coefficient = match run.friction_coefficient_required {
        Some(c) => format!("{c:.6}"),
        None => "no grip is enough: the wheel lifts".to_owned(),
    };
    let (end_rate, end_voltage) = (last(&run.theta_rate), last(&run.voltage));
    told(Report::new("simulate", outcome), &outcome.taken)
        .line("whirled", run.whirled)
        .line(
            "phi_max",
            format!("{:.6} rad ({:.3} deg)", run.phi_max, run.phi_max.to_degrees()),
        )
        .line(
            "phi_min",
            format!("{:.6} rad ({:.3} deg)", run.phi_min, run.phi_min.to_degrees()),
        )
        .line("friction_coefficient_required", coefficient)
        .line("lifted", run.lifted)
        .line(
            "theta_rate at the end",
            beside(format!("{end_rate:.6}"), si.speed_m_s(end_rate), "m/s"),
        )
        .line(
            "voltage at the end",
            beside(format!("{end_voltage:.6}"), si.volts(end_voltage), "V"),
        )
        .line("phi at the end", format!("{:.6} rad", last(&run.phi)))
        .columns(columns)
        .chart("motion", motion)
        .chart("forces", forces)
}
