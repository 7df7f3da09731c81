//! `hil-sim critical`: the smallest final voltage or reference speed that turns the arm over.

use clap::{Args, ValueEnum};
use serde::Serialize;

use crate::analysis::critical::{Direction, critical};
use crate::analysis::input::Input;
use crate::commands::planar_arguments::{LawArguments, PlanarArguments, StartArguments, WaveformArguments};
use crate::commands::si::beside;
use crate::commands::taken::{Taken, told};
use crate::commands::values::{LARGEST_START, available, finite, require, within};
use report::error::CommandError;
use report::output::{OutputArguments, Report};
use report::plot::Columns;

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

/// Runs the command.
///
/// # Errors
/// [`CommandError::Input`] on bad parameters.
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
    if outcome.hold_fails {
        report = report.line(
            "note",
            "from this start the arm turns over even at the hold voltage; searched beyond it",
        );
    }
    arguments.output.emit(&report)
}
