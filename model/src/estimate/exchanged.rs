//! Detects an IMU whose axes are exchanged: mounted a quarter of a turn about its z axis, the IMU shows its body's swing
//! as a roll.
//!
//! While arm and spar hang still, such an IMU feels gravity in the right direction on any slope, so nothing blocks
//! arming. Its y gyro then shows a body at rest whatever the body does, and a law that trusts the gyro swings the arm, or
//! the ballast, further and further. The x gyro shows the swing. The drive motors swing the arm against the wheels, and
//! the ballast motor swings the spar against the ballast, so the motor's encoder rate correlates with the shown roll. On
//! a slope the wheels roll away meanwhile, but the arm swings so far that a vehicle with that roll would lie on its side.
//!
//! A real roll about the forward axis occurs where one wheel drives over an obstacle, and an arm that leans shows a part
//! of the yaw rate as roll. In both cases no motor turns in the same rhythm while the body does not swing.

use super::facing::{INTERVAL_S, MEAN_GAIN, STEADY_TIME_CONSTANT_S};
use super::rate_filter::LowPass;
use crate::bounded::Bounded;
use crate::persistence::Persistence;

/// The rates of one body in one tick of an armed vehicle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BodyRates {
    /// The encoder's rate, rad/s: of the wheels relative to the arm, or of the ballast relative to the spar.
    pub relative_rad_s: f32,
    /// Swing rate of the body according to the IMU, rad/s.
    pub swing_rad_s: f32,
    /// Rate about the forward axis according to the IMU, rad/s.
    pub roll_rad_s: f32,
    /// Yaw rate, rad/s.
    pub yaw_rad_s: f32,
}

/// Watches for exchanged axes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Exchanged {
    steady: [LowPass; 3],
    /// Mean squares of relative rate, swing and roll, and the mean product of relative rate and roll.
    relative: f32,
    swing: f32,
    roll: f32,
    together: f32,
    /// Whether the vehicle turned in the previous interval.
    turned: bool,
    in_rhythm: Persistence,
    rolled: Persistence,
}

/// Least mean square of the roll, (rad/s)^2, that can be the body's swing: that of 0.15 rad/s, which moves the body by a
/// degree within a tenth of a second.
const ROLL_MIN: f32 = 0.15 * 0.15;
/// Largest share of that mean square in the shown swing: an IMU that is mounted some degrees off a quarter of a turn
/// shows a little of it.
const SWING_SHARE: f32 = 0.05;
/// Squared correlation of roll and relative rate above which the two count as correlated.
const TOGETHER: f32 = 0.5;
/// Intervals for which the correlation must last: 60 ms.
const EXCHANGED_INTERVALS: u16 = 12;
/// Mean roll rate over the steady time, rad/s, of a body that has turned by 0.15 rad meanwhile, whatever its motor does:
/// on a slope the arm swings out while the wheels roll the other way. Only a wheel on a step of 0.15 m would roll a
/// vehicle of half a metre as far. `ROLLED_INTERVALS` is the time for which this must last: 20 ms.
const ROLLED_RAD_S: f32 = 0.15 / STEADY_TIME_CONSTANT_S;
const ROLLED_SWING_SHARE: f32 = 0.1;
const ROLLED_INTERVALS: u16 = 4;
/// Yaw rate from which the watch reports nothing, rad/s: a leaning arm shows some of the yaw rate as roll. Below this yaw
/// rate the shown roll is less than `ROLLED_RAD_S`.
const SHOWN_TURN_RAD_S: f32 = 0.5;

impl Default for Exchanged {
    fn default() -> Self {
        Self {
            steady: [LowPass::new(INTERVAL_S, STEADY_TIME_CONSTANT_S); 3],
            relative: 0.0,
            swing: 0.0,
            roll: 0.0,
            together: 0.0,
            turned: false,
            in_rhythm: Persistence::new(EXCHANGED_INTERVALS),
            rolled: Persistence::new(ROLLED_INTERVALS),
        }
    }
}

