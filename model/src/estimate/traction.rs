//! Detects sliding wheels by comparing the wheels' motion with the accelerometer and the gyro.
//!
//! Rolling wheels and the accelerometer agree on the axle's acceleration, along the heading and, as `v psi'`, across it, and
//! the difference of the wheels agrees with the gyro's yaw rate (6.12). Sliding wheels violate one of the three. During a
//! slide the speed over the ground follows from the accelerations alone. This speed is exact at the start of the slide and
//! drifts by 0.02 m/s^2 per tenth of a degree of error in the arm's angle or the axle's roll.
//!
//! Near the limit of grip the wheels hunt: they slip and grip again some times per second. The filters' lags leave larger
//! errors of these accelerations than the slide itself causes. But the lag errors have the mean 0, and the ground takes
//! speed from the vehicle at `g (sin(beta) - mu cos(beta))` all the time, so means over half a second show the slide.

use super::accelerometer_offset::AccelerometerOffset;
use super::facing::INTERVAL_S;
use super::ground_speed::GroundSpeed;
use super::rate_filter::LowPass;
use super::rolling_yaw::RollingYaw;
use super::trust::Trust;
use crate::bounded::Bounded;
use crate::persistence::Persistence;
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
    /// What the accelerometer feels to the left beyond the axle's roll and the turn of rolling wheels, m/s^2.
    pub sideways_m_s2: f32,
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
    sideways: LowPass,
    rolling_yaw: RollingYaw,
    offset: AccelerometerOffset,
    slow_difference: LowPass,
    slow_wheels: LowPass,
    /// Whether the slow means differ, in intervals.
    hunts: Persistence,
    /// Whether the wheels contradict the other sensors, along or in yaw, and across, and whether they have agreed since.
    apart: Persistence,
    aside: Persistence,
    agrees: Persistence,
    sliding_ticks: u16,
    /// Whether a slide has nothing that would begin one.
    quiet: Persistence,
    /// Ticks since the last slide.
    rolling_ticks: u16,
    sliding: bool,
    speed: GroundSpeed,
}

/// Time constant of the differences' filters.
const DIFFERENCE_TIME_CONSTANT_S: f32 = 0.05;
/// Time constant of the slow means, and intervals for which they must differ: 0.2 s.
const SLOW_TIME_CONSTANT_S: f32 = 0.5;
const SLOW_INTERVALS: u16 = 40;
/// Difference of the accelerations along, m/s^2, beyond which the wheels slide, and below which they roll again.
const SLIDES_M_S2: f32 = 0.25;
const ROLLS_M_S2: f32 = 0.12;
/// Share of the accelerations themselves by which they may differ in addition: filters lag, and the arm's angle is known to a
/// degree.
const MOTION_SHARE: f32 = 0.2;
/// Difference of the yaw rates, rad/s, beyond which a wheel slides, and the differences that do not count as a slide: the relative difference of the
/// wheels' radii, and the share of the turn by which a radius and a track that are each a tenth other than the file's change it,
/// until it is learnt.
const SLIDES_RAD_S: f32 = 0.1;
const RADIUS_SHARE: f32 = 0.03;
const TRACK_SHARE: f32 = 0.22;
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
/// Ticks without anything that would begin a slide, after which the wheels count as rolling though the sensors do not quite agree:
/// what an arm's angle that a slide has left wrong by a degree leaves between the two thresholds.
const QUIET_TICKS: u16 = 2000;
/// Ticks after which the watch attributes a slide to a wrong angle of the arm.
const SLIDE_MAX_TICKS: u16 = 10_000;
/// Ticks for which a slide counts as recent: where the wheels have slipped once, they may slip again.
const LATELY_TICKS: u16 = 2000;
/// Difference of the accelerations across, m/s^2, beyond which the wheels slide. Neither motors nor the arm's swing act there, so
/// that it may be less than along; but the accelerometer's offset does, of up to 20 mg by its data sheet.
const SLIDES_SIDEWAYS_M_S2: f32 = 0.25;
/// Shares of the turn's acceleration by which the accelerations may differ besides: across, and along, where `MOTION_SHARE`
/// counts it. The wheels' radii are known to some percent.
const TURN_ACROSS_SHARE: f32 = 0.06;
const TURN_ALONG_SHARE: f32 = 0.25;

