//! The flags of the camera spar and of its optimal regulator, shared by `lqr` and `camera`.

use clap::Args;
use model::dynamics::camera::CameraParameters;

use crate::analysis::lqr::{NoRegulator, Weights};
use crate::commands::si::SparSi;
use crate::commands::values::{finite, not_negative, numbers, positive, require};
use crate::commands::vehicle_argument::SparVehicleArgument;
use report::error::CommandError;

/// The nondimensional camera spar: each parameter from its flag, else from the vehicle file, else the
/// thesis's.
#[derive(Debug, Clone, Default, Args)]
pub struct CameraArguments {
    #[command(flatten)]
    vehicle: SparVehicleArgument,
    /// Axle to motor over axle to camera, >= 0 [default: the vehicle's, or 1/6]
    #[arg(long, value_parser = finite, allow_hyphen_values = true)]
    lm: Option<f64>,
    /// Motor to ballast over axle to camera, > 0 [default: the vehicle's, or 1/6]
    #[arg(long, value_parser = finite, allow_hyphen_values = true)]
    lr: Option<f64>,
    /// Motor's mass over the camera's, >= 0 [default: the vehicle's, or 3]
    #[arg(long, value_parser = finite, allow_hyphen_values = true)]
    mm: Option<f64>,
    /// Ballast's mass over the camera's, > 0 [default: the vehicle's, or 4]
    #[arg(long, value_parser = finite, allow_hyphen_values = true)]
    mr: Option<f64>,
    /// Damping of the spar's bearing, >= 0 [default: the vehicle's, or 0.2]
    #[arg(long, value_parser = finite, allow_hyphen_values = true)]
    zeta: Option<f64>,
    /// Back-EMF of the motor, >= 0 (K_m in the thesis's list of values) [default: the vehicle's, or 2]
    #[arg(long, value_parser = finite, allow_hyphen_values = true)]
    xi: Option<f64>,
}

impl CameraArguments {
    /// The spar that these flags describe, every range checked, and its scales.
    ///
    /// # Errors
    /// [`CommandError::Input`] naming the file and field or the flag, the value and the allowed range.
    pub fn resolve(&self) -> Result<(CameraParameters<f64>, SparSi), CommandError> {
        let source = self.vehicle.read()?;
        let default = source.camera()?;
        let camera = CameraParameters {
            lm: not_negative("--lm", self.lm.unwrap_or(default.lm))?,
            lr: positive("--lr", self.lr.unwrap_or(default.lr))?,
            mm: not_negative("--mm", self.mm.unwrap_or(default.mm))?,
            mr: positive("--mr", self.mr.unwrap_or(default.mr))?,
            zeta: not_negative("--zeta", self.zeta.unwrap_or(default.zeta))?,
            xi: not_negative("--xi", self.xi.unwrap_or(default.xi))?,
        };
        Ok((camera, SparSi::of(&source)))
    }
}

/// The weights of the quadratic cost (7.20); the thesis's by default.
#[derive(Debug, Clone, Args)]
pub struct WeightArguments {
    /// Weights of theta^2, phi^2, theta'^2, phi'^2, each >= 0
    #[arg(long, value_name = "Q1,Q2,Q3,Q4", default_value = "10000,100,0,0", value_parser = numbers::<4>, allow_hyphen_values = true)]
    pub q: [f64; 4],
    /// Weight of v^2, > 0
    #[arg(long, value_name = "R", default_value_t = 1.0, value_parser = finite, allow_hyphen_values = true)]
    pub r: f64,
}

impl WeightArguments {
    /// The weights, every range checked.
    ///
    /// # Errors
    /// [`CommandError::Input`] naming the flag, the value and the allowed range.
    pub fn resolve(&self) -> Result<Weights, CommandError> {
        for q in self.q {
            require("--q", q, q >= 0.0, "four numbers, each zero or more")?;
        }
        Ok(Weights {
            q: self.q,
            r: positive("--r", self.r)?,
        })
    }
}

impl From<NoRegulator> for CommandError {
    fn from(error: NoRegulator) -> Self {
        Self::Input(format!("--q and --r: {error}"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn weights_must_be_positive_semidefinite() {
        let with = |q, r| WeightArguments { q, r }.resolve();
        assert_eq!(with([10_000.0, 100.0, 0.0, 0.0], 1.0).unwrap(), Weights::THESIS);
        let message = with([1.0, -3.0, 0.0, 0.0], 1.0).unwrap_err().to_string();
        assert_eq!(message, "--q is -3, must be four numbers, each zero or more");
        assert!(with([0.0; 4], 0.0).unwrap_err().to_string().starts_with("--r is 0"));
    }
}
