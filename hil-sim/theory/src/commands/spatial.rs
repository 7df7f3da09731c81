//! `hil-sim spatial`.

use clap::Args;
use model::dynamics::spatial::SpatialParameters;

use crate::analysis::spatial;
use crate::commands::camera_arguments::numbers;
use crate::commands::span::SpanArguments;
use crate::commands::values::{LARGEST_INPUT, LARGEST_START, finite, not_negative, positive, require, within};
use crate::commands::vehicle_argument::VehicleArgument;
use report::error::CommandError;
use report::output::{OutputArguments, Report};
use report::plot::{Chart, Columns, Series};

/// Flags of `spatial`.
#[derive(Debug, Args)]
pub struct Arguments {
    #[command(flatten)]
    vehicle: VehicleArgument,
    /// Arm length over wheel radius, > 0 [default: the vehicle's, or 0.8]
    #[arg(long, value_parser = finite, allow_hyphen_values = true)]
    l: Option<f64>,
    /// Reaction mass over total mass, above 0 and below 1 [default: the vehicle's, or 0.9]
    #[arg(long, value_parser = finite, allow_hyphen_values = true)]
    alpha: Option<f64>,
    /// Total damping of both wheels, back-EMF included, >= 0 [default: the vehicle's, or 2.2]
    #[arg(long, value_parser = finite, allow_hyphen_values = true)]
    zeta: Option<f64>,
    /// Rolling inertia of both wheels, >= 0 [default: the vehicle's, or 0.066]
    #[arg(long, value_parser = finite, allow_hyphen_values = true)]
    mu: Option<f64>,
    /// Reflected rotor inertia of both drives, >= 0 [default: the vehicle's, or 0]
    #[arg(long, value_parser = finite, allow_hyphen_values = true)]
    nu: Option<f64>,
    /// Half track over wheel radius, > 0 [default: the vehicle's, or 1]
    #[arg(long, value_parser = finite, allow_hyphen_values = true)]
    s: Option<f64>,
    /// Yaw inertia beyond the wheels' masses on the axle, >= 0 [default: the vehicle's, or 0]
    #[arg(long, value_parser = finite, allow_hyphen_values = true)]
    j0: Option<f64>,
    /// Slope along the first axis in rad, positive uphill [default: that of a `[planar]` file, or 0]
    #[arg(long, value_parser = finite, allow_hyphen_values = true)]
    slope_x: Option<f64>,
    /// Slope about the first axis in rad, positive downhill along the second [default: 0]
    #[arg(long, value_parser = finite, allow_hyphen_values = true)]
    slope_y: Option<f64>,
    /// Voltage of the right motor, nondimensional over both wheels' mass
    #[arg(long, default_value_t = 0.0, value_parser = finite, allow_hyphen_values = true)]
    u_right: f64,
    /// Voltage of the left motor
    #[arg(long, default_value_t = 0.0, value_parser = finite, allow_hyphen_values = true)]
    u_left: f64,
    /// State at the start: x,y,psi,theta_r,theta_l,phi,rate_r,rate_l,phi_rate (phi from the plane's normal)
    #[arg(long, value_name = "NINE NUMBERS", default_value = "0,0,0,0,0,0,0,0,0", value_parser = numbers::<9>, allow_hyphen_values = true)]
    state0: [f64; 9],
    #[command(flatten)]
    span: SpanArguments,
    #[command(flatten)]
    output: OutputArguments,
}

impl Arguments {
    /// The vehicle these flags describe, every range checked.
    ///
    /// # Errors
    /// [`CommandError::Input`] naming the flag, the value and the allowed range.
    fn resolve(&self) -> Result<SpatialParameters<f64>, CommandError> {
        let slope = |flag, value: f64| {
            require(
                flag,
                value,
                value.abs() < std::f64::consts::FRAC_PI_2,
                "between -pi/2 and pi/2 (rad)",
            )
        };
        let source = self.vehicle.read()?;
        let default = source.spatial();
        let alpha = self.alpha.unwrap_or(default.alpha);
        Ok(SpatialParameters {
            l: positive("--l", self.l.unwrap_or(default.l))?,
            alpha: require("--alpha", alpha, alpha > 0.0 && alpha < 1.0, "above 0 and below 1")?,
            zeta: not_negative("--zeta", self.zeta.unwrap_or(default.zeta))?,
            mu: not_negative("--mu", self.mu.unwrap_or(default.mu))?,
            nu: not_negative("--nu", self.nu.unwrap_or(default.nu))?,
            s: positive("--s", self.s.unwrap_or(default.s))?,
            j0: not_negative("--j0", self.j0.unwrap_or(default.j0))?,
            slope_x: slope("--slope-x", self.slope_x.unwrap_or(default.slope_x))?,
            slope_y: slope("--slope-y", self.slope_y.unwrap_or(default.slope_y))?,
        })
    }
}

/// Runs the command.
///
/// # Errors
/// [`CommandError::Input`] on bad parameters, [`CommandError::Other`] where the motion cannot be followed.
pub fn run(arguments: &Arguments) -> Result<(), CommandError> {
    let parameters = arguments.resolve()?;
    let (t_end, sample) = arguments.span.resolve(10.0, 0.05)?;
    let u = [
        within("--u-right", arguments.u_right, LARGEST_INPUT)?,
        within("--u-left", arguments.u_left, LARGEST_INPUT)?,
    ];
    for value in arguments.state0 {
        within("--state0", value, LARGEST_START)?;
    }
    let result = spatial::run(&parameters, u, &arguments.state0, t_end, sample)
        .map_err(|e| CommandError::Other(e.to_string()))?;
    let last = |x: &[f64]| x.last().map_or_else(String::new, |x| format!("{x:.6}"));
    let worst = |x: &[f64]| format!("{:.1e}", x.iter().fold(0.0_f64, |m, x| m.max(x.abs())));
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
    let columns = named
        .iter()
        .fold(Columns::new(), |c, (name, values)| c.with(*name, (*values).clone()));
    let mut report = Report::new("spatial", &result).columns(columns);
    for (name, values) in &named[..10] {
        report = report.line(format!("{name} at the end"), last(values));
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
            Chart::new("Heading and reaction mass", "time (1/w)", "angle (rad)")
                .with(Series::new("psi", &result.t, &result.psi))
                .with(Series::new("phi", &result.t, &result.phi)),
        );
    arguments.output.emit(&report)
}
