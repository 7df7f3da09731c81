//! Detects sliding wheels by comparing the wheels' motion with the accelerometer and the gyro.
//!
//! Rolling wheels and the accelerometer agree on the axle's acceleration, and the difference of the wheels agrees with
//! the gyro's yaw rate (6.12). Sliding wheels violate one of the two. During a slide the speed over the ground follows
//! from the acceleration alone. This speed is exact at the start of the slide and drifts by 0.02 m/s^2 per tenth of a
//! degree of error in the arm's angle.
//!
//! Near the limit of grip the wheels hunt: they slip and grip again some times per second. The filters' lags leave larger
//! errors of these accelerations than the slide itself causes. But the lag errors have the mean 0, and the ground takes
//! speed from the vehicle at `g (sin(beta) - mu cos(beta))` all the time, so means over half a second show the slide.

use super::facing::INTERVAL_S;
use super::rate_filter::LowPass;
use crate::bounded::Bounded;
use crate::vehicle::G;

/// One tick's evidence.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Evidence {
    /// Speed that the wheels show, m/s.
    pub wheels_m_s: f32,
    /// Acceleration that the wheels show, m/s^2.
    pub wheels_m_s2: f32,
    /// Sine of the angle between the accelerometer and the estimate that takes the wheels' acceleration for the axle's.
    pub tilt_error: f32,
    /// Magnitude of the IMU's further acceleration: its distance from the axle times the arm's angular acceleration,
    /// m/s^2.
    pub swing_m_s2: f32,
    /// The gyro's yaw rate, rad/s.
    pub yaw_rate_rad_s: f32,
    /// The wheels' yaw rate, rad/s.
    pub wheels_yaw_rad_s: f32,
    /// Whether the accelerometer feels about the weight of a vehicle that stands on its wheels.
    pub weighs: bool,
    /// Whether this is the tick of an interval ([`INTERVAL_TICKS`](super::facing::INTERVAL_TICKS)) in which the slow
    /// means are updated.
    pub slow: bool,
}

/// Watches for sliding wheels.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Traction {
    dt_s: f32,
    half_track_m: f32,
    difference: LowPass,
    motion: LowPass,
    yaw_difference: LowPass,
    slow_difference: LowPass,
    slow_wheels: LowPass,
    slow_intervals: u8,
    /// Ticks for which the wheels have contradicted the other sensors, and for which they have agreed since.
    apart_ticks: u16,
    agreed_ticks: u16,
    sliding_ticks: u16,
    /// Ticks since the last slide.
    rolling_ticks: u16,
    sliding: bool,
    speed_m_s: f32,
}

/// Time constant of the differences' filters.
const DIFFERENCE_TIME_CONSTANT_S: f32 = 0.05;
/// Time constant of the slow means, and intervals for which they must differ: 0.2 s.
const SLOW_TIME_CONSTANT_S: f32 = 0.5;
const SLOW_INTERVALS: u8 = 40;
/// Difference of the accelerations, m/s^2, beyond which the wheels slide, and below which they roll again.
const SLIDES_M_S2: f32 = 0.25;
const ROLLS_M_S2: f32 = 0.12;
/// Share of the accelerations themselves by which they may differ besides: filters lag, and the arm's angle is known to a
/// degree.
const MOTION_SHARE: f32 = 0.2;
/// Difference of the yaw rates, rad/s, beyond which a wheel slides, and the relative difference of the wheels' radii that
/// is no slide.
const SLIDES_RAD_S: f32 = 0.1;
const RADIUS_SHARE: f32 = 0.03;
/// Ticks for which the sensors must differ, or agree, before the watch accepts the result: longer than the blow of a kerb
/// or a joint.
const SLIDES_TICKS: u16 = 150;
const ROLLS_TICKS: u16 = 300;
/// Difference between the wheels' speed and the speed over the ground, m/s, at which the wheels may roll again, and the
/// drift of the speed over the ground per second of a slide.
const REGAINED_M_S: f32 = 0.1;
const DRIFT_M_S2: f32 = 0.06;
/// Slip, m/s, beyond which wheels whose acceleration agrees with the ground's count as rolling, however wrong the
/// integrated speed is. Sliding friction changes the vehicle's speed. Sliding wheels have the same acceleration only
/// where the law makes them follow the ground; the law keeps the wheels within 0.3 m/s of the ground, and within half as
/// much again on the way there.
const STEADY_SLIP_MAX_M_S: f32 = 0.45;
/// Ticks after which wheels with less slip than that count as rolling, too.
const ROLLS_ANYWAY_TICKS: u16 = 1000;
/// Ticks after which the watch attributes a slide to a wrong angle of the arm.
const SLIDE_MAX_TICKS: u16 = 10_000;
/// Ticks for which a slide counts as recent: where the wheels have slipped once, they may slip again.
const LATELY_TICKS: u16 = 2000;
/// Yaw rate above which the accelerations are no evidence, rad/s: a roll of the axle, or of the IMU on the arm, adds to
/// them.
const TURNS_RAD_S: f32 = 0.5;

