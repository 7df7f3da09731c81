//! Performance envelopes: the critical voltage over the slope for each waveform (chapter 5).

use model::dynamics::planar::PlanarParameters;
use rayon::prelude::*;
use serde::Serialize;

use super::critical::{Direction, NoLimit, critical};
use super::equilibrium::static_phi;
use super::input::Input;
use super::waveform::Waveform;

/// One point of an envelope.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct EnvelopePoint {
    /// Slope, rad.
    pub beta: f64,
    /// Waveform.
    pub waveform: Waveform,
    /// The critical forward voltage from the static equilibrium; `None` if none whirls.
    pub critical: Option<f64>,
    /// The way the arm turns: +1 forward, -1 backward.
    pub whirl_direction: Option<i8>,
}

/// `count` slopes from `first` to `last`.
pub fn slopes(first: f64, last: f64, count: usize) -> Vec<f64> {
    let gaps = count.saturating_sub(1).max(1) as f64;
    (0..count)
        .map(|k| {
            if k + 1 == count && count > 1 {
                last
            } else {
                first + (last - first) * k as f64 / gaps
            }
        })
        .collect()
}

/// The envelope of each waveform over `slopes` for the vehicle `p` (its own slope is ignored), on all
/// cores; `done` is called after each point.
///
/// # Errors
/// [`NoLimit`] if a slope has no equilibrium.
pub fn envelope(
    p: &PlanarParameters<f64>,
    waveforms: &[Waveform],
    ramp_time: f64,
    slopes: &[f64],
    done: impl Fn() + Sync,
) -> Result<Vec<EnvelopePoint>, NoLimit> {
    let cases: Vec<(Waveform, f64)> = waveforms.iter().flat_map(|w| slopes.iter().map(|b| (*w, *b))).collect();
    cases
        .into_par_iter()
        .map(|(waveform, beta)| {
            let p = PlanarParameters { beta, ..*p };
            let phi = static_phi(&p).ok_or(NoLimit::NoEquilibrium)?;
            let input = Input::voltage_step(&p, 0.0).shaped(waveform, ramp_time);
            let found = critical(&p, &input, [phi, 0.0, 0.0], Direction::Forward)?;
            done();
            let (critical, whirl_direction) = (found.map(|c| c.value), found.map(|c| c.whirl_direction));
            Ok(EnvelopePoint {
                beta,
                waveform,
                critical,
                whirl_direction,
            })
        })
        .collect()
}
