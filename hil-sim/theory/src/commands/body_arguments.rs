//! The flags that the planar vehicle and the vehicle in space share.

use clap::Args;
use model::dynamics::planar::PlanarParameters;

use crate::commands::taken::{THESIS, Taken};
use crate::commands::values::{finite, not_negative, positive, require};
use report::error::CommandError;

/// Arm, wheels and drives of the nondimensional vehicle: each number from its flag, else from the vehicle
/// file, else the thesis's (3.26), with its total damping.
#[derive(Debug, Clone, Default, Args)]
pub struct BodyArguments {
    /// Arm length over wheel radius, > 0 [default: the vehicle's, or 0.8]
    #[arg(long, value_parser = finite, allow_hyphen_values = true)]
    pub l: Option<f64>,
    /// Arm mass over total mass, above 0 and below 1 [default: the vehicle's, or 0.9]
    #[arg(long, value_parser = finite, allow_hyphen_values = true)]
    pub alpha: Option<f64>,
    /// Total damping of both wheels, back-EMF included, >= 0 [default: the vehicle's, or 2.2]
    #[arg(long, value_parser = finite, allow_hyphen_values = true)]
    pub zeta: Option<f64>,
    /// Rolling inertia of both wheels, >= 0 [default: the vehicle's, or 0.066]
    #[arg(long, value_parser = finite, allow_hyphen_values = true)]
    pub mu: Option<f64>,
    /// Reflected rotor inertia of both drives, >= 0 [default: the vehicle's, or 0]
    #[arg(long, value_parser = finite, allow_hyphen_values = true)]
    pub nu: Option<f64>,
}

impl BodyArguments {
    /// `default` with the numbers of the given flags, every range but that of the slope checked.
    ///
    /// # Errors
    /// [`CommandError::Input`] naming the flag, the value and the allowed range.
    pub fn over(&self, default: PlanarParameters<f64>) -> Result<PlanarParameters<f64>, CommandError> {
        let alpha = self.alpha.unwrap_or(default.alpha);
        Ok(PlanarParameters {
            l: positive("--l", self.l.unwrap_or(default.l))?,
            alpha: require("--alpha", alpha, alpha > 0.0 && alpha < 1.0, "above 0 and below 1")?,
            zeta: not_negative("--zeta", self.zeta.unwrap_or(default.zeta))?,
            mu: not_negative("--mu", self.mu.unwrap_or(default.mu))?,
            nu: not_negative("--nu", self.nu.unwrap_or(default.nu))?,
            beta: default.beta,
        })
    }

    /// The numbers of the thesis's vehicle, `thesis`, for the flags not given.
    pub fn taken(&self, thesis: &PlanarParameters<f64>) -> Vec<Taken> {
        [
            ("--l", self.l, thesis.l),
            ("--alpha", self.alpha, thesis.alpha),
            ("--zeta", self.zeta, thesis.zeta),
            ("--mu", self.mu, thesis.mu),
            ("--nu", self.nu, thesis.nu),
        ]
        .into_iter()
        .filter(|(_, given, _)| given.is_none())
        .map(|(flag, _, value)| Taken::new(flag, value, THESIS))
        .collect()
    }
}