impl Traction {
    /// A watch called every `dt_s` seconds, for wheels `2 half_track_m` apart, that knows the accelerometer's `offset` so far.
    pub fn new(dt_s: f32, half_track_m: f32, offset: AccelerometerOffset) -> Self {
        Self {
            dt_s,
            half_track_m,
            difference: LowPass::new(dt_s, DIFFERENCE_TIME_CONSTANT_S),
            motion: LowPass::new(dt_s, DIFFERENCE_TIME_CONSTANT_S),
            yaw_difference: LowPass::new(dt_s, DIFFERENCE_TIME_CONSTANT_S),
            sideways: LowPass::new(dt_s, DIFFERENCE_TIME_CONSTANT_S),
            rolling_yaw: RollingYaw::new(dt_s, half_track_m),
            offset,
            slow_difference: LowPass::new(INTERVAL_S, SLOW_TIME_CONSTANT_S),
            slow_wheels: LowPass::new(INTERVAL_S, SLOW_TIME_CONSTANT_S),
            hunts: Persistence::new(SLOW_INTERVALS),
            apart: Persistence::new(SLIDES_TICKS),
            aside: Persistence::new(SLIDES_TICKS),
            agrees: Persistence::new(ROLLS_TICKS),
            sliding_ticks: 0,
            quiet: Persistence::new(QUIET_TICKS),
            rolling_ticks: u16::MAX,
            sliding: false,
            speed: GroundSpeed::default(),
        }
    }

