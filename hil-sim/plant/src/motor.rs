//! Brushed DC motors on H-bridges.
//!
//! The model averages a bridge over its PWM period: the bridge applies `duty x battery` to the motor, or is
//! open, and then only its body diodes conduct. The armature obeys `L i' = V - R i - K omega`. Over a
//! substep with the joint's mean rate the exact solution is
//!
//! ```text
//! i(h)    = i_inf (1 - E) + i(0) E,      i_inf = (V - K omega) / R,  E = exp(-h R / L)
//! mean(i) = i_inf (1 - P) + i(0) P,      P = (L / R h) (1 - E)
//! ```
//!
//! so the torque is linear in the mean rate and the body solves for both at once: the back-EMF is implicit,
//! so no substep is too long for it. With L = 0 both E and P vanish, which is the quasi-static motor. Rates
//! and torques are at the gearbox output.

#[cfg(test)]
mod tests;

use model::vehicle::MotorParameters;

use super::body::JointTorque;

/// The state of a motor's bridge.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum BridgeState {
    /// All four transistors off: current flows only through the body diodes.
    #[default]
    Open,
    /// The bridge applies this share of the battery voltage, -1 to 1, forward positive.
    Duty(f64),
    /// A lead is broken: no current, whatever the bridge does.
    Disconnected,
    /// The leads touch each other: the motor brakes, and the bridge chops into the short at this duty.
    Shorted(f64),
}

/// Resistance of a short between the leads as the bridge sees it, in Ohm.
const SHORT_OHM: f64 = 0.05;

/// Forward voltage of two body diodes in series, in V.
pub const DIODES_V: f64 = 1.6;

/// A motor with its gearbox.
#[derive(Debug, Clone)]
pub struct DcMotor {
    /// Torque at the output per ampere, and back-EMF per rad/s of the output.
    torque_constant: f64,
    back_emf: f64,
    resistance: f64,
    inductance: f64,
    coulomb: f64,
    /// Current at which the bridge's own hardware chops.
    chop_a: f64,
    /// The coefficients of the present substep, and of the present look-ahead.
    armature: Armature,
    ahead: Armature,
    current: f64,
    mean_current: f64,
    law: CurrentLaw,
    /// Share of the mean current that flows through the battery, signed.
    battery_share: f64,
    /// Battery voltage of the substep.
    battery_v: f64,
    /// Current of the bridge into a short, which bypasses the armature.
    short_a: Option<f64>,
}

/// The armature's coefficients for a substep of one length.
#[derive(Debug, Clone, Copy, Default)]
struct Armature {
    /// The substep's length.
    step: f64,
    /// E and P.
    decay: f64,
    share: f64,
    /// (1 - E) / R and (1 - P) / R.
    end_conductance: f64,
    mean_conductance: f64,
}

impl Armature {
    /// E and P of a substep of `step` seconds.
    fn over(step: f64, resistance: f64, inductance: f64) -> Self {
        let (decay, share) = if inductance > 0.0 {
            let ratio = step * resistance / inductance;
            (libm::exp(-ratio), -libm::expm1(-ratio) / ratio)
        } else {
            (0.0, 0.0)
        };
        Self {
            step,
            decay,
            share,
            end_conductance: (1.0 - decay) / resistance,
            mean_conductance: (1.0 - share) / resistance,
        }
    }

    /// The mean current, starting from `current`, at `volts` against a back-EMF of `emf`.
    #[inline]
    fn average(&self, current: f64, volts: f64, emf: f64) -> f64 {
        (volts - emf) * self.mean_conductance + current * self.share
    }
}

/// The time over which a current is sought.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum MotorSpan {
    /// The substep.
    Substep,
    /// The look-ahead.
    Ahead,
}

/// The motor's law within one substep.
#[derive(Debug, Clone, Copy, PartialEq)]
enum CurrentLaw {
    /// Mean and final current do not depend on the rate.
    Current {
        /// Mean current over the substep.
        mean: f64,
        /// Current at the end of the substep.
        end: f64,
    },
    /// A voltage at the terminals. `rectified` is the only allowed sign of the current (0 allows both).
    Voltage { volts: f64, rectified: f64 },
}

impl DcMotor {
    /// A motor whose bridge chops at `chop_a`.
    pub fn new(p: &MotorParameters<f64>, chop_a: f64) -> Self {
        Self {
            torque_constant: p.torque_constant_n_m_per_a * p.gear_ratio,
            back_emf: p.back_emf_constant_v_s_per_rad * p.gear_ratio,
            resistance: p.resistance_ohm,
            inductance: p.inductance_h,
            coulomb: p.coulomb_friction_n_m,
            chop_a,
            armature: Armature::default(),
            ahead: Armature::default(),
            current: 0.0,
            mean_current: 0.0,
            law: CurrentLaw::Current { mean: 0.0, end: 0.0 },
            battery_share: 0.0,
            battery_v: 0.0,
            short_a: None,
        }
    }

