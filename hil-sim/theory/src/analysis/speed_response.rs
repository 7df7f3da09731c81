//! Overshoot, rise time and settling time of a speed step, from a sampled run.

use super::simulate::PlanarRun;

/// Measures of a speed step from rest.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SpeedResponse {
    /// Largest theta' beyond the final value, over the final value.
    pub overshoot: f64,
    /// Time at which theta' first reaches 90 % of the final value.
    pub rise_time: f64,
    /// Time after which theta' stays within 2 % of the final value.
    pub settling_time: f64,
}

/// Measures the run against the final speed `target` (> 0), to the resolution of its samples; `None` if
/// the speed never reaches 90 % of `target`.
pub fn speed_response(run: &PlanarRun, target: f64) -> Option<SpeedResponse> {
    let highest = run.theta_rate.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let rise = run.theta_rate.iter().position(|v| *v >= 0.9 * target)?;
    let outside = run.theta_rate.iter().rposition(|v| (v - target).abs() > 0.02 * target);
    let after = outside.map_or(0, |k| (k + 1).min(run.t.len() - 1));
    Some(SpeedResponse {
        overshoot: highest / target - 1.0,
        rise_time: run.t[rise],
        settling_time: run.t[after],
    })
}
