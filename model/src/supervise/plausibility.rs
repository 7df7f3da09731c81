//! Checks whether a sensor's readings can be true.

use crate::board::ImuScales;
use crate::persistence::Persistence;
use crate::sample::{ImuRaw, ImuSample};

/// Weighs bad ticks against good ticks: trips on a sensor that is bad most of the time, though not always.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Suspicion {
    level: u16,
    limit: u16,
    weight: u16,
}

/// Weight of a bad tick relative to a good tick.
const BAD_WEIGHT: u16 = 3;

impl Suspicion {
    /// Trips after `ticks` bad ticks in a row, later if good ticks are among them, and never while good ticks are
    /// three times as many as bad ticks.
    pub const fn new(ticks: u16) -> Self {
        Self::weighing(ticks, BAD_WEIGHT)
    }

    /// The same, but never trips while good ticks are as many as bad ticks.
    pub const fn even(ticks: u16) -> Self {
        Self::weighing(ticks, 1)
    }

    const fn weighing(ticks: u16, weight: u16) -> Self {
        Self {
            level: 0,
            limit: ticks.saturating_mul(weight),
            weight,
        }
    }

    /// Updates the balance with one tick's verdict. Returns true while the suspicion persists.
    #[inline]
    pub fn update(&mut self, bad: bool) -> bool {
        // The usual case: there is nothing to weigh.
        if !bad && self.level == 0 {
            return false;
        }
        self.level = if bad {
            self.level.saturating_add(self.weight).min(self.limit)
        } else {
            self.level.saturating_sub(1)
        };
        self.level >= self.limit
    }

    /// Whether bad ticks outweigh the good ticks so far.
    pub fn is_raised(&self) -> bool {
        self.level > 0
    }
}

/// The verdict on an IMU.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ImuHealth {
    /// Fresh and believable.
    Good,
    /// Too old.
    Stale,
    /// The IMU repeats a reading, saturates, jumps, or shows an impossible force.
    Implausible,
}

/// Watches one IMU.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ImuWatch {
    timeout_us: u32,
    /// Largest change of an axis that is no jump, in LSB, and twice that value.
    jump_lsb: i32,
    jumps_lsb: u32,
    /// Bounds of the squared specific force, in LSB^2.
    force_min_lsb2: u32,
    force_max_lsb2: u32,
    last: Option<ImuRaw>,
    repeated: Persistence,
    saturated: Persistence,
    forceless: Persistence,
    impossible: Suspicion,
}

/// Identical readings in a row that a working IMU never gives: the noise of six axes does not repeat that long.
pub const REPEATED_TICKS: u16 = 20;
const SATURATED_TICKS: u16 = 10;
const IMPOSSIBLE_TICKS: u16 = 40;
/// Consecutive ticks without force after which an IMU is implausible: a fall of 0.44 m. A vehicle that drives over
/// a ledge of 40 mm falls for 90 ms, and again after each rebound.
const FORCELESS_TICKS: u16 = 300;
/// Change of an angular rate within one tick that is impossible for a body with mass.
const JUMP_DEG_S: f32 = 200.0;
/// Bounds of the specific force's magnitude in g. Below them the vehicle falls; above them a blow cannot last
/// long.
const FORCE_MIN_G: f32 = 0.2;
const FORCE_MAX_G: f32 = 6.0;
/// Least sum of the squares of three axes if one axis is at an end of its range.
const END_SQUARED: u32 = (i16::MAX as u32) * (i16::MAX as u32);

impl ImuWatch {
    /// A watch for an IMU with the given scales. A sample is stale after `timeout_us`.
    pub fn new(timeout_us: u32, scales: &ImuScales) -> Self {
        let squared_lsb = |g: f32| g * g * scales.accel_lsb_per_g * scales.accel_lsb_per_g;
        let jump_lsb = (JUMP_DEG_S * scales.gyro_lsb_per_deg_s) as i32;
        Self {
            timeout_us,
            jump_lsb,
            jumps_lsb: 2 * jump_lsb.unsigned_abs(),
            force_min_lsb2: libm::ceilf(squared_lsb(FORCE_MIN_G)) as u32,
            force_max_lsb2: squared_lsb(FORCE_MAX_G) as u32,
            last: None,
            repeated: Persistence::new(REPEATED_TICKS),
            saturated: Persistence::new(SATURATED_TICKS),
            forceless: Persistence::new(FORCELESS_TICKS),
            impossible: Suspicion::new(IMPOSSIBLE_TICKS),
        }
    }