impl Traction {
    /// A watch called every `dt_s` seconds, for wheels `2 half_track_m` apart.
    pub fn new(dt_s: f32, half_track_m: f32) -> Self {
        Self {
            dt_s,
            half_track_m,
            difference: LowPass::new(dt_s, DIFFERENCE_TIME_CONSTANT_S),
            motion: LowPass::new(dt_s, DIFFERENCE_TIME_CONSTANT_S),
            yaw_difference: LowPass::new(dt_s, DIFFERENCE_TIME_CONSTANT_S),
            slow_difference: LowPass::new(INTERVAL_S, SLOW_TIME_CONSTANT_S),
            slow_wheels: LowPass::new(INTERVAL_S, SLOW_TIME_CONSTANT_S),
            slow_intervals: 0,
            apart_ticks: 0,
            agreed_ticks: 0,
            sliding_ticks: 0,
            rolling_ticks: u16::MAX,
            sliding: false,
            speed_m_s: 0.0,
        }
    }

    /// Updates the watch with one tick's evidence. Without weight, and in a turn, the accelerations give no evidence.
    #[inline]
    pub fn update(&mut self, evidence: &Evidence) {
        let straight = evidence.yaw_rate_rad_s.abs() < TURNS_RAD_S;
        let difference_m_s2 = if evidence.weighs && straight {
            G * evidence.tilt_error
        } else {
            0.0
        };
        self.difference.update(difference_m_s2);
        self.yaw_difference
            .update(evidence.yaw_rate_rad_s - evidence.wheels_yaw_rad_s);
        self.motion
            .update(evidence.wheels_m_s2.abs() + evidence.swing_m_s2.abs());
        let along = self.difference.value().abs() - MOTION_SHARE * self.motion.value();
        if evidence.slow {
            // The filtered difference, because a vibration in the intervals' rhythm would look steady.
            self.slow_difference.update(self.difference.value());
            self.slow_wheels.update(evidence.wheels_m_s2);
            self.slow_intervals = if self.slow_along() > SLIDES_M_S2 {
                self.slow_intervals.saturating_add(1)
            } else {
                0
            };
        }
        let hunts = self.slow_intervals >= SLOW_INTERVALS;
        let yaw = self.yaw_difference.value().abs();
        let yaw_max = SLIDES_RAD_S + RADIUS_SHARE * evidence.wheels_m_s.abs() / (2.0 * self.half_track_m);
        let apart = along > SLIDES_M_S2 || yaw > yaw_max;
        let sliding_s = f32::from(self.sliding_ticks) * self.dt_s;
        let slip_m_s = (self.speed_m_s - evidence.wheels_m_s).abs();
        let regained = slip_m_s < REGAINED_M_S + DRIFT_M_S2 * sliding_s || slip_m_s > STEADY_SLIP_MAX_M_S;
        let agreed = along < ROLLS_M_S2 && !hunts && yaw < 0.5 * yaw_max;
        self.apart_ticks = if apart { self.apart_ticks.saturating_add(1) } else { 0 };
        self.agreed_ticks = if agreed { self.agreed_ticks.saturating_add(1) } else { 0 };
        if self.sliding {
            self.sliding_ticks = self.sliding_ticks.saturating_add(1);
            self.rolling_ticks = 0;
            self.sliding = self.agreed_ticks < if regained { ROLLS_TICKS } else { ROLLS_ANYWAY_TICKS };
            if self.sliding_ticks >= SLIDE_MAX_TICKS {
                // The same evidence must not start another slide at once.
                self.stand();
            }
        } else {
            self.sliding_ticks = 0;
            self.rolling_ticks = self.rolling_ticks.saturating_add(1);
            self.sliding = hunts || self.apart_ticks >= SLIDES_TICKS;
        }
        // The integration of the speed begins with the first sign of a slide.
        if self.sliding || self.apart_ticks > 0 {
            self.speed_m_s += self.dt_s * (evidence.wheels_m_s2 + difference_m_s2);
        } else {
            self.speed_m_s = evidence.wheels_m_s;
        }
    }

