//! The settling of a step of the speed, for any law.

use serde::Serialize;

/// The speed at an instant. Time and speed are in the units of the caller.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SpeedSample {
    /// Time.
    pub time: f64,
    /// Speed.
    pub speed: f64,
}

/// The settling of a step from one speed to another. Shares are relative to the step.
/// Speeds are in the units of the samples.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Settling {
    /// Time from the step until the speed stays within 2 % of the step; `None` if it does not.
    pub time: Option<f64>,
    /// Largest speed beyond the target.
    pub overshoot: f64,
    /// Largest speed in the opposite direction.
    pub undershoot: f64,
}

/// Share of the step within which a speed counts as settled.
pub const BAND: f64 = 0.02;

impl Settling {
    /// Computes the settling from samples in order of time that begin with the step, from the speed `from` to
    /// the speed `to`.
    ///
    /// ```
    /// use theory::analysis::settling::{Settling, SpeedSample};
    /// let speeds = [0.0, -0.1, 0.5, 1.05, 1.01, 1.0];
    /// let samples = speeds.iter().enumerate().map(|(k, &speed)| SpeedSample { time: 3.0 + k as f64, speed });
    /// let found = Settling::of(samples, 0.0, 1.0);
    /// assert_eq!(found.time, Some(4.0));
    /// assert!((found.overshoot - 0.05).abs() < 1e-12 && (found.undershoot - 0.1).abs() < 1e-12);
    /// ```
    pub fn of(samples: impl Iterator<Item = SpeedSample>, from: f64, to: f64) -> Self {
        let (mut start, mut since) = (None, None);
        let (mut overshoot, mut undershoot) = (0.0_f64, 0.0_f64);
        for SpeedSample { time, speed } in samples {
            let start = *start.get_or_insert(time);
            let share = (speed - from) / (to - from);
            overshoot = overshoot.max(share - 1.0);
            undershoot = undershoot.max(-share);
            if (share - 1.0).abs() > BAND || share.is_nan() {
                since = None;
            } else {
                since = since.or(Some(time - start));
            }
        }
        Self {
            time: since,
            overshoot,
            undershoot,
        }
    }
}
