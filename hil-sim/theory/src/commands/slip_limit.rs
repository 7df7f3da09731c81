//! `hil-sim slip-limit`: the largest voltage step that the grip allows, compared with the whirl limit.

use clap::Args;
use serde::Serialize;

use crate::analysis::slip::slip_limit;
use crate::commands::planar_arguments::PlanarArguments;
use crate::commands::si::beside;
use crate::commands::taken::{Taken, told};
use crate::commands::values::{finite, not_negative};
use report::error::CommandError;
use report::output::{OutputArguments, Report};
use report::plot::Columns;

/// Flags of `slip-limit`.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub struct Arguments {
    #[command(flatten)]
    vehicle: PlanarArguments,
    /// Static friction coefficient between tyre and ground [default: the vehicle's control.grip_mu, or 0.8]
    #[arg(long, value_name = "X", value_parser = finite, allow_hyphen_values = true)]
    mu_s: Option<f64>,
    #[command(flatten)]
    output: OutputArguments,
}

const EXAMPLES: &str = "\
Examples:
  hil-sim slip-limit --mu-s 0.8 --beta 0
  hil-sim slip-limit --vehicle vehicles/reference.toml --beta 0.1";

/// The friction coefficient of rubber on dry concrete, if neither the flag nor a whole vehicle gives a
/// coefficient.
const DRY_CONCRETE: f64 = 0.8;

/// What the command prints with `--json`.
#[derive(Debug, Serialize)]
struct SlipLimitJson {
    /// The friction coefficient.
    mu_s: f64,
    /// The largest step without slip; null if the vehicle slides even when it stands.
    critical_voltage: Option<f64>,
    /// The same as the voltage of both motors, V, where a vehicle is given.
    #[serde(skip_serializing_if = "Option::is_none")]
    critical_voltage_v: Option<f64>,
    /// The smallest step that whirls.
    whirl_voltage: f64,
    /// The same as the voltage of both motors, V, where a vehicle is given.
    #[serde(skip_serializing_if = "Option::is_none")]
    whirl_voltage_v: Option<f64>,
    /// "slip" or "whirl".
    first: &'static str,
    /// The friction coefficient from which whirl comes first; null if the wheel lifts first.
    mu_s_where_whirl_comes_first: Option<f64>,
    /// The numbers that no flag gives, nor the file but for the friction coefficient.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    taken: Vec<Taken>,
}

/// Runs the command.
///
/// # Errors
/// [`CommandError::Input`] on bad parameters.
pub fn run(arguments: &Arguments) -> Result<(), CommandError> {
    let vehicle = arguments.vehicle.resolve()?;
    let (p, si) = (vehicle.in_equilibrium()?, vehicle.si());
    let mut taken = vehicle.taken;
    let (mu_s, from) = match (arguments.mu_s, vehicle.source.whole_vehicle()) {
        (Some(mu_s), _) => (mu_s, None),
        (None, Some(whole)) => (
            whole.parameters().control.grip_mu,
            Some("control.grip_mu of the vehicle file"),
        ),
        (None, None) => (DRY_CONCRETE, Some("rubber on dry concrete")),
    };
    taken.extend(from.map(|from| Taken::new("--mu-s", mu_s, from)));
    let mu_s = not_negative("--mu-s", mu_s)?;
    let limit = slip_limit(&p, mu_s).map_err(|e| CommandError::Input(format!("{e} (--zeta is {:?})", p.zeta)))?;
    let outcome = SlipLimitJson {
        mu_s,
        critical_voltage: limit.critical_voltage,
        critical_voltage_v: limit.critical_voltage.and_then(|voltage| si.volts(voltage)),
        whirl_voltage: limit.whirl_voltage,
        whirl_voltage_v: si.volts(limit.whirl_voltage),
        first: if limit.slips_first { "slip" } else { "whirl" },
        mu_s_where_whirl_comes_first: limit.mu_s_where_whirl_comes_first,
        taken,
    };
    let number = |v: Option<f64>, none: &str| v.map_or_else(|| none.to_owned(), |v| format!("{v:.6}"));
    let report = told(Report::new("slip-limit", &outcome), &outcome.taken)
        .line("friction coefficient", mu_s)
        .line(
            "largest step without slip",
            beside(
                number(outcome.critical_voltage, "none: the vehicle slides even when it stands"),
                outcome.critical_voltage_v,
                "V",
            ),
        )
        .line(
            "whirl limit",
            beside(format!("{:.6}", outcome.whirl_voltage), outcome.whirl_voltage_v, "V"),
        )
        .line("comes first", outcome.first)
        .line(
            "whirl comes first above mu_s",
            number(outcome.mu_s_where_whirl_comes_first, "none: the wheel lifts"),
        )
        .columns(
            Columns::new()
                .with("mu_s", vec![mu_s])
                .with(
                    "critical_voltage",
                    outcome.critical_voltage.into_iter().collect::<Vec<f64>>(),
                )
                .with("whirl_voltage", vec![outcome.whirl_voltage])
                .with(
                    "mu_s_where_whirl_comes_first",
                    outcome.mu_s_where_whirl_comes_first.into_iter().collect::<Vec<f64>>(),
                ),
        );
    arguments.output.emit(&report)
}
