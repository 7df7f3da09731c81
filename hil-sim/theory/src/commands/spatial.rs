//! `hil-sim spatial`: one run of the vehicle in space.

use clap::Args;
use model::dynamics::planar::PlanarParameters;
use model::dynamics::spatial::SpatialParameters;

use crate::analysis::series::{largest, last};
use crate::analysis::spatial;
use crate::commands::body_arguments::BodyArguments;
use crate::commands::si::{Si, WithUnits, beside};
use crate::commands::span::SpanArguments;
use crate::commands::values::{LARGEST_INPUT, LARGEST_START, finite, not_negative, numbers, positive, slope, within};
use crate::commands::vehicle_argument::VehicleArgument;
use report::error::CommandError;
use report::output::{OutputArguments, Report};
use report::plot::{Chart, Columns, Series};

/// Flags of `spatial`.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub struct Arguments {
    #[command(flatten)]
    vehicle: VehicleArgument,
    #[command(flatten)]
    body: BodyArguments,
    /// Half track over wheel radius, > 0 [default: the vehicle's, or 1]
    #[arg(long, value_parser = finite, allow_hyphen_values = true)]
    s: Option<f64>,
    /// Yaw inertia beyond the wheels' masses on the axle, >= 0 [default: the vehicle's, or 0]
    #[arg(long, value_parser = finite, allow_hyphen_values = true)]
    j0: Option<f64>,
    /// Mass that stays over the middle of the axle, over the mass of wheels and arm, >= 0 [default: the vehicle's camera spar, or
    /// 0]. Every other number of the vehicle is over the mass of wheels and arm; voltages are over the whole mass
    #[arg(long, value_parser = finite, allow_hyphen_values = true)]
    carried: Option<f64>,
    /// Slope along the first axis in rad, positive uphill [default: that of a `[planar]` file, or 0]
    #[arg(long, value_parser = finite, allow_hyphen_values = true)]
    slope_x: Option<f64>,
    /// Slope about the first axis in rad, positive downhill along the second [default: 0]
    #[arg(long, value_parser = finite, allow_hyphen_values = true)]
    slope_y: Option<f64>,
    /// Nondimensional voltage of the left motor; the sum of both motors is the planar voltage
    #[arg(long, default_value_t = 0.0, value_parser = finite, allow_hyphen_values = true)]
    u_left: f64,
    /// Nondimensional voltage of the right motor
    #[arg(long, default_value_t = 0.0, value_parser = finite, allow_hyphen_values = true)]
    u_right: f64,
    /// State at the start: x,y,psi,theta_r,theta_l,phi,rate_r,rate_l,phi_rate (phi from the plane's normal)
    #[arg(long, value_name = "NINE NUMBERS", default_value = "0,0,0,0,0,0,0,0,0", value_parser = numbers::<9>, allow_hyphen_values = true)]
    state0: [f64; 9],
    #[command(flatten)]
    span: SpanArguments,
    #[command(flatten)]
    output: OutputArguments,
}

const EXAMPLES: &str = "\
Examples:
  hil-sim spatial --u-left 0.5 --u-right 1
  hil-sim spatial --slope-x 0.1 --t-end 20 --out out/spatial";

impl Arguments {
    /// The vehicle these flags describe, every range checked, and its scales. All its numbers are divided by the whole mass.
    ///
    /// # Errors
    /// [`CommandError::Input`] naming the flag, the value and the allowed range.
    fn resolve(&self) -> Result<(SpatialParameters<f64>, Si), CommandError> {
        let source = self.vehicle.read()?;
        let default = source.spatial();
        let PlanarParameters {
            l, alpha, zeta, mu, nu, ..
        } = self.body.over(PlanarParameters {
            l: default.l,
            alpha: default.alpha,
            zeta: default.zeta,
            mu: default.mu,
            nu: default.nu,
            beta: default.slope_x,
        })?;
        let parameters = SpatialParameters {
            l,
            alpha,
            zeta,
            mu,
            nu,
            s: positive("--s", self.s.unwrap_or(default.s))?,
            j0: not_negative("--j0", self.j0.unwrap_or(default.j0))?,
            middle: default.middle,
            slope_x: slope("--slope-x", self.slope_x.unwrap_or(default.slope_x))?,
            slope_y: slope("--slope-y", self.slope_y.unwrap_or(default.slope_y))?,
        };
        let mass = 1.0 + not_negative("--carried", self.carried.unwrap_or(source.whole_mass() - 1.0))?;
        Ok((parameters.carrying(mass), Si::of(&source).carrying(mass)))
    }
}

/// Runs the command.
///
/// # Errors
/// [`CommandError::Input`] on bad parameters, [`CommandError::Other`] when the motion cannot be integrated.
pub fn run(arguments: &Arguments) -> Result<(), CommandError> {
    let (parameters, si) = arguments.resolve()?;
    let (t_end, sample) = arguments.span.resolve(10.0)?;
    let u = [
        within("--u-right", arguments.u_right, LARGEST_INPUT)?,
        within("--u-left", arguments.u_left, LARGEST_INPUT)?,
    ];
    for value in arguments.state0 {
        within("--state0", value, LARGEST_START)?;
    }
    let result = spatial::run(&parameters, u, &arguments.state0, t_end, sample)
        .map_err(|e| CommandError::Other(e.to_string()))?;
    let worst = |x: &[f64]| format!("{:.1e}", largest(x));
    let named = [
        ("t", &result.t),
        ("x", &result.x),
        ("y", &result.y),
        ("psi", &result.psi),
        ("theta_r", &result.theta_r),
        ("theta_l", &result.theta_l),
        ("phi", &result.phi),
        ("rate_r", &result.rate_r),
        ("rate_l", &result.rate_l),
        ("phi_rate", &result.phi_rate),
        ("energy_residual", &result.energy_residual),
        ("constraint_residual", &result.constraint_residual),
    ];
    let outcome = WithUnits {
        result: &result,
        units: si.units(),
        taken: Vec::new(),
    };
    let mut report = Report::new("spatial", &outcome).columns(Columns::named(&named));
    for (name, values) in &named[..10] {
        let value = last(values);
        let (in_si, unit) = match *name {
            "t" => (si.seconds(value), "s"),
            "x" | "y" => (si.metres(value), "m"),
            "rate_r" | "rate_l" | "phi_rate" => (si.rate_rad_s(value), "rad/s"),
            _ => (si.degrees(value), "deg"),
        };
        report = report.line(format!("{name} at the end"), beside(format!("{value:.6}"), in_si, unit));
    }
    report = report
        .line("largest energy residual", worst(&result.energy_residual))
        .line("largest constraint residual", worst(&result.constraint_residual))
        .chart(
            "path",
            Chart::new("Path", "x (R)", "y (R)").with(Series::new("axle", &result.x, &result.y)),
        )
        .chart(
            "angles",
            Chart::new("Heading and arm", "time (1/w)", "angle (rad)")
                .with(Series::new("psi", &result.t, &result.psi))
                .with(Series::new("phi", &result.t, &result.phi)),
        );
    arguments.output.emit(&report)
}
