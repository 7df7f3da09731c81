//! `hil-sim critical`: the smallest final voltage or reference speed that turns the arm over.

use clap::{Args, ValueEnum};
use model::dynamics::planar::{PlanarParameters, PlanarState};
use serde::Serialize;

use crate::analysis::critical::{CriticalValue, Direction, critical};
use crate::analysis::input::Input;
use crate::analysis::simulate::{PlanarRun, simulate};
use crate::commands::planar_arguments::{LawArguments, PlanarArguments, StartArguments, WaveformArguments};
use crate::commands::si::{Si, beside};
use crate::commands::taken::{Taken, told};
use crate::commands::values::{LARGEST_START, available, finite, require, within};
use report::error::CommandError;
use report::output::{OutputArguments, Report};
use report::plot::{Chart, Columns, Series};

/// What is searched.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Quantity {
    /// The final open-loop voltage
    Voltage,
    /// The final reference speed of the speed law
    Reference,
}

/// Flags of `critical`.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub struct Arguments {
    #[command(flatten)]
    vehicle: PlanarArguments,
    /// What is searched
    #[arg(long, value_enum, default_value_t = Quantity::Voltage)]
    quantity: Quantity,
    #[command(flatten)]
    shape: WaveformArguments,
    #[command(flatten)]
    start: StartArguments,
    /// Search above or below the hold voltage
    #[arg(long, value_enum, default_value_t = Direction::Forward)]
    direction: Direction,
    #[command(flatten)]
    law: LawArguments,
    /// Voltage available either way (with --quantity reference)
    #[arg(long, value_name = "U", value_parser = finite, allow_hyphen_values = true)]
    u_max: Option<f64>,
    #[command(flatten)]
    output: OutputArguments,
}

const EXAMPLES: &str = "\
Examples:
  hil-sim critical --beta 0.0873
  hil-sim critical --vehicle vehicles/reference.toml --waveform ramp --ramp-time 2
  hil-sim critical --quantity reference --u-max 3";

/// What the command prints with `--json`.
#[derive(Debug, Serialize)]
struct CriticalJson {
    /// The smallest failing final value; null if none fails.
    critical: Option<f64>,
    /// The same as the voltage of both motors, V, where a vehicle is given.
    #[serde(skip_serializing_if = "Option::is_none")]
    critical_v: Option<f64>,
    /// The same as a speed, m/s, where a vehicle is given.
    #[serde(skip_serializing_if = "Option::is_none")]
    critical_m_s: Option<f64>,
    /// The way the arm turns: +1 forward, -1 backward; null if no final value fails.
    whirl_direction: Option<i8>,
    /// Whether the arm turns over even at the hold voltage, so that the search began beyond it.
    hold_fails: bool,
    /// The numbers that neither a flag nor the vehicle file gives.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    taken: Vec<Taken>,
}

/// Distance of the drawn responses from the limit, as a share of the limit's distance from the hold.
const BESIDE: f64 = 1e-3;
/// Time that is drawn after the input has arrived, and samples, at most: an arm that turns over is drawn to its first full turn.
const DRAWN_TIME: f64 = 30.0;
const RESPONSE_SAMPLES: f64 = 600.0;

/// The responses just below and just above a limit, as two charts: the arm and the wheels.
struct Responses {
    arm: Chart,
    wheels: Chart,
}

impl Responses {
    /// The responses from `start` to inputs like `input`, beside the limit `found`. The quantity and its unit name them.
    fn beside(
        p: &PlanarParameters<f64>,
        input: &Input,
        start: PlanarState<f64>,
        found: &CriticalValue,
        (si, quantity): (Si, Quantity),
    ) -> Result<Self, CommandError> {
        let (time, rate) = match si.seconds(1.0) {
            Some(_) => ("time, s", "wheel rate, rad/s"),
            None => ("time (1/w)", "wheel rate (w)"),
        };
        let mut responses = Self {
            arm: Chart::new("Arm: beside the limit", time, "phi, deg"),
            wheels: Chart::new("Wheels: beside the limit", time, rate),
        };
        let away = found.value - input.initial;
        let step = BESIDE * if away == 0.0 { 1.0 } else { away };
        let t_end = input.arrival() + DRAWN_TIME;
        for (word, target) in [("below", found.value - step), ("above", found.value + step)] {
            let run = simulate(p, &input.towards(target), start, t_end, t_end / RESPONSE_SAMPLES)
                .map_err(|error| CommandError::Other(error.to_string()))?;
            let shown = until_turned_over(&run);
            let t: Vec<f64> = { run.t[..shown].iter() }
                .map(|t| si.seconds(*t).unwrap_or(*t))
                .collect();
            let phi: Vec<f64> = run.phi[..shown].iter().map(|phi| phi.to_degrees()).collect();
            let rate: Vec<f64> = { run.theta_rate[..shown].iter() }
                .map(|rate| si.rate_rad_s(*rate).unwrap_or(*rate))
                .collect();
            let name = format!("just {word}: {}", named(target, si, quantity));
            responses.arm.series.push(Series::new(name.clone(), &t, &phi));
            responses.wheels.series.push(Series::new(name, &t, &rate));
        }
        Ok(responses)
    }
}

