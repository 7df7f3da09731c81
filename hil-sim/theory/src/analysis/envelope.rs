//! Performance envelopes: the critical voltage over the slope for each waveform (chapter 5).

use std::sync::atomic::{AtomicU64, Ordering};

use model::dynamics::planar::PlanarParameters;
use rayon::prelude::*;
use serde::Serialize;

use super::critical::{Direction, NoCriticalValue, critical_within};
use super::equilibrium::static_phi;
use super::input::Input;
use super::step_budget::StepBudget;
use super::waveform::Waveform;

/// One point of an envelope.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct EnvelopePoint {
    /// Slope, rad.
    pub beta: f64,
    /// Waveform.
    pub waveform: Waveform,
    /// The critical forward voltage from the static equilibrium; `None` if no voltage makes the arm whirl.
    pub critical: Option<f64>,
    /// Direction in which the arm turns: +1 forward, -1 backward.
    pub whirl_direction: Option<i8>,
}

/// Largest numbers of integration steps of an envelope.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct EnvelopeBudget {
    /// Largest number for one point.
    pub point: u64,
    /// Largest number for all points together.
    pub all: u64,
}

impl Default for EnvelopeBudget {
    /// Of the eleven waveforms from -0.4 to 0.7 rad a point needs 4,500 steps on average, 50,000 for a move over 100 time
    /// units, and the 451 points of the default two million. An envelope ends within some ten seconds, whatever the
    /// parameters.
    fn default() -> Self {
        Self {
            point: 1_000_000,
            all: 10_000_000,
        }
    }
}

/// Why there is no envelope.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum NoEnvelope {
    /// The search for a limit fails at one of its points.
    #[error(transparent)]
    NoCriticalValue(#[from] NoCriticalValue),
    /// Its points take too many integration steps together.
    #[error("its {points} points need more than {steps} integration steps together: ask for fewer slopes or waveforms")]
    TooLong {
        /// The allowed number of integration steps.
        steps: u64,
        /// Slopes times waveforms.
        points: usize,
    },
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
/// cores, within `work`; `done` is called after each point.
///
/// # Errors
/// [`NoEnvelope`] if a slope has no equilibrium, or if the points take too long.
pub fn envelope(
    work: EnvelopeBudget,
    p: &PlanarParameters<f64>,
    waveforms: &[Waveform],
    ramp_time: f64,
    slopes: &[f64],
    done: impl Fn() + Sync,
) -> Result<Vec<EnvelopePoint>, NoEnvelope> {
    let cases: Vec<(Waveform, f64)> = waveforms.iter().flat_map(|w| slopes.iter().map(|b| (*w, *b))).collect();
    let too_long = NoEnvelope::TooLong {
        steps: work.all,
        points: cases.len(),
    };
    let spent = AtomicU64::new(0);
    let points = cases
        .into_par_iter()
        .map(|(waveform, beta)| {
            if spent.load(Ordering::Relaxed) > work.all {
                return Err(too_long);
            }
            let p = PlanarParameters { beta, ..*p };
            let phi = static_phi(&p).ok_or(NoCriticalValue::NoEquilibrium)?;
            let input = Input::voltage_step(&p, 0.0).shaped(waveform, ramp_time);
            let budget = StepBudget::of(work.point);
            let found = critical_within(&budget, &p, &input, [phi, 0.0, 0.0], Direction::Forward)?;
            spent.fetch_add(budget.spent(), Ordering::Relaxed);
            done();
            let (critical, whirl_direction) = (found.map(|c| c.value), found.map(|c| c.whirl_direction));
            Ok(EnvelopePoint {
                beta,
                waveform,
                critical,
                whirl_direction,
            })
        })
        .collect::<Result<Vec<EnvelopePoint>, NoEnvelope>>()?;
    // The sum decides whether there is an envelope, so the result does not depend on the order in which the cores finish.
    if spent.into_inner() > work.all {
        return Err(too_long);
    }
    Ok(points)
}
