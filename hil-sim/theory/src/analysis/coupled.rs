//! The vehicle with a spar (ch. 8, corrected): responses and step limits.

use std::f64::consts::TAU;
use std::ops::ControlFlow;

use model::control::spar_law::SparLaw;
use model::control::speed_law::SpeedLaw;
use model::dynamics::camera::CameraParameters;
use model::dynamics::coupled::{
    Bearing, Coupled, CoupledParameters, CoupledState, GAMMA, GAMMA_RATE, PHI, PHI_RATE, PSI, PSI_RATE, THETA,
    THETA_RATE,
};
use model::dynamics::planar::PlanarParameters;
use rayon::prelude::*;
use serde::Serialize;

use super::camera::RUNAWAY_RATE;
use super::critical::Direction;
use super::dop853::Dense;
use super::trajectory::{Extent, Trajectory, follow};
use super::waveform::Waveform;

/// Ballast over M + m in chapter 8's example, used if neither a flag nor a vehicle file gives the value.
pub const BALLAST_SHARE: f64 = 0.15;

/// The span within which the search for a step limit looks for a whirl or a tumble, in time units.
pub const CRITICAL_SPAN: f64 = 100.0;

/// The thesis's spar on the vehicle `planar`: `lp` wheel radii long, its ballast `kr` of M + m and the
/// other masses, lengths, damping and motor of ch. 7 in proportion.
pub fn with_thesis_spar(planar: PlanarParameters<f64>, lp: f64, kr: f64, bearing: Bearing) -> CoupledParameters<f64> {
    let camera = CameraParameters::thesis();
    CoupledParameters::with_camera(planar, &camera, lp, kr / camera.mr, bearing)
}

/// phi of the loaded vehicle's static equilibrium, (8.8) corrected; `None` beyond the static limit.
pub fn static_phi(p: &CoupledParameters<f64>) -> Option<f64> {
    let sine = p.hold_voltage() / (p.planar.alpha * p.planar.l);
    (sine.abs() < 1.0).then(|| sine.asin())
}

/// The steepest slope (rad) on which the loaded vehicle stands: (8.9), corrected.
pub fn static_limit(p: &CoupledParameters<f64>) -> f64 {
    (p.planar.alpha * p.planar.l / (1.0 + p.spar_mass())).min(1.0).asin()
}

/// How a run ends.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Ending {
    /// Neither the arm nor the ballast turned fully.
    Ok,
    /// The arm turned fully.
    Whirl,
    /// The ballast turned fully first.
    Tumble,
}

impl Ending {
    /// The word used on the command line, in JSON and in reports.
    pub fn name(self) -> &'static str {
        match self {
            Self::Ok => "ok",
            Self::Whirl => "whirl",
            Self::Tumble => "tumble",
        }
    }
}

/// One vehicle with its spar controller and its input.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SteppedDrive {
    /// The vehicle.
    pub vehicle: CoupledParameters<f64>,
    /// The spar's gains in vehicle units; without gains the ballast motor stays at v = 0.
    pub gains: Option<[f64; 4]>,
    /// The speed loop (3.25), if the target is a speed instead of a voltage.
    pub law: Option<SpeedLaw<f64>>,
    /// How the input moves to its target: a voltage starts from the hold voltage, a speed from 0.
    pub waveform: Waveform,
    /// Duration of that move, in time units.
    pub ramp_time: f64,
    /// Initial phi, at rest.
    pub phi_0: f64,
}

/// The sampled motion of a drive, and how it ended.
#[derive(Debug, Clone, Serialize)]
pub struct CoupledRun {
    /// Sample times.
    pub t: Vec<f64>,
    /// Wheel, rad.
    pub theta: Vec<f64>,
    /// Arm from the vertical, rad.
    pub phi: Vec<f64>,
    /// Spar from the vertical, rad.
    pub psi: Vec<f64>,
    /// Ballast relative to the spar, rad.
    pub gamma: Vec<f64>,
    /// theta'.
    pub theta_rate: Vec<f64>,
    /// phi'.
    pub phi_rate: Vec<f64>,
    /// psi'.
    pub psi_rate: Vec<f64>,
    /// gamma'.
    pub gamma_rate: Vec<f64>,
    /// Drive voltage.
    pub voltage: Vec<f64>,
    /// Ballast motor's voltage, in vehicle units.
    pub v: Vec<f64>,
    /// How the drive ended. A run with a runaway ballast ends early.
    pub outcome: Ending,
    /// Largest |psi|, deg.
    pub psi_max_deg: f64,
    /// Largest |phi|, deg.
    pub phi_max_deg: f64,
}

