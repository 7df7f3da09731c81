//! `hil-sim coupled`: the vehicle that carries a camera spar, and its step limits.

use clap::{Args, ValueEnum};
use model::dynamics::coupled::{Bearing, CoupledParameters};

use crate::analysis::coupled::{CoupledRun, Ending, SteppedDrive, static_limit};
use crate::analysis::critical::Direction;
use crate::analysis::lqr::{Weights, regulator};
use crate::analysis::series::degrees;
use crate::commands::planar_arguments::{PlanarArguments, PlanarVehicle, WaveformArguments};
use crate::commands::si::{Si, WithUnits, beside};
use crate::commands::span::SpanArguments;
use crate::commands::taken::told;
use crate::commands::values::{LARGEST_INPUT, finite, positive, require, within};
use report::error::CommandError;
use report::output::{OutputArguments, Report};
use report::plot::{Chart, Columns, Series};

/// Flags of `coupled`.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub struct Arguments {
    #[command(flatten)]
    planar: PlanarArguments,
    /// Spar length over wheel radius, > 0; the other lengths in proportion [default: the vehicle's, or 1]
    #[arg(long, value_parser = finite, allow_hyphen_values = true)]
    lp: Option<f64>,
    /// Ballast over the vehicle's mass M + m, > 0; the other masses in proportion [default: the
    /// vehicle's, or 0.15]
    #[arg(long, value_parser = finite, allow_hyphen_values = true)]
    kr: Option<f64>,
    /// Whether the spar's regulator is on
    #[arg(long, value_name = "true|false", default_value_t = true, action = clap::ArgAction::Set)]
    controlled: bool,
    /// What the spar's damped bearing turns against
    #[arg(long, value_enum, default_value_t = BearingName::Inertial)]
    bearing: BearingName,
    /// Final drive voltage; the hold voltage of the slope if not given
    #[arg(long, value_name = "U", value_parser = finite, allow_hyphen_values = true)]
    voltage: Option<f64>,
    #[command(flatten)]
    waveform: WaveformArguments,
    /// Search the smallest final voltage that turns the arm or the ballast over
    #[arg(long, conflicts_with = "voltage")]
    critical: bool,
    /// Which way from the hold voltage to search
    #[arg(long, value_enum, default_value_t = Direction::Forward, requires = "critical")]
    direction: Direction,
    #[command(flatten)]
    span: SpanArguments,
    #[command(flatten)]
    output: OutputArguments,
}

const EXAMPLES: &str = "\
Examples:
  hil-sim coupled --voltage 2
  hil-sim coupled --critical --direction reverse
  hil-sim coupled --bearing axle --controlled false --voltage 2 --t-end 300";

/// A bearing's name on the command line.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum BearingName {
    /// Inertial space, as printed in (8.3)
    Inertial,
    /// The arm
    #[value(alias = "chassis")]
    Arm,
    /// The turning axle
    Axle,
}

impl From<BearingName> for Bearing {
    fn from(name: BearingName) -> Self {
        match name {
            BearingName::Inertial => Self::Inertial,
            BearingName::Arm => Self::Arm,
            BearingName::Axle => Self::Axle,
        }
    }
}

/// Runs the command.
///
/// # Errors
/// [`CommandError::Input`] on bad parameters or a slope on which the loaded vehicle cannot stand,
/// [`CommandError::Other`] where no voltage fails.
pub fn run(arguments: &Arguments) -> Result<(), CommandError> {
    let PlanarVehicle {
        parameters: planar,
        source,
        beta_name,
        taken,
    } = arguments.planar.resolve_without_spar()?;
    let si = Si::of(&source);
    let bearing = arguments.bearing.into();
    let (carried, camera) = source.coupled(bearing)?;
    let lp = positive("--lp", arguments.lp.unwrap_or(carried.lp))?;
    let kr = positive("--kr", arguments.kr.unwrap_or(carried.kr))?;
    let vehicle = CoupledParameters::with_camera(planar, &camera, lp, kr / camera.mr, bearing);
    let gains = if arguments.controlled {
        let gains = regulator(&camera, &Weights::THESIS)?.gains;
        Some(vehicle.gains_in_vehicle_units(gains))
    } else {
        None
    };
    let Some(at_rest) = SteppedDrive::step(vehicle, gains) else {
        let limit = static_limit(&vehicle);
        let allowed = format!("within the loaded vehicle's static limit |beta| < {limit} rad");
        return require(&beta_name, planar.beta, false, &allowed).map(|_| ());
    };
    let (waveform, ramp_time) = arguments.waveform.resolve()?;
    let drive = SteppedDrive {
        waveform,
        ramp_time,
        ..at_rest
    };
    if arguments.critical {
        let found = drive.critical(arguments.direction);
        let Some(found) = found.map_err(|error| CommandError::Input(error.to_string()))? else {
            return Err(CommandError::Other(
                "no final voltage within 1000 of the hold voltage whirls or tumbles".into(),
            ));
        };
        let outcome = WithUnits {
            result: &found,
            units: si.units(),
            taken,
        };
        let report = told(Report::new("coupled", &outcome), &outcome.taken)
            .line(
                "critical voltage",
                beside(format!("{:.8}", found.critical), si.volts(found.critical), "V"),
            )
            .line("outcome", found.outcome.name());
        return arguments.output.emit(&report);
    }
    let (t_end, sample) = arguments.span.resolve(100.0)?;
    let voltage = arguments.voltage.unwrap_or_else(|| vehicle.hold_voltage());
    let result = drive.run(within("--voltage", voltage, LARGEST_INPUT)?, t_end, sample);
    let reached = result.t.last().copied().unwrap_or(0.0);
    if result.outcome == Ending::Ok && reached < t_end - 1.001 * sample {
        return Err(CommandError::Other(format!(
            "the motion cannot be followed beyond t = {reached}"
        )));
    }
    let outcome = WithUnits {
        result: &result,
        units: si.units(),
        taken,
    };
    arguments.output.emit(&report(&outcome))
}

fn report<'a>(outcome: &'a WithUnits<'a, CoupledRun>) -> Report<'a, WithUnits<'a, CoupledRun>> {
    let result = outcome.result;
    let named = [
        ("t", &result.t),
        ("theta", &result.theta),
        ("phi", &result.phi),
        ("psi", &result.psi),
        ("gamma", &result.gamma),
        ("theta_rate", &result.theta_rate),
        ("phi_rate", &result.phi_rate),
        ("psi_rate", &result.psi_rate),
        ("gamma_rate", &result.gamma_rate),
        ("voltage", &result.voltage),
        ("v", &result.v),
    ];
    told(Report::new("coupled", outcome), &outcome.taken)
        .line("outcome", result.outcome.name())
        .line("largest spar angle (deg)", format!("{:.4}", result.psi_max_deg))
        .line("largest arm angle (deg)", format!("{:.4}", result.phi_max_deg))
        .columns(Columns::named(&named))
        .chart(
            "angles",
            Chart::new("Vehicle and camera spar", "time (1/w)", "angle (deg)")
                .with(Series::new("spar", &result.t, &degrees(&result.psi)))
                .with(Series::new("ballast", &result.t, &degrees(&result.gamma)))
                .with(Series::new("arm", &result.t, &degrees(&result.phi))),
        )
}
