//! The vehicle in space (ch. 6, corrected): runs with their energy and constraint balance.

use std::ops::ControlFlow;

use model::dynamics::spatial::{
    PHI, PHI_RATE, PSI, RATE_L, RATE_R, Spatial, SpatialParameters, SpatialState, THETA_L, THETA_R, X, Y,
};
use serde::Serialize;

use super::dop853::StepTooSmall;
use super::trajectory::{Trajectory, follow};

/// A run in space.
#[derive(Debug, Clone, Serialize)]
pub struct SpatialRun {
    /// Sample times.
    pub t: Vec<f64>,
    /// Axle centre along the plane's first axis, over R.
    pub x: Vec<f64>,
    /// Axle centre along the plane's second axis, over R.
    pub y: Vec<f64>,
    /// Heading, rad.
    pub psi: Vec<f64>,
    /// Right wheel, rad.
    pub theta_r: Vec<f64>,
    /// Left wheel, rad.
    pub theta_l: Vec<f64>,
    /// Arm from the plane's normal, rad.
    pub phi: Vec<f64>,
    /// theta_r'.
    pub rate_r: Vec<f64>,
    /// theta_l'.
    pub rate_l: Vec<f64>,
    /// phi'.
    pub phi_rate: Vec<f64>,
    /// Energy less the energy at the start less the work of motors and damping, over mt g R.
    pub energy_residual: Vec<f64>,
    /// The largest violation of the rolling constraints (6.12) and (6.15): of the heading against the wheel
    /// angles, and of velocity and yaw rate, integrated from the accelerations, against the wheel rates.
    pub constraint_residual: Vec<f64>,
}

/// Length of the integrated vector: the nine states, the work of the torques, and x', y' and psi' from the
/// accelerations.
const AUGMENTED: usize = 13;

/// Runs the vehicle `parameters` from `state` under constant voltages `u` (right, left) to `t_end`,
/// sampled every `dt`.
///
/// # Errors
/// [`StepTooSmall`] where the solution cannot be followed.
pub fn run(
    parameters: &SpatialParameters<f64>,
    u: [f64; 2],
    state: &SpatialState<f64>,
    t_end: f64,
    dt: f64,
) -> Result<SpatialRun, StepTooSmall> {
    let model = Spatial::new(*parameters);
    let mut start = [0.0; AUGMENTED];
    start[..9].copy_from_slice(state);
    let [x_rate, y_rate, psi_rate, ..] = model.rate(state, u);
    start[10..].copy_from_slice(&[x_rate, y_rate, psi_rate]);
    let mut samples = Trajectory::default();
    follow(
        |_, x| augmented_rate(&model, u, x),
        start,
        t_end,
        &[],
        |step| {
            samples.sample(step, dt, t_end);
            ControlFlow::Continue(())
        },
    )?;
    let energy = model.energy(state);
    let column = |i| samples.component(i);
    Ok(SpatialRun {
        x: column(X),
        y: column(Y),
        psi: column(PSI),
        theta_r: column(THETA_R),
        theta_l: column(THETA_L),
        phi: column(PHI),
        rate_r: column(RATE_R),
        rate_l: column(RATE_L),
        phi_rate: column(PHI_RATE),
        energy_residual: samples
            .x
            .iter()
            .map(|x| model.energy(&vehicle(x)) - energy - x[9])
            .collect(),
        constraint_residual: samples
            .x
            .iter()
            .map(|x| constraint_residual(&model, state, x))
            .collect(),
        t: samples.t,
    })
}

fn vehicle(x: &[f64; AUGMENTED]) -> SpatialState<f64> {
    std::array::from_fn(|i| x[i])
}

fn augmented_rate(model: &Spatial<f64>, u: [f64; 2], x: &[f64; AUGMENTED]) -> [f64; AUGMENTED] {
    let state = vehicle(x);
    let rate = model.rate(&state, u);
    let tau = model.torques(&state, u);
    let power = tau[0] * (state[RATE_R] + state[PHI_RATE]) + tau[1] * (state[RATE_L] + state[PHI_RATE]);
    let [v, psi_rate] = model.forward_and_yaw_rate(&state);
    let v_rate = 0.5 * (rate[RATE_R] + rate[RATE_L]);
    let yaw_acceleration = 0.5 * (rate[RATE_R] - rate[RATE_L]) / model.parameters().s;
    let (sin, cos) = state[PSI].sin_cos();
    let mut next = [0.0; AUGMENTED];
    next[..9].copy_from_slice(&rate);
    next[9..].copy_from_slice(&[
        power,
        v_rate * cos - v * psi_rate * sin,
        v_rate * sin + v * psi_rate * cos,
        yaw_acceleration,
    ]);
    next
}

fn constraint_residual(model: &Spatial<f64>, start: &SpatialState<f64>, x: &[f64; AUGMENTED]) -> f64 {
    let state = vehicle(x);
    let [v, psi_rate] = model.forward_and_yaw_rate(&state);
    let (sin, cos) = state[PSI].sin_cos();
    let turned = |i: usize| state[i] - start[i];
    let heading = turned(PSI) - 0.5 * (turned(THETA_R) - turned(THETA_L)) / model.parameters().s;
    [heading, x[10] - v * cos, x[11] - v * sin, x[12] - psi_rate]
        .iter()
        .fold(0.0, |m, r| m.max(r.abs()))
}

#[cfg(test)]
#[path = "spatial_tests.rs"]
mod tests;