/// The smallest input that fails.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct CriticalStep {
    /// The smallest final voltage (or speed, with a speed loop) that fails.
    pub critical: f64,
    /// How the drive fails there.
    pub outcome: Ending,
}

impl SteppedDrive {
    /// A step from the static equilibrium; `None` if the slope has no static equilibrium.
    pub fn step(vehicle: CoupledParameters<f64>, gains: Option<[f64; 4]>) -> Option<Self> {
        let phi_0 = static_phi(&vehicle)?;
        Some(Self {
            vehicle,
            gains,
            law: None,
            waveform: Waveform::Step,
            ramp_time: 0.0,
            phi_0,
        })
    }

    /// The drive voltage at `t` in the state `x` on the way to `target`.
    pub fn voltage(&self, target: f64, t: f64, x: &CoupledState<f64>) -> f64 {
        let w = self.waveform.at(t, self.ramp_time);
        match &self.law {
            Some(law) => law.voltage(w * target, x[PHI], x[THETA_RATE], x[PHI_RATE]),
            None if w == 1.0 => target,
            None => {
                let hold = self.vehicle.hold_voltage();
                hold + (target - hold) * w
            }
        }
    }

    /// The ballast motor's voltage in the state `x`.
    pub fn ballast_voltage(&self, x: &CoupledState<f64>) -> f64 {
        let law = |gains| SparLaw { gains }.voltage(x[PSI], x[GAMMA], x[PSI_RATE], x[GAMMA_RATE]);
        self.gains.map_or(0.0, law)
    }

    /// Runs to `t_end` on the way to the final `target` and samples every `dt`.
    pub fn run(&self, target: f64, t_end: f64, dt: f64) -> CoupledRun {
        let mut samples = Trajectory::default();
        let (mut psi, mut phi) = (Extent::EMPTY, Extent::EMPTY);
        let mut outcome = Ending::Ok;
        self.follow(target, t_end, |step| {
            samples.sample(step, dt, t_end);
            psi.see(step, 0.0, PSI);
            phi.see(step, 0.0, PHI);
            if outcome == Ending::Ok {
                outcome = ending_of(step, self.phi_0);
            }
            false
        });
        CoupledRun {
            theta: samples.component(THETA),
            phi: samples.component(PHI),
            psi: samples.component(PSI),
            gamma: samples.component(GAMMA),
            theta_rate: samples.component(THETA_RATE),
            phi_rate: samples.component(PHI_RATE),
            psi_rate: samples.component(PSI_RATE),
            gamma_rate: samples.component(GAMMA_RATE),
            voltage: samples
                .t
                .iter()
                .zip(&samples.x)
                .map(|(t, x)| self.voltage(target, *t, x))
                .collect(),
            v: samples.x.iter().map(|x| self.ballast_voltage(x)).collect(),
            t: samples.t,
            outcome,
            psi_max_deg: psi.largest().to_degrees(),
            phi_max_deg: phi.largest().to_degrees(),
        }
    }

    /// How the drive to the final `target` ends within `t_end`.
    pub fn ending(&self, target: f64, t_end: f64) -> Ending {
        let mut ending = Ending::Ok;
        self.follow(target, t_end, |step| {
            ending = ending_of(step, self.phi_0);
            ending != Ending::Ok
        });
        ending
    }

    /// Passes every step to `visit` until `visit` returns true or the ballast runs away.
    fn follow(&self, target: f64, t_end: f64, mut visit: impl FnMut(&Dense<8>) -> bool) {
        let model = Coupled::new(self.vehicle);
        let rate = |t: f64, x: &CoupledState<f64>| model.rate(x, self.voltage(target, t, x), self.ballast_voltage(x));
        let start = [0.0, self.phi_0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0];
        let kinks = [self.waveform.duration(self.ramp_time)];
        // The steps become too small only in a runaway, which `visit` has detected in the last step.
        let _ = follow(rate, start, t_end, &kinks, |step| {
            let runaway = step.at(step.end())[GAMMA_RATE].abs() > RUNAWAY_RATE;
            if visit(step) || runaway {
                ControlFlow::Break(())
            } else {
                ControlFlow::Continue(())
            }
        });
    }

