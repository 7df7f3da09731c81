//! The flags of the planar vehicle, shared by every command of chapters 3 to 5 and 8.

use clap::Args;
use model::control::speed_law::SpeedLaw;
use model::dynamics::planar::PlanarParameters;

use crate::analysis::waveform::Waveform;
use crate::cli::values::{finite, not_negative, positive, require};
use crate::error::CommandError;

/// The nondimensional planar vehicle; the thesis's (3.26) by default, with its total damping.
#[derive(Debug, Clone, Args)]
pub struct PlanarArguments {
    /// Arm length over wheel radius, > 0
    #[arg(long, default_value_t = 0.8, value_parser = finite, allow_hyphen_values = true)]
    pub l: f64,
    /// Reaction mass over total mass, above 0 and below 1
    #[arg(long, default_value_t = 0.9, value_parser = finite, allow_hyphen_values = true)]
    pub alpha: f64,
    /// Total damping, back-EMF included, >= 0
    #[arg(long, default_value_t = 2.2, value_parser = finite, allow_hyphen_values = true)]
    pub zeta: f64,
    /// Wheel inertia, >= 0
    #[arg(long, default_value_t = 0.066, value_parser = finite, allow_hyphen_values = true)]
    pub mu: f64,
    /// Reflected rotor inertia, >= 0
    #[arg(long, default_value_t = 0.0, value_parser = finite, allow_hyphen_values = true)]
    pub nu: f64,
    /// Slope in rad, positive uphill
    #[arg(long, default_value_t = 0.0873, value_parser = finite, allow_hyphen_values = true)]
    pub beta: f64,
}

impl PlanarArguments {
    /// The vehicle these flags describe, every range checked.
    ///
    /// # Errors
    /// [`CommandError::Input`] naming the flag, the value and the allowed range.
    pub fn resolve(&self) -> Result<PlanarParameters<f64>, CommandError> {
        let Self {
            l,
            alpha,
            zeta,
            mu,
            nu,
            beta,
        } = *self;
        positive("--l", l)?;
        require("--alpha", alpha, alpha > 0.0 && alpha < 1.0, "above 0 and below 1")?;
        not_negative("--zeta", zeta)?;
        not_negative("--mu", mu)?;
        not_negative("--nu", nu)?;
        let quarter = std::f64::consts::FRAC_PI_2;
        require("--beta", beta, beta.abs() < quarter, "between -pi/2 and pi/2 (rad)")?;
        Ok(PlanarParameters {
            l,
            alpha,
            zeta,
            mu,
            nu,
            beta,
        })
    }

    /// As [`Self::resolve`], for a command that starts from the static equilibrium: the slope must have one.
    ///
    /// # Errors
    /// [`CommandError::Input`] naming the flag, the value and the allowed range.
    pub fn resolve_in_equilibrium(&self) -> Result<PlanarParameters<f64>, CommandError> {
        let p = self.resolve()?;
        require_static_equilibrium(&p)?;
        Ok(p)
    }
}

/// Refuses a slope on which the vehicle cannot stand (3.16): `|sin beta| < alpha l` is needed.
///
/// # Errors
/// [`CommandError::Input`] naming the slope and the limit.
pub fn require_static_equilibrium(p: &PlanarParameters<f64>) -> Result<(), CommandError> {
    let al = p.alpha * p.l;
    let allowed = if al < 1.0 {
        format!("within the static limit |beta| < asin(alpha l) = {} rad", al.asin())
    } else {
        "between -pi/2 and pi/2 (rad)".to_owned()
    };
    require("--beta", p.beta, p.beta.sin().abs() < al, &allowed).map(|_| ())
}

/// The gains of the speed law (3.25), corrected.
#[derive(Debug, Clone, Args)]
pub struct LawArguments {
    /// Gain on theta' - theta'_ref
    #[arg(long, default_value_t = 0.8, value_parser = finite, allow_hyphen_values = true)]
    pub kp: f64,
    /// Gain on phi', entering with a minus sign
    #[arg(long, default_value_t = 10.0, value_parser = finite, allow_hyphen_values = true)]
    pub kd: f64,
    /// Damping assumed in the feed-forward; the vehicle's own if not given
    #[arg(long, value_name = "ZETA", value_parser = finite, allow_hyphen_values = true)]
    pub feed_forward: Option<f64>,
}

impl LawArguments {
    /// The law for the vehicle `p`.
    ///
    /// # Errors
    /// None at present: every finite gain is a law, stable or not.
    pub fn resolve(&self, p: &PlanarParameters<f64>) -> Result<SpeedLaw<f64>, CommandError> {
        let feed_forward_zeta = self.feed_forward.unwrap_or(p.zeta);
        Ok(SpeedLaw {
            feed_forward_zeta,
            alpha_l: p.alpha * p.l,
            kp: self.kp,
            kd: self.kd,
        })
    }
}

/// How an input arrives at its final value.
#[derive(Debug, Clone, Args)]
pub struct WaveformArguments {
    /// Shape of the input
    #[arg(long, value_enum, default_value_t = Waveform::Step)]
    pub waveform: Waveform,
    /// Time the waveform takes to arrive, in time units
    #[arg(long, value_name = "T", default_value_t = 5.0, value_parser = finite, allow_hyphen_values = true)]
    pub ramp_time: f64,
}

impl WaveformArguments {
    /// The waveform and its ramp time, checked.
    ///
    /// # Errors
    /// [`CommandError::Input`] for a negative ramp time.
    pub fn resolve(&self) -> Result<(Waveform, f64), CommandError> {
        Ok((self.waveform, not_negative("--ramp-time", self.ramp_time)?))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn arguments() -> PlanarArguments {
        PlanarArguments {
            l: 0.8,
            alpha: 0.9,
            zeta: 2.2,
            mu: 0.066,
            nu: 0.0,
            beta: 0.0873,
        }
    }

    #[test]
    fn each_bad_value_is_named() {
        assert!(arguments().resolve_in_equilibrium().is_ok());
        let cases: [(&str, PlanarArguments); 8] = [
            ("--l is 0", PlanarArguments { l: 0.0, ..arguments() }),
            (
                "--alpha is 1",
                PlanarArguments {
                    alpha: 1.0,
                    ..arguments()
                },
            ),
            (
                "--alpha is -0.1",
                PlanarArguments {
                    alpha: -0.1,
                    ..arguments()
                },
            ),
            (
                "--zeta is -1",
                PlanarArguments {
                    zeta: -1.0,
                    ..arguments()
                },
            ),
            (
                "--mu is NaN",
                PlanarArguments {
                    mu: f64::NAN,
                    ..arguments()
                },
            ),
            (
                "--nu is inf",
                PlanarArguments {
                    nu: f64::INFINITY,
                    ..arguments()
                },
            ),
            (
                "--beta is 0.81",
                PlanarArguments {
                    beta: 0.81,
                    ..arguments()
                },
            ),
            (
                "--beta is -1.6",
                PlanarArguments {
                    beta: -1.6,
                    ..arguments()
                },
            ),
        ];
        for (start, case) in cases {
            let message = case.resolve_in_equilibrium().unwrap_err().to_string();
            assert!(message.starts_with(start) && message.contains("must be"), "{message}");
        }
        assert!(
            PlanarArguments {
                beta: 0.81,
                ..arguments()
            }
            .resolve()
            .is_ok()
        );
    }
}
