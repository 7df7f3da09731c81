//! `hil-sim envelope`: the critical voltage over the slope, for several waveforms.

use clap::Args;
use model::dynamics::planar::PlanarParameters;
use serde::Serialize;

use crate::analysis::envelope::{EnvelopeBudget, EnvelopePoint, envelope, slopes};
use crate::analysis::waveform::Waveform;
use crate::commands::planar_arguments::{PlanarArguments, ramp_time, require_static_equilibrium};
use crate::commands::si::Si;
use crate::commands::values::{finite, slope};
use report::error::CommandError;
use report::output::{OutputArguments, Report, progress_bar};
use report::plot::{Chart, Columns, Series};

/// Flags of `envelope`.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub struct Arguments {
    #[command(flatten)]
    vehicle: PlanarArguments,
    /// Waveforms, separated by commas; all eleven if not given
    #[arg(long, value_name = "A,B", value_enum, value_delimiter = ',')]
    waveforms: Vec<Waveform>,
    /// Time the waveform takes to arrive, in time units
    #[arg(long, value_name = "T", default_value_t = 5.0, value_parser = finite, allow_hyphen_values = true)]
    ramp_time: f64,
    /// Slopes in rad: first, last and how many (--beta is ignored); -0.4:0.7:41, as far as the vehicle can stand there, if
    /// not given
    #[arg(long, value_name = "MIN:MAX:N", value_parser = slope_range, allow_hyphen_values = true)]
    slopes: Option<SlopeRange>,
    #[command(flatten)]
    output: OutputArguments,
}

const EXAMPLES: &str = "\
Examples:
  hil-sim envelope --waveforms step,ramp --slopes=-0.2:0.2:9
  hil-sim envelope --vehicle vehicles/reference.toml --out out/envelope";

/// Equidistant slopes.
#[derive(Debug, Clone, Copy, PartialEq)]
struct SlopeRange {
    first: f64,
    last: f64,
    count: usize,
}

impl SlopeRange {
    /// The slopes of the thesis's figures, as far as the vehicle `p` can stand there (3.16).
    fn of(p: &PlanarParameters<f64>) -> Self {
        // On the limit itself the arm is level and any voltage turns it over.
        let steepest = 0.95 * (p.alpha * p.l).min(1.0).asin();
        Self {
            first: (-0.4_f64).max(-steepest),
            last: 0.7_f64.min(steepest),
            count: 41,
        }
    }
}

/// Largest number of slopes of one envelope.
const MOST_SLOPES: usize = 1000;

fn slope_range(text: &str) -> Result<SlopeRange, String> {
    let allowed = "must be MIN:MAX:N with finite MIN <= MAX in rad and N from 1 to 1000, e.g. -0.3:0.7:41";
    let [first, last, count] = text.split(':').collect::<Vec<_>>()[..] else {
        return Err(allowed.into());
    };
    match (finite(first), finite(last), count.trim().parse::<usize>()) {
        (Ok(first), Ok(last), Ok(count)) if first <= last && (1..=MOST_SLOPES).contains(&count) => {
            Ok(SlopeRange { first, last, count })
        }
        _ => Err(allowed.into()),
    }
}

/// What the command prints with `--json`.
#[derive(Debug, Serialize)]
struct EnvelopeJson {
    rows: Vec<EnvelopeRow>,
}

/// A point, with its SI values if a vehicle is given.
#[derive(Debug, Serialize)]
struct EnvelopeRow {
    #[serde(flatten)]
    point: EnvelopePoint,
    /// The slope in degrees.
    #[serde(skip_serializing_if = "Option::is_none")]
    beta_deg: Option<f64>,
    /// The critical voltage as that of both motors, V.
    #[serde(skip_serializing_if = "Option::is_none")]
    critical_v: Option<f64>,
}

