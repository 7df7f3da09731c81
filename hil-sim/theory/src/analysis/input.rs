//! The input of the planar vehicle: a voltage or a reference speed, shaped by a waveform.

use model::control::speed_law::SpeedLaw;
use model::dynamics::planar::{PHI, PHI_RATE, PlanarParameters, PlanarState, THETA_RATE};

use super::waveform::Waveform;

/// The input over time: the hold voltage before t = 0, then the move to the final value.
/// Nondimensional, in the units of ch. 3; angles in rad.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Input {
    /// The final voltage or, with a `law`, the final reference speed.
    pub target: f64,
    /// The value before the move: `sin(beta)` for a voltage, 0 for a reference.
    pub initial: f64,
    /// The shape of the move.
    pub waveform: Waveform,
    /// Duration of the move, >= 0.
    pub ramp_time: f64,
    /// The speed loop (3.25), if the target is a speed.
    pub law: Option<SpeedLaw<f64>>,
    /// The available voltage in either direction; infinite if not limited.
    pub u_max: f64,
}

impl Input {
    /// A voltage step from the hold voltage on the slope of `p`.
    pub fn voltage_step(p: &PlanarParameters<f64>, target: f64) -> Self {
        let initial = p.beta.sin();
        Self {
            target,
            initial,
            waveform: Waveform::Step,
            ramp_time: 0.0,
            law: None,
            u_max: f64::INFINITY,
        }
    }

    /// A step of the reference speed of the loop (3.25) with `law`.
    pub fn reference_step(law: SpeedLaw<f64>, target: f64) -> Self {
        let (waveform, u_max) = (Waveform::Step, f64::INFINITY);
        Self {
            target,
            initial: 0.0,
            waveform,
            ramp_time: 0.0,
            law: Some(law),
            u_max,
        }
    }

    /// The input with another waveform.
    #[must_use]
    pub fn shaped(self, waveform: Waveform, ramp_time: f64) -> Self {
        Self {
            waveform,
            ramp_time,
            ..self
        }
    }

    /// The input with another final value.
    #[must_use]
    pub fn towards(self, target: f64) -> Self {
        Self { target, ..self }
    }

    /// Time at which the input has arrived and no longer depends on time.
    pub fn arrival(&self) -> f64 {
        self.waveform.duration(self.ramp_time)
    }

    /// The shaped value at `t`: voltage or reference speed.
    #[inline]
    pub fn value(&self, t: f64) -> f64 {
        let w = self.waveform.at(t, self.ramp_time);
        if w == 1.0 {
            self.target
        } else {
            self.initial + (self.target - self.initial) * w
        }
    }

    /// The voltage at `t` in the state `x`.
    #[inline]
    pub fn voltage(&self, t: f64, x: &PlanarState<f64>) -> f64 {
        let value = self.value(t);
        let u = match &self.law {
            Some(law) => law.voltage(value, x[PHI], x[THETA_RATE], x[PHI_RATE]),
            None => value,
        };
        u.clamp(-self.u_max, self.u_max)
    }
}
