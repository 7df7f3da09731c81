//! The flags of the planar vehicle, shared by every command of chapters 3 to 5 and 8.

use clap::Args;
use model::control::speed_law::SpeedLaw;
use model::dynamics::planar::PlanarParameters;

use crate::analysis::carrying::carrying;
use crate::analysis::equilibrium::static_phi;
use crate::analysis::waveform::Waveform;
use crate::commands::body_arguments::BodyArguments;
use crate::commands::si::Si;
use crate::commands::taken::{THESIS, Taken};
use crate::commands::values::{finite, gain, require, slope};
use crate::commands::vehicle_argument::{Source, VehicleArgument};
use report::error::CommandError;

/// The nondimensional planar vehicle on its slope.
#[derive(Debug, Clone, Default, Args)]
pub struct PlanarArguments {
    /// The vehicle file.
    #[command(flatten)]
    pub vehicle: VehicleArgument,
    /// Arm, wheels and drives.
    #[command(flatten)]
    pub body: BodyArguments,
    /// Slope in rad, positive uphill [default: that of a `[planar]` file, or 0.0873]
    #[arg(long, value_parser = finite, allow_hyphen_values = true)]
    pub beta: Option<f64>,
}

/// A planar vehicle, checked.
#[derive(Debug, Clone, PartialEq)]
pub struct PlanarVehicle {
    /// The parameters.
    pub parameters: PlanarParameters<f64>,
    /// Source of the parameters that no flag gives.
    pub source: Source,
    /// The slope's name in messages: the flag, or the field of the vehicle file.
    pub beta_name: String,
    /// The numbers that neither a flag nor the file gives.
    pub taken: Vec<Taken>,
}

impl PlanarArguments {
    /// The vehicle these flags describe, every range checked. The vehicle includes the mass of its camera
    /// spar, if any, and all its numbers are divided by the whole mass.
    ///
    /// # Errors
    /// [`CommandError::Input`] naming the file and field or the flag, the value and the allowed range.
    pub fn resolve(&self) -> Result<PlanarVehicle, CommandError> {
        let vehicle = self.resolve_without_spar()?;
        Ok(PlanarVehicle {
            parameters: carrying(&vehicle.parameters, vehicle.source.whole_mass()),
            ..vehicle
        })
    }

    /// As [`PlanarArguments::resolve`], for a command whose equations include the spar: all numbers are
    /// divided by the mass of wheels and arm.
    ///
    /// # Errors
    /// As [`PlanarArguments::resolve`].
    pub fn resolve_without_spar(&self) -> Result<PlanarVehicle, CommandError> {
        let source = self.vehicle.read()?;
        let default = source.planar();
        let parameters = PlanarParameters {
            beta: slope("--beta", self.beta.unwrap_or(default.beta))?,
            ..self.body.over(default)?
        };
        let beta_name = source.name("beta", self.beta.is_some());
        let mut taken = match source {
            Source::Thesis => self.body.taken(&default),
            Source::File(..) => Vec::new(),
        };
        if self.beta.is_none() && !source.has_slope() {
            taken.push(Taken::new("--beta", default.beta, "the thesis's slope, rad"));
        }
        Ok(PlanarVehicle {
            parameters,
            source,
            beta_name,
            taken,
        })
    }
}

impl PlanarVehicle {
    /// SI scales of a vehicle that carries its spar.
    pub fn si(&self) -> Si {
        Si::of(&self.source).carrying(self.source.whole_mass())
    }

    /// The parameters, for a command that starts from the static equilibrium, which exists only where
    /// `|sin beta| < alpha l` (3.16).
    ///
    /// # Errors
    /// [`CommandError::Input`] naming the slope and the limit.
    pub fn in_equilibrium(&self) -> Result<PlanarParameters<f64>, CommandError> {
        require_static_equilibrium(&self.beta_name, &self.parameters)?;
        Ok(self.parameters)
    }
}

/// Refuses a slope, called `name`, on which the vehicle cannot stand (3.16): `|sin beta| < alpha l` is needed.
///
/// # Errors
/// [`CommandError::Input`] naming the slope and the limit.
pub fn require_static_equilibrium(name: &str, p: &PlanarParameters<f64>) -> Result<(), CommandError> {
    let al = p.alpha * p.l;
    let allowed = if al < 1.0 {
        format!("within the static limit |beta| < asin(alpha l) = {} rad", al.asin())
    } else {
        "between -pi/2 and pi/2 (rad)".to_owned()
    };
    require(name, p.beta, p.beta.sin().abs() < al, &allowed).map(|_| ())
}

/// The gains of the speed law (3.25), corrected.
#[derive(Debug, Clone, Args)]
pub struct LawArguments {
    /// Gain on theta' - theta'_ref, as in the vehicle file [default: the vehicle's, or 0.8]
    #[arg(long, value_parser = finite, allow_hyphen_values = true)]
    kp: Option<f64>,
    /// Gain on phi', entering with a minus sign, as in the vehicle file [default: the vehicle's, or 10]
    #[arg(long, value_parser = finite, allow_hyphen_values = true)]
    kd: Option<f64>,
    /// Damping assumed in the feed-forward; the vehicle's own if not given
    #[arg(long, value_name = "ZETA", value_parser = finite, allow_hyphen_values = true)]
    pub feed_forward: Option<f64>,
}