    /// Armature current at the end of the last substep, in A, forward positive.
    pub fn current_a(&self) -> f64 {
        self.current
    }

    /// Mean armature current over the last substep.
    pub fn mean_current_a(&self) -> f64 {
        self.mean_current
    }

    /// Current through the bridge, which the board measures: the armature's current, except with a short.
    pub fn bridge_current_a(&self) -> f64 {
        self.short_a.unwrap_or(self.mean_current)
    }

    /// Torque at the gearbox output over the last substep, before its friction.
    pub fn torque_n_m(&self) -> f64 {
        self.torque_constant * self.mean_current
    }

    /// Current from the battery to this motor over the last substep (negative while the motor returns
    /// current).
    pub fn battery_current_a(&self) -> f64 {
        match self.short_a {
            None => self.battery_share * self.mean_current,
            Some(short_a) => short_a * short_a * SHORT_OHM / self.battery_v,
        }
    }

    /// Prepares motors for a substep of `h` seconds. All of them take the same steps.
    #[inline]
    pub fn prepare(motors: &mut [Self], h: f64) {
        // The usual case: a substep as long as the last one.
        if motors.first().is_some_and(|motor| motor.armature.step != h) {
            for motor in motors {
                core::mem::swap(&mut motor.armature, &mut motor.ahead);
                if motor.armature.step != h {
                    motor.armature = Armature::over(h, motor.resistance, motor.inductance);
                }
            }
        }
    }

    /// Prepares motors for a look-ahead of `h` seconds. All of them look as far.
    #[inline]
    pub fn prepare_ahead(motors: &mut [Self], h: f64) {
        if motors.first().is_some_and(|motor| motor.ahead.step != h) {
            for motor in motors {
                motor.ahead = Armature::over(h, motor.resistance, motor.inductance);
            }
        }
    }

    /// The armature's coefficients over a span.
    #[inline]
    fn over(&self, span: MotorSpan) -> &Armature {
        match span {
            MotorSpan::Substep => &self.armature,
            MotorSpan::Ahead => &self.ahead,
        }
    }

    /// Mean current through the bridge over the look-ahead of `h` seconds, for which the motor is prepared, if the
    /// joint's mean rate is `rate`.
    #[inline]
    pub fn mean_current_after(&self, h: f64, bridge: BridgeState, battery_v: f64, rate: f64) -> f64 {
        if let BridgeState::Duty(duty) = bridge {
            let mean = self.ahead.average(self.current, duty * battery_v, self.back_emf * rate);
            return mean.clamp(-self.chop_a, self.chop_a);
        }
        self.step_ahead(h, bridge, battery_v, rate)
    }

    /// The mean current of a substep that is simulated on a copy of the motor.
    #[cold]
    fn step_ahead(&self, h: f64, bridge: BridgeState, battery_v: f64, rate: f64) -> f64 {
        let mut ahead = self.clone();
        ahead.armature = self.ahead;
        let _ = ahead.begin(h, bridge, battery_v, rate);
        ahead.end(rate);
        ahead.bridge_current_a()
    }

    /// The motor's current from the battery over a span as a linear function `a + b V` of the battery's
    /// voltage, at the joint's rate `rate`. `last_v` decides whether the bridge chops.
    #[inline]
    pub(crate) fn battery_load(&self, span: MotorSpan, bridge: BridgeState, last_v: f64, rate: f64) -> (f64, f64) {
        let Armature {
            share,
            mean_conductance: conductance,
            ..
        } = *self.over(span);
        let duty = match bridge {
            BridgeState::Duty(duty) => duty,
            BridgeState::Shorted(duty) if duty != 0.0 => {
                return (self.chop_a * self.chop_a * SHORT_OHM / last_v, 0.0);
            }
            _ => return (0.0, 0.0),
        };
        let emf = self.back_emf * rate;
        let rest = self.current * share - emf * conductance;
        let mean = rest + duty * last_v * conductance;
        if mean.abs() > self.chop_a {
            let limit = self.chop_a.copysign(mean);
            let through = ((emf + self.resistance * limit) / last_v).clamp(-1.0, 1.0);
            return (through * limit, 0.0);
        }
        (duty * rest, duty * duty * conductance)
    }

