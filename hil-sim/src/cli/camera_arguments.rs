//! The flags of the camera platform and of its optimal regulator, shared by `lqr` and `camera`.

use clap::Args;
use model::dynamics::camera::CameraParameters;

use crate::analysis::lqr::{NoRegulator, Weights};
use crate::cli::values::{finite, not_negative, positive, require};
use crate::error::CommandError;

const SIXTH: f64 = 1.0 / 6.0;

/// The nondimensional camera platform; the thesis's by default.
#[derive(Debug, Clone, Args)]
pub struct CameraArguments {
    /// Axle to motor over axle to camera, >= 0
    #[arg(long, default_value_t = SIXTH, value_parser = finite, allow_hyphen_values = true)]
    pub lm: f64,
    /// Motor to ballast over axle to camera, > 0
    #[arg(long, default_value_t = SIXTH, value_parser = finite, allow_hyphen_values = true)]
    pub lr: f64,
    /// Motor's mass over the camera's, >= 0
    #[arg(long, default_value_t = 3.0, value_parser = finite, allow_hyphen_values = true)]
    pub mm: f64,
    /// Ballast's mass over the camera's, > 0
    #[arg(long, default_value_t = 4.0, value_parser = finite, allow_hyphen_values = true)]
    pub mr: f64,
    /// Damping of the spar's bearing, >= 0
    #[arg(long, default_value_t = 0.2, value_parser = finite, allow_hyphen_values = true)]
    pub zeta: f64,
    /// Back-EMF of the motor, >= 0 (K_m in the thesis's list of values)
    #[arg(long, default_value_t = 2.0, value_parser = finite, allow_hyphen_values = true)]
    pub xi: f64,
}

impl CameraArguments {
    /// The platform these flags describe, every range checked.
    ///
    /// # Errors
    /// [`CommandError::Input`] naming the flag, the value and the allowed range.
    pub fn resolve(&self) -> Result<CameraParameters<f64>, CommandError> {
        Ok(CameraParameters {
            lm: not_negative("--lm", self.lm)?,
            lr: positive("--lr", self.lr)?,
            mm: not_negative("--mm", self.mm)?,
            mr: positive("--mr", self.mr)?,
            zeta: not_negative("--zeta", self.zeta)?,
            xi: not_negative("--xi", self.xi)?,
        })
    }
}

/// The weights of the quadratic cost (7.20); the thesis's by default.
#[derive(Debug, Clone, Args)]
pub struct WeightArguments {
    /// Weights of theta^2, phi^2, theta'^2, phi'^2, each >= 0
    #[arg(long, value_name = "Q1,Q2,Q3,Q4", default_value = "10000,100,0,0", value_parser = four_numbers, allow_hyphen_values = true)]
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

/// Parses four finite numbers separated by commas.
///
/// # Errors
/// What is allowed (clap adds the flag and the value).
pub fn four_numbers(text: &str) -> Result<[f64; 4], String> {
    numbers::<4>(text)
}

/// Parses `N` finite numbers separated by commas.
///
/// # Errors
/// What is allowed.
pub fn numbers<const N: usize>(text: &str) -> Result<[f64; N], String> {
    let allowed = || format!("must be {N} finite numbers separated by commas");
    let values: Vec<f64> = text
        .split(',')
        .map(finite)
        .collect::<Result<_, _>>()
        .map_err(|_| allowed())?;
    values.try_into().map_err(|_| allowed())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lists_of_numbers_are_checked() {
        assert_eq!(four_numbers("1,-2.5, 3e2,0"), Ok([1.0, -2.5, 300.0, 0.0]));
        for bad in ["1,2,3", "1,2,3,4,5", "1,2,,4", "1,2,NaN,4", ""] {
            assert_eq!(
                four_numbers(bad),
                Err("must be 4 finite numbers separated by commas".into()),
                "{bad}"
            );
        }
    }

    #[test]
    fn weights_must_be_positive_semidefinite() {
        let with = |q, r| WeightArguments { q, r }.resolve();
        assert_eq!(with([10_000.0, 100.0, 0.0, 0.0], 1.0).unwrap(), Weights::THESIS);
        let message = with([1.0, -3.0, 0.0, 0.0], 1.0).unwrap_err().to_string();
        assert_eq!(message, "--q is -3, must be four numbers, each zero or more");
        assert!(with([0.0; 4], 0.0).unwrap_err().to_string().starts_with("--r is 0"));
    }
}
