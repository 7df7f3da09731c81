//! The spar of ch. 7 alone: its responses to a tilt and to a shaken axle, and the largest tilt from which
//! it recovers.

use std::f64::consts::TAU;
use std::ops::ControlFlow;

use model::control::spar_law::SparLaw;
use model::dynamics::camera::{Camera, CameraParameters, CameraState, PHI, PHI_RATE, THETA, THETA_RATE};
use serde::Serialize;

use super::trajectory::{Extent, Trajectory, follow};

/// Angle below which the spar counts as level again, in deg.
const LEVEL_DEG: f64 = 5.0;
/// Rate of the ballast beyond which a run ends; by then the ballast has tumbled.
pub(super) const RUNAWAY_RATE: f64 = 1e5;

/// One experiment with the spar.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Experiment {
    /// The spar's parameters.
    pub camera: CameraParameters<f64>,
    /// The regulator's gains; without gains the motor stays at v = 0.
    pub gains: Option<[f64; 4]>,
    /// The available voltage in either direction; infinite if not limited.
    pub v_max: f64,
    /// Initial angle of the resting spar, in rad.
    pub tilt0: f64,
    /// Acceleration of the axle: `x'' = ax cos t`, `y'' = ay sin t`, in g.
    pub shake: [f64; 2],
}

/// The sampled motion of an experiment, and whether the spar recovered.
#[derive(Debug, Clone, Serialize)]
pub struct CameraRun {
    /// Sample times.
    pub t: Vec<f64>,
    /// Spar from the vertical, rad.
    pub theta: Vec<f64>,
    /// Ballast relative to the spar, rad.
    pub phi: Vec<f64>,
    /// theta'.
    pub theta_rate: Vec<f64>,
    /// phi'.
    pub phi_rate: Vec<f64>,
    /// Motor voltage.
    pub v: Vec<f64>,
    /// Half the peak-to-peak value of theta in the last third of the span, deg; `None` if the run ended
    /// earlier.
    pub theta_amplitude_deg: Option<f64>,
    /// Whether the spar stayed within 5 deg throughout the last tenth of the span and the ballast never
    /// tumbled. A run with a runaway ballast ends early.
    pub recovered: bool,
}

impl Experiment {
    /// The spar `camera` with `gains`, level, on an axle at rest, with an unlimited motor.
    pub fn new(camera: CameraParameters<f64>, gains: Option<[f64; 4]>) -> Self {
        Self {
            camera,
            gains,
            v_max: f64::INFINITY,
            tilt0: 0.0,
            shake: [0.0; 2],
        }
    }

    /// The motor voltage in the state `x`.
    pub fn voltage(&self, x: &CameraState<f64>) -> f64 {
        let law = |gains| SparLaw { gains }.voltage(x[THETA], x[PHI], x[THETA_RATE], x[PHI_RATE]);
        self.gains.map_or(0.0, law).clamp(-self.v_max, self.v_max)
    }

    /// Runs the experiment to `t_end` and samples it every `dt`.
    pub fn run(&self, t_end: f64, dt: f64) -> CameraRun {
        let mut samples = Trajectory::default();
        let (mut last_third, mut last_tenth, mut ballast) = (Extent::EMPTY, Extent::EMPTY, Extent::EMPTY);
        let reached = self.follow(t_end, |step| {
            samples.sample(step, dt, t_end);
            last_third.see(step, t_end * (2.0 / 3.0), THETA);
            last_tenth.see(step, 0.9 * t_end, THETA);
            ballast.see(step, 0.0, PHI);
        });
        CameraRun {
            theta: samples.component(THETA),
            phi: samples.component(PHI),
            theta_rate: samples.component(THETA_RATE),
            phi_rate: samples.component(PHI_RATE),
            v: samples.x.iter().map(|x| self.voltage(x)).collect(),
            t: samples.t,
            theta_amplitude_deg: reached.then(|| last_third.half_width().to_degrees()),
            recovered: reached && last_tenth.largest() < LEVEL_DEG.to_radians() && ballast.largest() < TAU,
        }
    }

    /// Whether the spar recovers within `t_end`: [`CameraRun::recovered`] without the samples.
    pub fn recovers(&self, t_end: f64) -> bool {
        let mut last_tenth = Extent::EMPTY;
        let mut over = false;
        let mut watch = |step: &super::dop853::Dense<4>| {
            last_tenth.see(step, 0.9 * t_end, THETA);
            over |= step.at(step.end())[PHI].abs() >= TAU;
            over
        };
        self.follow_until(t_end, &mut watch) && !over && last_tenth.largest() < LEVEL_DEG.to_radians()
    }

    fn follow(&self, t_end: f64, mut visit: impl FnMut(&super::dop853::Dense<4>)) -> bool {
        self.follow_until(t_end, &mut |step| {
            visit(step);
            false
        })
    }

    /// Passes every step to `visit` until `visit` returns true or the ballast runs away. Returns whether
    /// the run reached `t_end`.
    fn follow_until(&self, t_end: f64, visit: &mut dyn FnMut(&super::dop853::Dense<4>) -> bool) -> bool {
        let model = Camera::new(self.camera);
        let [ax, ay] = self.shake;
        let rate = |t: f64, x: &CameraState<f64>| model.rate(x, self.voltage(x), [ax * t.cos(), ay * t.sin()]);
        let mut reached = 0.0;
        let start = [self.tilt0, 0.0, 0.0, 0.0];
        let result = follow(rate, start, t_end, &[], |step| {
            reached = step.end();
            let stop = visit(step) || step.at(step.end())[PHI_RATE].abs() > RUNAWAY_RATE;
            if stop {
                ControlFlow::Break(())
            } else {
                ControlFlow::Continue(())
            }
        });
        result.is_ok() && reached >= t_end
    }

    /// The smallest tilt (deg) from which the spar does not recover within `t_end`, by a scan up to 180 deg
    /// in steps of `step_deg`, then bisection; `None` if the spar recovers from every tilt.
    pub fn recovery_limit_deg(&self, t_end: f64, step_deg: f64) -> Option<f64> {
        let recovers = |deg: f64| {
            Self {
                tilt0: deg.to_radians(),
                ..*self
            }
            .recovers(t_end)
        };
        let count = (180.0 / step_deg).ceil() as usize;
        let failing = (1..=count).map(|k| k as f64 * step_deg).find(|deg| !recovers(*deg))?;
        let (mut good, mut bad) = (failing - step_deg, failing);
        while bad - good > 1e-9 {
            let middle = 0.5 * (good + bad);
            if recovers(middle) { good = middle } else { bad = middle }
        }
        Some(bad)
    }
}

#[cfg(test)]
#[path = "camera_tests.rs"]
mod tests;