/// Samples up to where the arm has turned by a full turn.
fn until_turned_over(run: &PlanarRun) -> usize {
    let from = run.phi.first().copied().unwrap_or(0.0);
    let over = run
        .phi
        .iter()
        .position(|phi| (phi - from).abs() >= std::f64::consts::TAU);
    over.map_or(run.phi.len(), |last| last + 1)
}

/// A final value in words, in SI if the vehicle gives the scales.
fn named(value: f64, si: Si, quantity: Quantity) -> String {
    let (symbol, in_si, unit) = match quantity {
        Quantity::Voltage => ("U", si.volts(value), "V"),
        Quantity::Reference => ("theta'", si.speed_m_s(value), "m/s"),
    };
    in_si.map_or_else(|| format!("{symbol} {value:.4}"), |si| format!("{si:.3} {unit}"))
}

/// Runs the command.
///
/// # Errors
/// [`CommandError::Input`] on bad parameters; [`CommandError::Other`] where a response to be drawn cannot be followed.
pub fn run(arguments: &Arguments) -> Result<(), CommandError> {
    let vehicle = arguments.vehicle.resolve()?;
    let p = vehicle.in_equilibrium()?;
    let (waveform, ramp_time) = arguments.shape.resolve()?;
    let u_max = available("--u-max", arguments.u_max)?;
    let phi = arguments.start.phi(&vehicle)?;
    require(
        "--phi0",
        phi,
        phi.abs() <= std::f64::consts::TAU,
        "between -2 pi and 2 pi (rad)",
    )?;
    within("--theta-rate0", arguments.start.theta_rate0, LARGEST_START)?;
    let step = match arguments.quantity {
        Quantity::Voltage => Input::voltage_step(&p, 0.0),
        Quantity::Reference => Input {
            u_max,
            ..Input::reference_step(arguments.law.resolve(&p, &vehicle.source)?, 0.0)
        },
    };
    let input = step.shaped(waveform, ramp_time);
    let found = critical(&p, &input, [phi, arguments.start.theta_rate0, 0.0], arguments.direction).map_err(|e| {
        let (kp, kd) = arguments.law.gains(&vehicle.source);
        CommandError::Input(format!("{e} (--zeta is {:?}, --kp is {kp}, --kd is {kd})", p.zeta))
    })?;
    let (si, value) = (vehicle.si(), found.map(|c| c.value));
    let (critical_v, critical_m_s) = match arguments.quantity {
        Quantity::Voltage => (value.and_then(|value| si.volts(value)), None),
        Quantity::Reference => (None, value.and_then(|value| si.speed_m_s(value))),
    };
    let mut taken = vehicle.taken;
    if arguments.quantity == Quantity::Reference {
        taken.extend(arguments.law.taken(&vehicle.source));
    }
    let outcome = CriticalJson {
        critical: value,
        critical_v,
        critical_m_s,
        whirl_direction: found.map(|c| c.whirl_direction),
        hold_fails: found.is_some_and(|c| c.hold_fails),
        taken,
    };
    let (name, in_si, unit) = match arguments.quantity {
        Quantity::Voltage => ("critical voltage", critical_v, "V"),
        Quantity::Reference => ("critical reference", critical_m_s, "m/s"),
    };
    let mut report = told(Report::new("critical", &outcome), &outcome.taken);
    report = match found {
        None => report.line(name, "none: no final value turns the arm over"),
        Some(c) => report
            .line(name, beside(format!("{:.10}", c.value), in_si, unit))
            .line(
                "the arm turns",
                if c.whirl_direction > 0 { "forward" } else { "backward" },
            )
            .columns(
                Columns::new()
                    .with("critical", vec![c.value])
                    .with("whirl_direction", vec![f64::from(c.whirl_direction)]),
            ),
    };
    if let Some(found) = found.filter(|_| arguments.output.draws()) {
        let start = [0.0, phi, arguments.start.theta_rate0, 0.0];
        let Responses { arm, wheels } = Responses::beside(&p, &input, start, &found, (si, arguments.quantity))?;
        report = report.chart("arm", arm).chart("wheels", wheels);
    }
    if outcome.hold_fails {
        report = report.line(
            "note",
            "from this start the arm turns over even at the hold voltage; searched beyond it",
        );
    }
    arguments.output.emit(&report)
}