    /// The slow mean of the difference less the difference that rolling wheels may show, m/s^2.
    fn slow_along(&self) -> f32 {
        self.slow_difference.value().abs() - MOTION_SHARE * self.slow_wheels.value().abs()
    }

    /// Ends a slide, because the vehicle stands.
    pub fn stand(&mut self) {
        *self = Self::new(self.dt_s, self.half_track_m);
    }

    /// The wheels slide.
    pub fn slides(&self) -> bool {
        self.sliding
    }

    /// Whether the wheels slide, or slid recently and may slide again before the watch reports so.
    pub fn slid_lately(&self) -> bool {
        self.rolling_ticks < LATELY_TICKS
    }

    /// Speed over the ground: the wheels' speed or, during a slide, the speed integrated from the accelerations, m/s.
    pub fn speed_m_s(&self) -> f32 {
        self.speed_m_s
    }

    /// Acceleration of the axle: the wheels' acceleration, corrected during a slide, m/s^2.
    pub fn acceleration_m_s2(&self, wheels_m_s2: f32) -> f32 {
        if self.sliding {
            wheels_m_s2 + self.difference.value().bounded(-G, G)
        } else {
            wheels_m_s2
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ROLLING: Evidence = Evidence {
        wheels_m_s: 1.0,
        wheels_m_s2: 0.0,
        swing_m_s2: 0.0,
        tilt_error: 0.0,
        yaw_rate_rad_s: 0.0,
        wheels_yaw_rad_s: 0.0,
        weighs: true,
        slow: false,
    };

    fn after(evidence: &Evidence, ticks: usize) -> Traction {
        let mut traction = Traction::new(0.001, 0.25);
        for _ in 0..ticks {
            traction.update(evidence);
        }
        traction
    }

    /// Wheels that slip and grip again 4 times per second: a difference of `difference_m_s2` under a swing of 3 m/s^2, of
    /// which a lag leaves a third. Returns the ticks until the watch reports a slide.
    fn hunting(difference_m_s2: f32) -> Option<u16> {
        let mut traction = Traction::new(0.001, 0.25);
        (0..3000_u16).find(|k| {
            let angle = 2.0 * core::f32::consts::PI * 4.0 * 0.001 * f32::from(*k);
            traction.update(&Evidence {
                wheels_m_s2: 3.0 * libm::sinf(angle),
                swing_m_s2: 1.0,
                tilt_error: (difference_m_s2 + libm::cosf(angle)) / G,
                slow: k.is_multiple_of(u16::from(super::super::facing::INTERVAL_TICKS)),
                ..ROLLING
            });
            traction.slides()
        })
    }

    /// The watch reports, within 0.8 s, the difference that friction 0.06 short of the slope causes, but not the
    /// difference that a degree of the arm's angle causes.
    #[test]
    fn wheels_that_hunt_at_the_limit_of_grip_are_told_by_their_mean() {
        for (difference_m_s2, expected) in [(0.59, true), (-0.59, true), (0.17, false), (-0.2, false), (0.0, false)] {
            let told = hunting(difference_m_s2);
            assert_eq!(told.is_some(), expected, "{difference_m_s2}: {told:?}");
            assert!(
                told.is_none_or(|ticks| (300..800).contains(&ticks)),
                "{difference_m_s2}: {told:?}"
            );
        }
    }

    #[test]
    fn rolling_wheels_are_believed() {
        for evidence in [
            ROLLING,
            Evidence {
                tilt_error: 0.02,
                ..ROLLING
            },
            // A wheel that is 2 % larger than the other.
            Evidence {
                wheels_m_s: 2.5,
                wheels_yaw_rad_s: 0.1,
                ..ROLLING
            },
            // The vehicle turns, with an axle that rolls.
            Evidence {
                tilt_error: 0.05,
                yaw_rate_rad_s: 1.9,
                wheels_yaw_rad_s: 1.9,
                ..ROLLING
            },
            // The vehicle falls.
            Evidence {
                tilt_error: 0.5,
                weighs: false,
                ..ROLLING
            },
        ] {
            let traction = after(&evidence, 2000);
            assert!(!traction.slides(), "{evidence:?}");
            assert_eq!(traction.speed_m_s(), evidence.wheels_m_s);
        }
        let blow = Evidence {
            tilt_error: 0.5,
            ..ROLLING
        };
        assert!(!after(&blow, 100).slides(), "a blow is no slide");
    }

    #[test]
    fn a_slide_is_told_and_its_speed_followed_until_the_wheels_roll_again() {
        for (tilt_error, speed_m_s) in [(-0.037, 0.637), (0.05, 1.49), (-0.1, 0.02)] {
            let sliding = Evidence { tilt_error, ..ROLLING };
            let mut traction = after(&sliding, 1000);
            assert!(traction.slides());
            assert!(
                (traction.speed_m_s() - speed_m_s).abs() < 0.08,
                "{}",
                traction.speed_m_s()
            );
            assert!((traction.acceleration_m_s2(0.0) - G * tilt_error).abs() < 0.01);
            let slip_m_s = (traction.speed_m_s() - ROLLING.wheels_m_s).abs();
            for _ in 0..1000 {
                traction.update(&ROLLING);
            }
            // The wheels turn at another speed than the vehicle moves, unless the difference is larger than sliding
            // wheels can have.
            assert_eq!(traction.slides(), slip_m_s < STEADY_SLIP_MAX_M_S, "{slip_m_s} m/s");
            let caught = Evidence {
                wheels_m_s: traction.speed_m_s() + 0.1,
                ..ROLLING
            };
            for _ in 0..600 {
                traction.update(&caught);
            }
            assert!(!traction.slides());
            assert_eq!(traction.speed_m_s(), caught.wheels_m_s);
        }
    }

    /// Only the integral's remaining error still contradicts the wheels.
    #[test]
    fn wheels_that_agree_for_a_second_are_believed_whatever_the_integral_says() {
        for tilt_error in [-0.5, -0.037, 0.037, 0.5] {
            let mut traction = after(&Evidence { tilt_error, ..ROLLING }, 1000);
            assert!(traction.slides());
            for _ in 0..1300 {
                traction.update(&ROLLING);
            }
            assert!(!traction.slides(), "{tilt_error}");
            assert_eq!(traction.speed_m_s(), ROLLING.wheels_m_s);
        }
    }

    #[test]
    fn a_slide_without_end_is_a_wrong_angle_and_does_not_go_on_in_the_next_tick() {
        let wrong = Evidence {
            tilt_error: 0.1,
            ..ROLLING
        };
        let mut traction = after(&wrong, usize::from(SLIDE_MAX_TICKS));
        assert!(traction.slides());
        let ends = (0..300).position(|_| {
            traction.update(&wrong);
            !traction.slides()
        });
        assert!(ends.is_some());
        for _ in 0..SLIDES_TICKS {
            assert_eq!(traction.speed_m_s() - ROLLING.wheels_m_s, 0.0);
            assert!(!traction.slides());
            traction.update(&ROLLING);
        }
    }

    #[test]
    fn a_slide_ends_where_the_vehicle_stands() {
        let mut traction = after(
            &Evidence {
                tilt_error: 0.1,
                ..ROLLING
            },
            2000,
        );
        assert!(traction.slides() && traction.speed_m_s() > 2.0);
        traction.stand();
        assert!(!traction.slides());
        assert_eq!(traction.speed_m_s(), 0.0);
    }

    #[test]
    fn one_sliding_wheel_shows_in_the_yaw_rate() {
        for wheels_yaw_rad_s in [0.3, -0.3, 2.0] {
            let evidence = Evidence {
                wheels_yaw_rad_s,
                ..ROLLING
            };
            assert!(after(&evidence, 400).slides(), "{wheels_yaw_rad_s}");
        }
    }
}