    /// The smallest final voltage (or speed, with a speed loop) above the hold voltage whose response whirls or
    /// tumbles within [`CRITICAL_SPAN`], to 1e-8: by a scan upwards, then bisection. `None` if no final value
    /// up to 1000 above the hold voltage fails. [`Direction::Reverse`] searches below it instead.
    ///
    /// # Errors
    /// [`TooStiff`] when the responses are too stiff to be followed to their ends.
    pub fn critical(&self, direction: Direction) -> Result<Option<CriticalStep>, TooStiff> {
        const BATCH: usize = 64;
        let hold = if self.law.is_some() {
            0.0
        } else {
            self.vehicle.hold_voltage()
        };
        let way = direction.sign();
        let ending = |distance: f64| self.counted_ending(hold + way * distance);
        let mut distance: f64 = 0.0;
        let mut steps_left = CRITICAL_STEPS_MAX;
        let mut bracket = None;
        while bracket.is_none() && distance < 1000.0 {
            let mut edges = vec![distance];
            for _ in 0..BATCH {
                distance += (0.004 * distance).max(0.01);
                edges.push(distance);
            }
            let endings: Vec<(Ending, u64)> = edges.par_iter().map(|d| ending(*d)).collect::<Result<_, _>>()?;
            bracket = endings
                .iter()
                .position(|(ending, _)| *ending != Ending::Ok)
                .map(|k| (edges[k.saturating_sub(1)], edges[k], endings[k].0));
            let steps = endings.iter().map(|(_, steps)| steps).sum();
            steps_left = steps_left.checked_sub(steps).ok_or(TooStiff)?;
        }
        let Some((mut good, mut bad, mut outcome)) = bracket else {
            return Ok(None);
        };
        while bad - good > 2e-9 {
            let middle = 0.5 * (good + bad);
            match ending(middle)?.0 {
                Ending::Ok => good = middle,
                failed => (bad, outcome) = (middle, failed),
            }
        }
        Ok(Some(CriticalStep {
            critical: hold + way * bad,
            outcome,
        }))
    }

    /// How the drive to the final `target` ends within [`CRITICAL_SPAN`], and the integration steps that it took.
    fn counted_ending(&self, target: f64) -> Result<(Ending, u64), TooStiff> {
        let (mut ending, mut steps) = (Ending::Ok, 0);
        self.follow(target, CRITICAL_SPAN, |step| {
            ending = ending_of(step, self.phi_0);
            steps += 1;
            ending != Ending::Ok || steps > RUN_STEPS_MAX
        });
        if ending == Ending::Ok && steps > RUN_STEPS_MAX {
            return Err(TooStiff);
        }
        Ok((ending, steps))
    }
}

/// Largest number of integration steps of one run of the search for the limit: twenty times the 2,407 that the
/// thesis's vehicle needs at most.
const RUN_STEPS_MAX: u64 = 50_000;
/// Largest number of integration steps of all runs of a scan; the thesis's vehicle needs at most 433,623.
const CRITICAL_STEPS_MAX: u64 = 5_000_000;

/// The responses are too stiff to be followed to their ends.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error(
    "the search ended without a critical value: a run of {CRITICAL_SPAN} time units needs more than {RUN_STEPS_MAX} integration steps, or all runs more than {CRITICAL_STEPS_MAX}"
)]
pub struct TooStiff;

/// The body that has turned fully by the end of a step, if any.
fn ending_of(step: &Dense<8>, phi_0: f64) -> Ending {
    let x = step.at(step.end());
    if (x[PHI] - phi_0).abs() >= TAU {
        Ending::Whirl
    } else if x[GAMMA].abs() >= TAU {
        Ending::Tumble
    } else {
        Ending::Ok
    }
}

#[cfg(test)]
#[path = "coupled_tests.rs"]
mod tests;