impl LawArguments {
    /// kp and kd, unchecked.
    pub fn gains(&self, source: &Source) -> (f64, f64) {
        let (kp, kd) = source.gains();
        (self.kp.unwrap_or(kp), self.kd.unwrap_or(kd))
    }

    /// The gains that neither a flag nor the file gives.
    pub fn taken(&self, source: &Source) -> Vec<Taken> {
        if source.whole_vehicle().is_some() {
            return Vec::new();
        }
        let (kp, kd) = source.gains();
        [("--kp", self.kp, kp), ("--kd", self.kd, kd)]
            .into_iter()
            .filter(|(_, given, _)| given.is_none())
            .map(|(flag, _, gain)| Taken::new(flag, gain, THESIS))
            .collect()
    }

    /// The law for the vehicle `p`, with the gains of the file where no flag gives them.
    ///
    /// # Errors
    /// [`CommandError::Input`] naming the flag of a gain beyond the largest; unstable gains are allowed.
    pub fn resolve(&self, p: &PlanarParameters<f64>, source: &Source) -> Result<SpeedLaw<f64>, CommandError> {
        let (kp, kd) = self.gains(source);
        let mass = source.whole_mass();
        let feed_forward_zeta = gain("--feed-forward", self.feed_forward.unwrap_or(p.zeta))?;
        Ok(SpeedLaw {
            feed_forward_zeta,
            alpha_l: p.alpha * p.l,
            kp: gain("--kp", kp)? / mass,
            kd: gain("--kd", kd)? / mass,
        })
    }
}

/// The state at the start of a run.
#[derive(Debug, Clone, Args)]
pub struct StartArguments {
    /// phi at the start, rad; the static equilibrium if not given
    #[arg(long, value_name = "X", value_parser = finite, allow_hyphen_values = true)]
    phi0: Option<f64>,
    /// theta' at the start
    #[arg(long, value_name = "X", default_value_t = 0.0, value_parser = finite, allow_hyphen_values = true)]
    pub theta_rate0: f64,
}

impl StartArguments {
    /// phi at the start: the given value, or the static equilibrium, which then must exist.
    ///
    /// # Errors
    /// [`CommandError::Input`] naming the slope and its limit.
    pub fn phi(&self, vehicle: &PlanarVehicle) -> Result<f64, CommandError> {
        if let Some(phi) = self.phi0 {
            return Ok(phi);
        }
        let p = vehicle.in_equilibrium()?;
        Ok(static_phi(&p).unwrap_or(0.0))
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
    /// [`CommandError::Input`] for a ramp time that is negative or beyond the longest.
    pub fn resolve(&self) -> Result<(Waveform, f64), CommandError> {
        Ok((self.waveform, ramp_time(self.ramp_time)?))
    }
}

/// The longest ramp, in time units.
const LONGEST_RAMP: f64 = 1e4;

/// The `--ramp-time`, checked.
///
/// # Errors
/// [`CommandError::Input`] naming the flag, the value and the allowed range.
pub fn ramp_time(value: f64) -> Result<f64, CommandError> {
    let ok = (0.0..=LONGEST_RAMP).contains(&value);
    let allowed = format!("zero or more and at most {LONGEST_RAMP}");
    require("--ramp-time", value, ok, &allowed)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn with(change: impl FnOnce(&mut PlanarArguments)) -> Result<PlanarParameters<f64>, String> {
        let mut arguments = PlanarArguments::default();
        change(&mut arguments);
        arguments
            .resolve()
            .and_then(|vehicle| vehicle.in_equilibrium())
            .map_err(|error| error.to_string())
    }

    #[test]
    fn each_bad_value_is_named() {
        assert_eq!(with(|_| ()), Ok(PlanarParameters::thesis()));
        for (start, found) in [
            ("--l is 0", with(|a| a.body.l = Some(0.0))),
            ("--alpha is 1", with(|a| a.body.alpha = Some(1.0))),
            ("--alpha is -0.1", with(|a| a.body.alpha = Some(-0.1))),
            ("--zeta is -1", with(|a| a.body.zeta = Some(-1.0))),
            ("--mu is NaN", with(|a| a.body.mu = Some(f64::NAN))),
            ("--nu is inf", with(|a| a.body.nu = Some(f64::INFINITY))),
            ("--beta is 0.81", with(|a| a.beta = Some(0.81))),
            ("--beta is -1.6", with(|a| a.beta = Some(-1.6))),
        ] {
            let message = found.unwrap_err();
            assert!(message.starts_with(start) && message.contains("must be"), "{message}");
        }
        let steep = PlanarArguments {
            beta: Some(0.81),
            ..PlanarArguments::default()
        };
        assert!(steep.resolve().is_ok());
    }
}
