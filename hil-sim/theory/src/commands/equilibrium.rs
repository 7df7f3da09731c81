//! `hil-sim equilibrium`: where the vehicle can stand or roll steadily, and the poles there.

use clap::Args;
use serde::Serialize;

use crate::analysis::equilibrium::{poles, static_phi, steady_theta_rate};
use crate::commands::planar_arguments::{LawArguments, PlanarArguments};
use crate::commands::si::beside;
use crate::commands::taken::{Taken, told};
use crate::commands::values::{LARGEST_INPUT, finite, require, within};
use report::error::CommandError;
use report::output::{OutputArguments, Report};
use report::plot::Columns;

/// Flags of `equilibrium`.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub struct Arguments {
    #[command(flatten)]
    vehicle: PlanarArguments,
    /// Constant nondimensional voltage; the hold voltage, sin(beta), if not given
    #[arg(long, value_name = "U", value_parser = finite, allow_hyphen_values = true)]
    voltage: Option<f64>,
    #[command(flatten)]
    law: LawArguments,
    #[command(flatten)]
    output: OutputArguments,
}

const EXAMPLES: &str = "\
Examples:
  hil-sim equilibrium --beta 0.0873
  hil-sim equilibrium --vehicle vehicles/reference.toml --kp 0.8 --kd 10 --json";

/// What the command prints with `--json`.
#[derive(Debug, Serialize)]
struct EquilibriumJson {
    /// Stable equilibrium angle, rad; null if there is none.
    phi: Option<f64>,
    /// The same in degrees, where a vehicle is given.
    #[serde(skip_serializing_if = "Option::is_none")]
    phi_deg: Option<f64>,
    /// Steady wheel rate, rad per time unit; null if there is none.
    theta_rate: Option<f64>,
    /// The same as the speed of the axle, m/s, where a vehicle is given.
    #[serde(skip_serializing_if = "Option::is_none")]
    speed_m_s: Option<f64>,
    /// The voltage of both motors, V, where a vehicle is given.
    #[serde(skip_serializing_if = "Option::is_none")]
    voltage_v: Option<f64>,
    /// Whether the slope is within the static limit.
    exists: bool,
    /// Open-loop poles of (phi, theta', phi'), `[re, im]`.
    poles: Vec<[f64; 2]>,
    /// The same, 1/s, where a vehicle is given.
    #[serde(skip_serializing_if = "Option::is_none")]
    poles_per_s: Option<Vec<[f64; 2]>>,
    /// Poles under the speed law.
    poles_closed: Vec<[f64; 2]>,
    /// The same, 1/s, where a vehicle is given.
    #[serde(skip_serializing_if = "Option::is_none")]
    poles_closed_per_s: Option<Vec<[f64; 2]>>,
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
    let (p, si) = (vehicle.parameters, vehicle.si());
    let law = arguments.law.resolve(&p, &vehicle.source)?;
    let hold = p.beta.sin();
    let voltage = within("--voltage", arguments.voltage.unwrap_or(hold), LARGEST_INPUT)?;
    if p.zeta == 0.0 {
        let allowed =
            format!("the hold voltage sin(beta) = {hold} without damping: no other voltage has a steady speed");
        require("--voltage", voltage, voltage == hold, &allowed)?;
    }
    let phi = static_phi(&p);
    let theta_rate = phi.map(|_| steady_theta_rate(&p, voltage));
    let of = |law| phi.map_or_else(Vec::new, |phi| poles(&p, phi, law).to_vec());
    let (poles_open, poles_closed) = (of(None), of(Some(&law)));
    let outcome = EquilibriumJson {
        phi,
        phi_deg: phi.and_then(|phi| si.degrees(phi)),
        theta_rate,
        speed_m_s: theta_rate.and_then(|rate| si.speed_m_s(rate)),
        voltage_v: si.volts(voltage),
        exists: phi.is_some(),
        poles_per_s: si.poles_per_s(&poles_open),
        poles: poles_open,
        poles_closed_per_s: si.poles_per_s(&poles_closed),
        poles_closed,
        taken: [vehicle.taken, arguments.law.taken(&vehicle.source)].concat(),
    };
    let text = |poles: &[[f64; 2]]| {
        let one = |z: &[f64; 2]| {
            if z[1] == 0.0 {
                format!("{:.6}", z[0])
            } else {
                format!("{:.6}{:+.6}i", z[0], z[1])
            }
        };
        let all = poles.iter().map(one).collect::<Vec<_>>().join(", ");
        if poles.iter().any(|z| z[0] > 0.0) {
            format!("{all}: unstable")
        } else {
            all
        }
    };
    let part = |poles: &[[f64; 2]], i: usize| poles.iter().map(|z| z[i]).collect::<Vec<f64>>();
    let columns = Columns::new()
        .with("pole_re", part(&outcome.poles, 0))
        .with("pole_im", part(&outcome.poles, 1))
        .with("pole_closed_re", part(&outcome.poles_closed, 0))
        .with("pole_closed_im", part(&outcome.poles_closed, 1));
    let (kp, kd) = arguments.law.gains(&vehicle.source);
    let mut report = told(Report::new("equilibrium", &outcome), &outcome.taken).columns(columns);
    report = match phi.zip(theta_rate) {
        None => report.line(
            "equilibrium",
            format!(
                "none: |beta| is beyond the static limit {:.6} rad",
                (p.alpha * p.l).asin()
            ),
        ),
        Some((phi, theta_rate)) => report
            .line("phi", format!("{phi:.6} rad ({:.3} deg)", phi.to_degrees()))
            .line(
                "theta_rate",
                beside(format!("{theta_rate:.6}"), outcome.speed_m_s, "m/s"),
            )
            .line("voltage", beside(format!("{voltage:.6}"), outcome.voltage_v, "V"))
            .line("poles, open loop", text(&outcome.poles))
            .line(format!("poles, kp {kp} kd {kd}"), text(&outcome.poles_closed)),
    };
    for (name, poles) in [
        ("poles, open loop (1/s)", &outcome.poles_per_s),
        ("poles of Eq. 3.25 (1/s)", &outcome.poles_closed_per_s),
    ] {
        if let Some(poles) = poles.as_deref().filter(|poles| !poles.is_empty()) {
            report = report.line(name, text(poles));
        }
    }
    arguments.output.emit(&report)
}