impl Exchanged {
    /// Updates the watch with one interval. Returns whether the IMU has shown for a while that its axes are exchanged.
    pub fn update(&mut self, rates: &BodyRates) -> bool {
        let mut motion = [rates.relative_rad_s, rates.swing_rad_s, rates.roll_rad_s];
        if rates.yaw_rad_s.abs() > SHOWN_TURN_RAD_S {
            self.turned = true;
            self.in_rhythm.update(false);
            self.rolled.update(false);
            return false;
        }
        for (rate, steady) in motion.iter_mut().zip(&mut self.steady) {
            if self.turned {
                // The roll that a turn shows ends with the turn, and the end of a turn is no rhythm.
                steady.reset(*rate);
            }
            steady.update(*rate);
            *rate -= steady.value();
        }
        if self.turned {
            // The last roll counts only up to what a slow turn shows, because one sample is not yet a roll of the body.
            let [_, _, roll] = &mut self.steady;
            roll.reset(roll.value().bounded(-SHOWN_TURN_RAD_S, SHOWN_TURN_RAD_S));
        }
        self.turned = false;
        let [relative, swing, roll] = motion;
        let mean = |mean: &mut f32, product: f32| *mean += MEAN_GAIN * (product - *mean);
        mean(&mut self.relative, relative * relative);
        mean(&mut self.swing, swing * swing);
        mean(&mut self.roll, roll * roll);
        mean(&mut self.together, relative * roll);
        let [_, swung, rolled] = self.steady.each_ref().map(|steady| steady.value().abs());
        let in_rhythm = self.in_rhythm.update(
            self.roll > ROLL_MIN
                && self.swing < SWING_SHARE * self.roll
                && self.together * self.together > TOGETHER * self.relative * self.roll,
        );
        let rolled = self
            .rolled
            .update(rolled > ROLLED_RAD_S && swung < ROLLED_SWING_SHARE * rolled);
        in_rhythm || rolled
    }

