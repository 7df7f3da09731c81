//! The calibration of gyros at rest.

/// Largest gyro bias that a calibration may find; more is motion.
const BIAS_MAX_RAD_S: f32 = 0.1;
/// Ticks over which a calibration averages the gyros.
const CALIBRATION_TICKS: u16 = 500;

/// Average of gyro axes at rest.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Calibration<const N: usize> {
    sums: [f32; N],
    ticks: u16,
    done: bool,
}

impl<const N: usize> Default for Calibration<N> {
    fn default() -> Self {
        Self {
            sums: [0.0; N],
            ticks: 0,
            done: false,
        }
    }
}

impl<const N: usize> Calibration<N> {
    /// Whether the averages have been returned.
    pub(super) fn is_done(&self) -> bool {
        self.done
    }

    /// Arm rate that still counts as rest: before the bias is known, all of it may be bias.
    pub(super) fn tolerance(&self) -> f32 {
        if self.done { 0.0 } else { BIAS_MAX_RAD_S }
    }

    /// Takes the gyros of one tick; returns the averages once, when there are enough.
    pub(super) fn update(&mut self, rates: [f32; N], still: bool) -> Option<[f32; N]> {
        if self.done {
            return None;
        }
        let plausible = rates.iter().all(|rate| rate.abs() < BIAS_MAX_RAD_S);
        if !still || !plausible {
            *self = Self::default();
            return None;
        }
        for (sum, rate) in self.sums.iter_mut().zip(rates) {
            *sum += rate;
        }
        self.ticks += 1;
        if self.ticks < CALIBRATION_TICKS {
            return None;
        }
        self.done = true;
        Some(self.sums.map(|sum| sum / f32::from(CALIBRATION_TICKS)))
    }
}