/// Runs the command.
///
/// # Errors
/// [`CommandError::Input`] on bad parameters.
pub fn run(arguments: &Arguments) -> Result<(), CommandError> {
    // The slopes replace --beta and the slope of a [planar] file.
    let vehicle = PlanarArguments {
        beta: Some(0.0),
        ..arguments.vehicle.clone()
    };
    let vehicle = vehicle.resolve()?;
    let (p, si) = (vehicle.parameters, vehicle.si());
    let SlopeRange { first, last, count } = arguments.slopes.unwrap_or_else(|| SlopeRange::of(&p));
    for beta in [first, last] {
        slope("--slopes", beta)?;
        require_static_equilibrium("--slopes", &PlanarParameters { beta, ..p })?;
    }
    let ramp_time = ramp_time(arguments.ramp_time)?;
    let waveforms = if arguments.waveforms.is_empty() {
        &Waveform::ALL[..]
    } else {
        &arguments.waveforms
    };
    let slopes = slopes(first, last, count);
    let bar = progress_bar(waveforms.len() * slopes.len(), "envelope");
    let rows = envelope(EnvelopeBudget::default(), &p, waveforms, ramp_time, &slopes, || {
        bar.inc(1);
    })
    .map_err(|e| CommandError::Input(format!("{e} (--zeta is {:?})", p.zeta)))?;
    bar.finish_and_clear();
    let rows = rows.into_iter().map(|point| EnvelopeRow {
        point,
        beta_deg: si.degrees(point.beta),
        critical_v: point.critical.and_then(|voltage| si.volts(voltage)),
    });
    let outcome = EnvelopeJson { rows: rows.collect() };
    arguments.output.emit(&report(&outcome, waveforms, &slopes, si))
}

fn report<'a>(outcome: &'a EnvelopeJson, waveforms: &[Waveform], slopes: &[f64], si: Si) -> Report<'a, EnvelopeJson> {
    // As many as a line holds.
    let shown = slopes.len().div_ceil(6);
    let at: Vec<String> = { slopes.iter().step_by(shown) }
        .map(|slope| {
            si.degrees(*slope)
                .map_or_else(|| format!("{slope:.4}"), |deg| format!("{deg:.2}"))
        })
        .collect();
    let (numbers, unit) = match si.degrees(0.0) {
        Some(_) => ("U (V)", "deg"),
        None => ("U", "rad"),
    };
    let head = format!("critical {numbers} at beta = {} {unit}", at.join("  "));
    let mut report = Report::new("envelope", outcome).line("waveform", head);
    let mut columns = Columns::new().with("beta", slopes);
    let mut chart = Chart::new("Whirl limits", "slope beta (rad)", "critical voltage U");
    for (waveform, rows) in waveforms.iter().zip(outcome.rows.chunks(slopes.len())) {
        let values: Vec<f64> = rows.iter().map(|r| r.point.critical.unwrap_or(f64::NAN)).collect();
        let few = values
            .iter()
            .step_by(shown)
            .map(|v| match si.volts(*v) {
                Some(volts) => format!("{v:.4} ({volts:.2})"),
                None => format!("{v:.4}"),
            })
            .collect::<Vec<_>>();
        report = report.line(waveform.name(), few.join("  "));
        chart = chart.with(Series::new(waveform.name(), slopes, &values));
        columns = columns.with(waveform.name(), values);
    }
    let report = report.chart("critical", chart);
    let degrees: Option<Vec<f64>> = slopes.iter().map(|slope| si.degrees(*slope)).collect();
    let Some(degrees) = degrees else {
        return report.columns(columns);
    };
    let mut chart = Chart::new(
        "Whirl limits in SI",
        "slope beta (deg)",
        "critical voltage of both motors (V)",
    );
    columns = columns.with("beta_deg", &degrees[..]);
    for (waveform, rows) in waveforms.iter().zip(outcome.rows.chunks(slopes.len())) {
        let volts: Vec<f64> = rows.iter().map(|r| r.critical_v.unwrap_or(f64::NAN)).collect();
        chart = chart.with(Series::new(waveform.name(), &degrees, &volts));
        columns = columns.with(format!("{}_v", waveform.name()), volts);
    }
    report.columns(columns).chart("critical_v", chart)
}
