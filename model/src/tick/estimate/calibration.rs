//! The calibration of gyros at rest.

use crate::sample::{ImuSample, TICK_US};

/// Largest gyro bias that a calibration accepts; a larger rate is motion.
pub(super) const BIAS_MAX_RAD_S: f32 = 0.1;
/// Ticks over which a calibration averages the gyros of a standing vehicle.
const CALIBRATION_TICKS: u16 = 500;
/// Ticks over which a calibration averages the gyros of a rocking vehicle. With its gears stuck, the whole vehicle rolls
/// to and fro for a while, more slowly than counts as motion. A rocking of 0.1 rad/s at 1 Hz leaves 0.01 rad/s in the
/// average.
const ROCKING_TICKS: u16 = 4000;
/// Ticks of a block, and the largest difference between the blocks' averages of a standing vehicle, rad/s: several times
/// the noise of a block of 50 readings.
const BLOCK_TICKS: u16 = 50;
const EVEN_RAD_S: f32 = 0.005;

/// Whether this reading is new since the last tick. An older reading has already entered the average, and before the
/// first sample there is no reading.
pub(super) fn is_new(imu: &ImuSample) -> bool {
    imu.age_us < 2 * TICK_US
}

/// Averages gyro axes at rest.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Calibration<const N: usize> {
    sums: [f32; N],
    ticks: u16,
    /// Sums of the present block and of the first block.
    block: [f32; N],
    first: [f32; N],
    rocks: bool,
    done: bool,
}

impl<const N: usize> Default for Calibration<N> {
    fn default() -> Self {
        Self {
            sums: [0.0; N],
            ticks: 0,
            block: [0.0; N],
            first: [0.0; N],
            rocks: false,
            done: false,
        }
    }
}

impl<const N: usize> Calibration<N> {
    /// Whether the averages have been returned.
    pub(super) fn is_done(&self) -> bool {
        self.done
    }

    /// Updates the average with the gyros of one tick. Returns the averages once, when enough readings exist.
    pub(super) fn update(&mut self, rates: [f32; N], still: bool) -> Option<[f32; N]> {
        if self.done {
            return None;
        }
        let plausible = rates.iter().all(|rate| rate.abs() < BIAS_MAX_RAD_S);
        if !still || !plausible {
            *self = Self::default();
            return None;
        }
        for ((sum, block), rate) in self.sums.iter_mut().zip(&mut self.block).zip(rates) {
            *sum += rate;
            *block += rate;
        }
        self.ticks += 1;
        if self.ticks == BLOCK_TICKS {
            self.first = self.block;
        }
        if self.ticks.is_multiple_of(BLOCK_TICKS) {
            let differ = |(block, first): (&f32, &f32)| (block - first).abs() > EVEN_RAD_S * f32::from(BLOCK_TICKS);
            self.rocks |= self.block.iter().zip(&self.first).any(differ);
            self.block = [0.0; N];
        }
        let ticks = if self.rocks { ROCKING_TICKS } else { CALIBRATION_TICKS };
        if self.ticks < ticks {
            return None;
        }
        self.done = true;
        let ticks = f32::from(self.ticks);
        Some(self.sums.map(|sum| sum / ticks))
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
            assert!(!calibration.is_done());
        }
        assert_eq!(run(&mut calibration, 0.02, true, 499), None);
        let [average] = run(&mut calibration, 0.02, true, 1).expect("done");
        assert!((average - 0.02).abs() < 1e-6, "{average}");
        assert!(calibration.is_done());
        assert_eq!(run(&mut calibration, 0.02, true, 1000), None, "once");
    }

    /// The whole vehicle rocks at 0.5 to 2 Hz, too slowly to count as motion. The average over half a swing would be a wrong bias.
    #[test]
    fn what_rocks_is_averaged_over_many_swings() {
        for hertz in [0.5_f32, 1.0, 2.0] {
            for phase in 0..8_u8 {
                let mut calibration = Calibration::<1>::default();
                let found = (0..5000_u16).find_map(|tick| {
                    let turns = hertz * f32::from(tick) * 0.001 + f32::from(phase) / 8.0;
                    let rate = 0.02 + 0.07 * libm::sinf(2.0 * core::f32::consts::PI * turns);
                    calibration.update([rate], true).map(|[bias]| (tick, bias))
                });
                let (tick, bias) = found.expect("calibrated");
                assert!(tick == ROCKING_TICKS - 1, "{hertz} Hz: after {tick}");
                assert!((bias - 0.02).abs() < 0.01, "{hertz} Hz: {bias}");
            }
        }
        let mut calibration = Calibration::<1>::default();
        let noisy = (0..500_u16).find_map(|tick| calibration.update([0.02 + 0.01 * f32::from(tick % 3)], true));
        assert!(noisy.is_some(), "noise is no rocking");
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