    /// Updates the watch with one tick's evidence. Without weight the accelerations give no evidence.
    #[inline]
    pub fn update(&mut self, evidence: &Evidence) {
        let turn_m_s2 = (evidence.wheels_m_s * evidence.yaw_rate_rad_s).abs();
        let [difference_m_s2, sideways_m_s2] = if evidence.weighs {
            let [forward_m_s2, left_m_s2] = self.offset.explained_m_s2();
            [
                G * evidence.tilt_error - forward_m_s2,
                evidence.sideways_m_s2 - left_m_s2,
            ]
        } else {
            [0.0; 2]
        };
        self.difference.update(difference_m_s2);
        self.sideways.update(sideways_m_s2);
        let wheels_yaw_rad_s = evidence.wheels_yaw_rad_s;
        let yaw_rad_s = evidence.yaw_rate_rad_s
            - wheels_yaw_rad_s
            - self.rolling_yaw.difference_rad_s(evidence.wheels_m_s, wheels_yaw_rad_s);
        self.yaw_difference.update(yaw_rad_s);
        self.motion
            .update(evidence.wheels_m_s2.abs() + evidence.swing_m_s2.abs() + TURN_ALONG_SHARE * turn_m_s2);
        let along = self.difference.value().abs() - MOTION_SHARE * self.motion.value();
        if evidence.slow {
            // The filtered difference, because a vibration in the intervals' rhythm would look steady.
            self.slow_difference.update(self.difference.value());
            self.slow_wheels.update(evidence.wheels_m_s2);
            self.hunts.update(self.slow_along() > SLIDES_M_S2);
        }
        let hunts = self.hunts.stands();
        let yaw = self.yaw_difference.value().abs();
        // The lesser of the two: wheels that turn a vehicle which does not turn slide, and the other way about.
        let turn_rad_s = wheels_yaw_rad_s.abs().min(evidence.yaw_rate_rad_s.abs());
        let yaw_max = SLIDES_RAD_S
            + RADIUS_SHARE * evidence.wheels_m_s.abs() / (2.0 * self.half_track_m)
            + TRACK_SHARE * turn_rad_s;
        let sideways = self.sideways.value().abs();
        let sideways_max = SLIDES_SIDEWAYS_M_S2 + TURN_ACROSS_SHARE * turn_m_s2;
        let apart = along > SLIDES_M_S2 || yaw > yaw_max;
        let aside = sideways > sideways_max;
        let agreed = along < ROLLS_M_S2 && !hunts && yaw < 0.5 * yaw_max && sideways < 0.5 * sideways_max;
        if evidence.slow {
            self.offset(evidence, turn_m_s2, yaw < 0.5 * yaw_max);
        }
        self.apart.update(apart);
        // Apart from the others, because a vibration crosses zero along and across at different times.
        self.aside.update(aside);
        self.agrees.update(agreed);
        if self.sliding {
            let sliding_s = f32::from(self.sliding_ticks) * self.dt_s;
            let slip_m_s = self.speed.slip_m_s(evidence.wheels_m_s);
            let regained = slip_m_s < REGAINED_M_S + DRIFT_M_S2 * sliding_s || slip_m_s > STEADY_SLIP_MAX_M_S;
            self.sliding_ticks = self.sliding_ticks.saturating_add(1);
            self.rolling_ticks = 0;
            let quiet = self.quiet.update(!(apart || aside || hunts));
            let rolls_ticks = if regained { ROLLS_TICKS } else { ROLLS_ANYWAY_TICKS };
            self.sliding = !self.agrees.lasts(rolls_ticks) && !quiet;
            if self.sliding_ticks >= SLIDE_MAX_TICKS {
                // The same evidence must not start another slide at once.
                self.stand();
            }
        } else {
            self.sliding_ticks = 0;
            self.quiet.update(false);
            self.rolling_ticks = self.rolling_ticks.saturating_add(1);
            self.sliding = hunts || self.apart.stands() || self.aside.stands();
        }
        // The integration of the speed begins with the first sign of a slide.
        if self.sliding || self.apart.lasts(1) || self.aside.lasts(1) {
            let ground_m_s2 = [
                evidence.wheels_m_s2 + difference_m_s2,
                sideways_m_s2 + evidence.wheels_m_s * evidence.yaw_rate_rad_s,
            ];
            self.speed.update(self.dt_s, evidence.yaw_rate_rad_s, ground_m_s2);
        } else {
            self.speed = GroundSpeed::of_wheels(evidence.wheels_m_s);
            // Not at once beyond the limit: a wheel that begins to slide must not pass for one of another radius.
            if yaw_rad_s.abs() < yaw_max {
                self.rolling_yaw.learn(yaw_rad_s, evidence.wheels_m_s, wheels_yaw_rad_s);
            }
        }
    }

    /// Learns the accelerometer's offset, if the yaw rates have `agreed` and no slide is recent, and turns its part in the vertical.
    #[inline]
    fn offset(&mut self, evidence: &Evidence, turn_m_s2: f32, agreed: bool) {
        if agreed && evidence.weighs && !self.slid_lately() {
            let left_m_s2 = [self.difference.value(), self.sideways.value()];
            self.offset.learn(left_m_s2, turn_m_s2 + evidence.wheels_m_s2.abs());
        }
        let trust = if self.sliding { Trust::Little } else { Trust::Driving };
        self.offset.turn(evidence.yaw_rate_rad_s, trust);
    }

    /// The slow mean of the difference less the difference that rolling wheels may show, m/s^2.
    fn slow_along(&self) -> f32 {
        self.slow_difference.value().abs() - MOTION_SHARE * self.slow_wheels.value().abs()
    }

    /// Ends a slide, because the vehicle stands.
    pub fn stand(&mut self) {
        *self = Self {
            rolling_yaw: self.rolling_yaw,
            ..Self::new(self.dt_s, self.half_track_m, self.offset)
        };
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
        self.speed.forward_m_s
    }

    /// Speed over the ground to the left: none of wheels that roll, m/s.
    pub fn sideways_m_s(&self) -> f32 {
        self.speed.left_m_s
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
mod tests;