    /// Begins a substep of `h` seconds, for which the motor is prepared: the torque law of the joint under `bridge` at the battery's
    /// voltage, as far as the joint's present `rate` shows which branch applies.
    // Inlined at its one call per substep and one rare call, so the result stays in registers.
    #[allow(clippy::inline_always)]
    #[inline(always)]
    pub fn begin(&mut self, h: f64, bridge: BridgeState, battery_v: f64, rate: f64) -> JointTorque {
        self.battery_v = battery_v;
        let emf = self.back_emf * rate;
        self.short_a = None;
        (self.law, self.battery_share) = match bridge {
            BridgeState::Duty(duty) => {
                let volts = duty * battery_v;
                (CurrentLaw::Voltage { volts, rectified: 0.0 }, duty)
            }
            BridgeState::Open => self.open(h, battery_v + DIODES_V, emf),
            BridgeState::Disconnected => (CurrentLaw::Current { mean: 0.0, end: 0.0 }, 0.0),
            BridgeState::Shorted(duty) => {
                self.short_a = Some(if duty == 0.0 { 0.0 } else { self.chop_a.copysign(duty) });
                (
                    CurrentLaw::Voltage {
                        volts: 0.0,
                        rectified: 0.0,
                    },
                    0.0,
                )
            }
        };
        let (constant, damping) = match self.law {
            CurrentLaw::Current { mean, .. } => (self.torque_constant * mean, 0.0),
            CurrentLaw::Voltage { volts, .. } => {
                let conductance = self.armature.mean_conductance;
                let mean = self.current * self.armature.share + volts * conductance;
                (
                    self.torque_constant * mean,
                    self.torque_constant * self.back_emf * conductance,
                )
            }
        };
        JointTorque {
            constant_n_m: constant,
            damping_n_m_s: damping,
            limit_n_m: self.torque_constant * self.chop_a,
            coulomb_n_m: self.coulomb,
        }
    }

    /// An open bridge: the diodes let current flow only against `barrier`, into the battery.
    fn open(&self, h: f64, barrier: f64, emf: f64) -> (CurrentLaw, f64) {
        let i = self.current;
        if i == 0.0 && emf.abs() <= barrier {
            return (CurrentLaw::Current { mean: 0.0, end: 0.0 }, 0.0);
        }
        // The current flows against the diodes' voltage.
        let sign = if i == 0.0 { -emf.signum() } else { i.signum() };
        let volts = -sign * barrier;
        let settled = (volts - emf) / self.resistance;
        if settled * sign > 0.0 {
            // The back-EMF keeps the current flowing: the motor generates into the battery.
            return (CurrentLaw::Voltage { volts, rectified: sign }, -sign);
        }
        // The current decays to zero, within this substep or later.
        let rest = if self.inductance > 0.0 {
            let tau = self.inductance / self.resistance;
            let dies_after = tau * libm::log1p(i / -settled);
            if dies_after < h {
                let charge = settled * dies_after + (i - settled) * tau * -libm::expm1(-dies_after / tau);
                CurrentLaw::Current {
                    mean: charge / h,
                    end: 0.0,
                }
            } else {
                CurrentLaw::Current {
                    mean: self.average_current(volts, emf),
                    end: self.end_current(volts, emf),
                }
            }
        } else {
            CurrentLaw::Current { mean: 0.0, end: 0.0 }
        };
        (rest, -sign)
    }

    /// Ends the substep with the joint's mean rate over the substep.
    #[inline]
    pub fn end(&mut self, mean_rate: f64) {
        let emf = self.back_emf * mean_rate;
        (self.mean_current, self.current) = match self.law {
            CurrentLaw::Current { mean, end } => (mean, end),
            CurrentLaw::Voltage { volts, rectified } => {
                let end = self.end_current(volts, emf);
                let end = if rectified * end < 0.0 { 0.0 } else { end };
                let (mean, chop) = (self.average_current(volts, emf), self.chop_a);
                if rectified == 0.0 && mean.abs() > chop {
                    // The bridge chops: it passes just enough voltage to keep the current at the limit.
                    let through = emf + self.resistance * chop.copysign(mean);
                    self.battery_share = (through / self.battery_v).clamp(-1.0, 1.0);
                }
                (mean.clamp(-chop, chop), end.clamp(-chop, chop))
            }
        };
    }

    fn end_current(&self, volts: f64, emf: f64) -> f64 {
        (volts - emf) * self.armature.end_conductance + self.current * self.armature.decay
    }

    fn average_current(&self, volts: f64, emf: f64) -> f64 {
        self.armature.average(self.current, volts, emf)
    }
}