    /// Restarts the watch, when no motor is driven or the IMU is not believed.
    pub fn reset(&mut self) {
        for steady in &mut self.steady {
            steady.reset(0.0);
        }
        [self.relative, self.swing, self.roll, self.together] = [0.0; 4];
        self.turned = false;
        self.in_rhythm.update(false);
        self.rolled.update(false);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The tick, in intervals, in which the watch first reports a body that swings by `swing_rad_s` at `hertz`: `shown`
    /// makes the rates of the relative rate and the swing.
    fn told(hertz: f32, swing_rad_s: f32, shown: impl Fn(f32, f32) -> BodyRates) -> Option<u16> {
        let mut watch = Exchanged::default();
        (1..=1000).find(|k| {
            let angle = 2.0 * core::f32::consts::PI * hertz * INTERVAL_S * f32::from(*k);
            let swing = swing_rad_s * libm::sinf(angle);
            watch.update(&shown(-1.7 * swing, swing))
        })
    }

    const STEADY: BodyRates = BodyRates {
        relative_rad_s: 0.0,
        swing_rad_s: 0.0,
        roll_rad_s: 0.01,
        yaw_rad_s: 0.0,
    };

    #[test]
    fn exchanged_axes_are_told_within_a_quarter_of_a_second_of_swinging_and_others_never() {
        for hertz in [0.7_f32, 2.0, 6.0] {
            for size in [0.5_f32, -2.0] {
                let turned = |way: f32| {
                    move |relative, swing: f32| BodyRates {
                        relative_rad_s: relative,
                        swing_rad_s: 0.1 * swing,
                        roll_rad_s: way * swing,
                        ..STEADY
                    }
                };
                for way in [1.0, -1.0] {
                    let found = told(hertz, size, turned(way));
                    let limit = (0.25 / INTERVAL_S) as u16;
                    assert!(
                        found.is_some_and(|k| (EXCHANGED_INTERVALS..=limit).contains(&k)),
                        "{hertz} Hz, {size}: {found:?}"
                    );
                }
                // An IMU that is mounted correctly but 20 degrees off shows a third of the swing as roll.
                let upright = |relative, swing: f32| BodyRates {
                    relative_rad_s: relative,
                    swing_rad_s: swing,
                    roll_rad_s: 0.36 * swing,
                    ..STEADY
                };
                assert_eq!(told(hertz, size, upright), None);
            }
        }
    }

    /// One wheel drives over waves: the vehicle rolls while its wheels turn evenly or in another rhythm.
    #[test]
    fn a_vehicle_that_rolls_is_no_exchanged_imu() {
        let rolls = |_, swing| BodyRates {
            roll_rad_s: swing,
            ..STEADY
        };
        assert_eq!(told(2.0, 1.0, rolls), None);
        let mut watch = Exchanged::default();
        for k in 0..2000_u16 {
            let angle = 12.0 * INTERVAL_S * f32::from(k);
            let rates = BodyRates {
                relative_rad_s: libm::cosf(angle),
                roll_rad_s: libm::sinf(angle),
                ..STEADY
            };
            assert!(!watch.update(&rates), "{k}");
        }
    }

    /// On a slope the wheels roll one way and the arm swings out the other way, so their rates may cancel. The watch
    /// reports an arm that swings by 0.4 rad in 0.4 s before the swing is over. The watch does not report a vehicle that
    /// rolls by 0.1 rad over a step under one wheel.
    #[test]
    fn an_arm_that_swings_out_is_told_whatever_the_wheels_do() {
        for (size_rad, swing_share, expected) in [
            (0.4_f32, 0.0, true),
            (-0.4, 0.02, true),
            (0.1, 0.0, false),
            (0.4, 0.2, false),
        ] {
            let mut watch = Exchanged::default();
            let (omega, intervals) = (core::f32::consts::PI / 0.4, 100_u16);
            let found = (1..=intervals).find(|k| {
                let roll_rad_s = 0.5 * size_rad * omega * libm::sinf(omega * INTERVAL_S * f32::from(*k));
                watch.update(&BodyRates {
                    swing_rad_s: swing_share * roll_rad_s,
                    roll_rad_s,
                    ..STEADY
                })
            });
            assert_eq!(found.is_some(), expected, "{size_rad} rad, {swing_share}: {found:?}");
            assert!(found.is_none_or(|k| f32::from(k) * INTERVAL_S < 0.3), "{found:?}");
        }
    }

    /// A leaning arm shows yaw as roll, so a spin proves nothing.
    #[test]
    fn a_turn_tells_nothing() {
        for (yaw_rad_s, expected) in [(0.49, true), (0.51, false), (-0.51, false)] {
            let turns = |relative, swing| BodyRates {
                relative_rad_s: relative,
                roll_rad_s: swing,
                yaw_rad_s,
                ..STEADY
            };
            assert_eq!(told(2.0, 1.0, turns).is_some(), expected, "{yaw_rad_s}");
        }
    }

    /// A turn with the arm far out shows more roll than a body's swing, and may end at once, as at a kerb under one wheel.
    #[test]
    fn the_end_of_a_turn_tells_nothing() {
        for yaw_rad_s in [-8.0_f32, -1.8, 1.6, 3.0] {
            // The roll may outlive the turn by an interval.
            for (wheels_rad_s, rolls) in [(0.0_f32, 100_u16), (12.0, 100), (0.0, 101), (12.0, 101)] {
                let mut watch = Exchanged::default();
                for k in 0..300_u16 {
                    let told = watch.update(&BodyRates {
                        relative_rad_s: wheels_rad_s,
                        swing_rad_s: 0.0,
                        roll_rad_s: if k < rolls { yaw_rad_s * libm::sinf(0.7) } else { 0.0 },
                        yaw_rad_s: if k < 100 { yaw_rad_s } else { 0.0 },
                    });
                    assert!(!told, "{yaw_rad_s} rad/s, {wheels_rad_s} rad/s, interval {k}");
                }
            }
        }
    }

    #[test]
    fn little_motion_and_what_was_before_a_reset_tell_nothing() {
        let turned = |relative, swing| BodyRates {
            relative_rad_s: relative,
            roll_rad_s: swing,
            ..STEADY
        };
        // The mean square of a sine is half of its peak's.
        assert_eq!(told(2.0, 0.15, turned), None);
        assert!(told(2.0, 0.3, turned).is_some());
        let mut watch = Exchanged::default();
        for k in 0..100_u16 {
            let swing = libm::sinf(0.1 * f32::from(k));
            watch.update(&turned(swing, swing));
        }
        watch.reset();
        assert_eq!(watch, Exchanged::default());
    }
}