    /// Checks one tick's sample.
    // Inlined on the host, like the supervisor's other watches.
    #[allow(clippy::inline_always)]
    #[cfg_attr(target_os = "none", inline)]
    #[cfg_attr(not(target_os = "none"), inline(always))]
    pub fn update(&mut self, sample: &ImuSample) -> ImuHealth {
        let raw = &sample.raw;
        let (jumped, same) = self.last.map_or((false, false), |last| {
            // One comparison of the magnitude covers both signs.
            let jump = |(now, before): (&i16, &i16)| {
                (i32::from(*now) - i32::from(*before) + self.jump_lsb).cast_unsigned() > self.jumps_lsb
            };
            let same = last.gyro == raw.gyro && last.accel == raw.accel;
            (raw.gyro.iter().zip(&last.gyro).any(jump), same)
        });
        self.last = Some(*raw);
        let repeated = self.repeated.update(same);
        // At most three times 2^30.
        let squares = |axes: &[i16; 3]| {
            let square = |a: i16| (i32::from(a) * i32::from(a)).cast_unsigned();
            let [x, y, z] = *axes;
            square(x) + square(y) + square(z)
        };
        let at_end = |axes: &[i16; 3], squares: u32| {
            squares >= END_SQUARED && axes.iter().any(|value| matches!(*value, i16::MIN | i16::MAX))
        };
        let turning = squares(&raw.gyro);
        let squares = squares(&raw.accel);
        let saturated = self
            .saturated
            .update(at_end(&raw.accel, squares) || at_end(&raw.gyro, turning));
        let forceless = self.forceless.update(squares < self.force_min_lsb2);
        let impossible = self.impossible.update(squares > self.force_max_lsb2 || jumped);
        if sample.age_us > self.timeout_us {
            ImuHealth::Stale
        } else if repeated || saturated || forceless || impossible {
            ImuHealth::Implausible
        } else {
            ImuHealth::Good
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::board::BoardScales;

    fn noisy(k: i16) -> ImuSample {
        ImuSample {
            raw: ImuRaw {
                accel: [k % 7, 3, 4000 + k % 5],
                gyro: [k % 3, 0, 1],
                temperature: 0,
            },
            age_us: 100,
        }
    }

    #[test]
    fn a_living_imu_is_good_and_an_old_sample_stale() {
        let mut watch = ImuWatch::new(5000, &BoardScales::EXAMPLE.imu);
        for k in 0..1000 {
            assert_eq!(watch.update(&noisy(k)), ImuHealth::Good);
        }
        assert_eq!(
            watch.update(&ImuSample {
                age_us: 5001,
                ..noisy(1)
            }),
            ImuHealth::Stale
        );
        assert_eq!(
            watch.update(&ImuSample {
                age_us: 5000,
                ..noisy(2)
            }),
            ImuHealth::Good
        );
    }

    #[test]
    fn a_stuck_saturated_or_forceless_imu_is_implausible_in_time_and_not_at_once() {
        for (make, ticks) in [
            ((|_| noisy(1)) as fn(i16) -> ImuSample, REPEATED_TICKS + 1),
            (
                |k| ImuSample {
                    raw: ImuRaw {
                        gyro: [k % 3, i16::MAX, 0],
                        ..noisy(k).raw
                    },
                    age_us: 0,
                },
                SATURATED_TICKS,
            ),
            (
                |k| ImuSample {
                    raw: ImuRaw {
                        accel: [k % 7, 0, 0],
                        ..noisy(k).raw
                    },
                    age_us: 0,
                },
                FORCELESS_TICKS,
            ),
        ] {
            let mut watch = ImuWatch::new(5000, &BoardScales::EXAMPLE.imu);
            for k in 1..i16::try_from(ticks).expect("small") {
                assert_eq!(watch.update(&make(k)), ImuHealth::Good, "tick {k} of {ticks}");
            }
            assert_eq!(watch.update(&make(ticks.cast_signed())), ImuHealth::Implausible);
        }
    }

    #[test]
    fn a_force_or_a_jump_that_no_body_makes_is_implausible_once_it_lasts() {
        let scales = BoardScales::EXAMPLE.imu;
        let accel = |g: f32| (g * scales.accel_lsb_per_g) as i16;
        let gyro = |deg_s: f32| (deg_s * scales.gyro_lsb_per_deg_s) as i16;
        // Along each axis: a force that the watch believes, and a force that it does not.
        for axis in 0..3 {
            for (force_g, to_and_fro_deg_s, believed) in [
                (5.5, 0.0, true),
                (-6.5, 0.0, false),
                (1.0, 95.0, true),
                (1.0, 105.0, false),
            ] {
                let mut watch = ImuWatch::new(5000, &scales);
                let mut sample = noisy(0);
                let mut found = None;
                for k in 0..80_i16 {
                    sample.raw.accel = [k % 3, 0, 0];
                    sample.raw.accel[axis] = accel(force_g) + k % 2;
                    sample.raw.gyro = [k % 3, 0, 1];
                    sample.raw.gyro[axis] = gyro(if k % 2 == 0 {
                        to_and_fro_deg_s
                    } else {
                        -to_and_fro_deg_s
                    });
                    if watch.update(&sample) != ImuHealth::Good {
                        found = found.or(Some(k));
                    }
                }
                assert!(
                    found.map_or(believed, |k| !believed && (10..=41).contains(&k)),
                    "axis {axis}, {force_g} g, {to_and_fro_deg_s} deg/s: {found:?}"
                );
            }
        }
    }
}
