//! The calibration of gyros at rest.

use crate::sample::{ImuSample, TICK_US};

/// Largest gyro bias that a calibration may find; more is motion.
const BIAS_MAX_RAD_S: f32 = 0.1;
/// Ticks over which a calibration averages the gyros.
const CALIBRATION_TICKS: u16 = 500;

/// Whether the IMU gave this reading since the last tick: what it gave before was averaged before, and before its first
/// sample it has given nothing.
pub(super) fn is_new(imu: &ImuSample) -> bool {
    imu.age_us < 2 * TICK_US
}

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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_averages_readings_of_a_vehicle_at_rest_only() {
        let mut calibration = Calibration::<1>::default();
        let run = |calibration: &mut Calibration<1>, rate, still, ticks| {
            (0..ticks).filter_map(|_| calibration.update([rate], still)).last()
        };
        for (rate, still) in [(0.01, false), (0.11, true), (-0.11, true)] {
            run(&mut calibration, 0.01, true, 499);
            assert_eq!(run(&mut calibration, rate, still, 1), None);
            assert!(!calibration.is_done() && calibration.tolerance() == BIAS_MAX_RAD_S);
        }
        assert_eq!(run(&mut calibration, 0.02, true, 499), None);
        let [average] = run(&mut calibration, 0.02, true, 1).expect("done");
        assert!((average - 0.02).abs() < 1e-6, "{average}");
        assert!(calibration.is_done() && calibration.tolerance() == 0.0);
        assert_eq!(run(&mut calibration, 0.02, true, 1000), None, "once");
    }

    #[test]
    fn a_reading_is_new_for_a_tick() {
        for (age_us, new) in [(0, true), (1400, true), (2000, false), (u32::MAX, false)] {
            let imu = ImuSample {
                age_us,
                ..ImuSample::default()
            };
            assert_eq!(is_new(&imu), new, "{age_us} us");
        }
    }
}
