//! Detects an arm IMU that faces backward: a mirrored IMU agrees with itself, but not with the wheels' encoders.
//!
//! An IMU that is mounted half a turn about its z axis shows -phi' and -f_x. Its gyro and its accelerometer agree with
//! each other, and a law that trusts them throws the arm. The encoders do not share the error: they measure the rate `w
//! = theta' + phi'` of the wheels relative to the arm. While the wheels roll, the axle accelerates by
//!
//! ```text
//! a = r theta'' = r (w' - phi'')
//! ```
//!
//! The estimator subtracts this acceleration from the accelerometer's horizontal component. The remainder `e` is almost
//! 0 if the IMU faces forward. A mirrored IMU shows -a instead of a, and the estimator mistakes w' + phi'' for theta'':
//!
//! ```text
//! e = -a - r (w' + phi'') = -2 r w'
//! ```
//!
//! So `e` should be 0 or `-2 r w'`: the watch compares the mean squares of the two errors, `e` and `e + 2 r w'`. The
//! comparison depends on neither voltage, inertia, load nor slope: any motion of the wheels against the arm, by a motor,
//! a hand or the ground, shows which way the IMU faces. Sliding wheels obey neither equation, so both errors are large.
//! The watch filters steady errors out of both, because the angle is known only to some degrees. A vehicle in the air
//! gives no evidence: its motors slow the wheels and its landing spins them up, but neither accelerates the axle.
//!
//! A mirrored IMU looks like a slide, so the watch judges slides too. Once the IMU has shown that it faces forward, the
//! watch rests until the vehicle is disarmed, because the mounting does not change meanwhile. A push can look like a mirrored
//! IMU: gears with play let the wheels roll without their encoders.
//!
//! For an IMU that is also upside down, `e` is the sine of an angle of 180 degrees: 0. The vertical component shows this
//! case, because the ground pushes the vehicle up and a falling vehicle feels no force
//! (`tick/estimate/contradiction.rs`).

use super::rate_filter::LowPass;
use crate::persistence::Persistence;
use crate::sample::TICK_S;
use crate::vehicle::G;

/// Ticks between two updates of a mounting watch. The arm's two watches, the spar's two watches and the slow means of
/// [`traction`](super::traction) take turns: a swing of some hertz needs no more, and a tick has time for only one of
/// the five.
pub const INTERVAL_TICKS: u8 = 5;
/// Time between two updates of a mounting watch, s.
pub(super) const INTERVAL_S: f32 = INTERVAL_TICKS as f32 * TICK_S;

/// The evidence of one tick of an armed vehicle about its IMU.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Shown {
    /// Mean rate of the wheels relative to the arm by their encoders, rad/s.
    pub relative_rad_s: f32,
    /// The accelerometer's horizontal component less the axle's acceleration, over g.
    pub unexplained: f32,
    /// The accelerometer's component to the left, m/s^2.
    pub sideways_m_s2: f32,
    /// For a quarter of a second the accelerometer has felt about the weight of a vehicle that stands on its wheels, so
    /// the filters have forgotten a landing. When a vehicle with resting wheels lands at 2.5 m/s, a friction of 0.6
    /// spins the wheels up within 28 ms, an acceleration of 9 g. After 120 ms the filters of 20 and 28 ms leave less
    /// than 0.14 g of that; the square of 0.14 g is `UNEXPLAINED_MIN`.
    pub weighs: bool,
    /// Whether the wheels are known to slide or to have slid recently.
    pub slides: bool,
}

/// The watch for an IMU that faces backward.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Facing {
    /// Wheel radius over g, s^2.
    radius_s2: f32,
    relative: LowPass,
    steady_forward: LowPass,
    steady_backward: LowPass,
    steady_sideways: LowPass,
    /// Mean squares of the errors under the two hypotheses: the IMU faces forward, or backward.
    forward: f32,
    backward: f32,
    /// Mean square of the sideways component, over g.
    sideways: f32,
    mirrored: Persistence,
    upright: Persistence,
    /// The IMU has shown that it faces forward. Its mounting does not change before the vehicle is disarmed.
    faces_forward: bool,
    /// Intervals since the wheels gripped again, up to [`REGAINS_INTERVALS`].
    regained: u8,
}

/// Time constant of the filter of steady errors: several times that of the tilt estimate's filters, and less than a
/// manoeuvre.
pub(super) const STEADY_TIME_CONSTANT_S: f32 = 0.2;
/// Time constant of the mean squares: longer than the blow of a kerb.
const MEAN_TIME_CONSTANT_S: f32 = 0.1;
/// Least mean square, over g, of the error under the hypothesis of a forward-facing IMU: that of 1.4 m/s^2, six times
/// the difference that may be a slide. The wheels' acceleration against the arm is half of that error.
const UNEXPLAINED_MIN: f32 = 1.4 / G * (1.4 / G);
/// Largest share of that mean square in the error under the hypothesis of a backward-facing IMU: two fifths of the
/// amplitude, for scales, radii and lags that are known to some percent, and for wheels that slip meanwhile.
const MIRRORED_SHARE: f32 = 0.15;
/// Largest share of that mean square in the sideways component. A swing of the arm causes no sideways acceleration. A
/// vibration, to which the law responds through the gyro, shakes the IMU sideways as much as forward.
const SIDEWAYS_SHARE: f32 = 0.3;
/// Intervals for which only the backward hypothesis must explain the readings: 60 ms.
const MIRRORED_INTERVALS: u16 = 12;

/// Unexplained acceleration, over g, beyond which sliding wheels are no evidence: when the wheels grip again, the ground
/// turns them and, through the gears, the arm. `REGAINS_INTERVALS` is the time without evidence after that: the cascaded
/// filters of 20 and 28 ms leave 0.29 of it after 60 ms; the square of that remainder is `UNEXPLAINED_MIN`.
const REGAINS: f32 = 0.5;
const REGAINS_INTERVALS: u8 = 12;
/// Weight of each interval in the mean squares.
pub(super) const MEAN_GAIN: f32 = INTERVAL_S / MEAN_TIME_CONSTANT_S;

impl Facing {
    /// A watch for wheels of `wheel_radius_m`, whose acceleration the tilt estimate takes from a filter of
    /// `axle_time_constant_s`.
    pub fn new(wheel_radius_m: f32, axle_time_constant_s: f32) -> Self {
        Self {
            radius_s2: wheel_radius_m / G,
            relative: LowPass::new(INTERVAL_S, axle_time_constant_s),
            steady_forward: LowPass::new(INTERVAL_S, STEADY_TIME_CONSTANT_S),
            steady_backward: LowPass::new(INTERVAL_S, STEADY_TIME_CONSTANT_S),
            steady_sideways: LowPass::new(INTERVAL_S, STEADY_TIME_CONSTANT_S),
            forward: 0.0,
            backward: 0.0,
            sideways: 0.0,
            mirrored: Persistence::new(MIRRORED_INTERVALS),
            upright: Persistence::new(MIRRORED_INTERVALS),
            faces_forward: false,
            regained: REGAINS_INTERVALS,
        }
    }

    /// Updates the watch with one interval. Returns whether the IMU has shown for a while that it is mirrored.
    pub fn update(&mut self, shown: &Shown) -> bool {
        if self.faces_forward {
            return false;
        }
        let relative = self.radius_s2 * self.relative.update(shown.relative_rad_s);
        let [forward, backward] = [shown.unexplained, shown.unexplained + 2.0 * relative];
        let sideways = shown.sideways_m_s2 / G;
        let paused = self.regained < REGAINS_INTERVALS;
        self.regained = if shown.slides && shown.unexplained.abs() > REGAINS {
            0
        } else {
            (self.regained + 1).min(REGAINS_INTERVALS)
        };
        if self.regained < REGAINS_INTERVALS || paused {
            // Nor does a slide leave a steady error in the filters.
            self.steady_forward.reset(forward);
            self.steady_backward.reset(backward);
            self.steady_sideways.reset(sideways);
            [self.forward, self.backward, self.sideways] = [0.0; 3];
        } else if shown.weighs {
            // The error during a flight is no steady error either.
            self.steady_forward.update(forward);
            self.steady_backward.update(backward);
            self.steady_sideways.update(sideways);
            let [forward, backward] = [
                forward - self.steady_forward.value(),
                backward - self.steady_backward.value(),
            ];
            self.forward += MEAN_GAIN * (forward * forward - self.forward);
            self.backward += MEAN_GAIN * (backward * backward - self.backward);
            let sideways = sideways - self.steady_sideways.value();
            self.sideways += MEAN_GAIN * (sideways * sideways - self.sideways);
        }
        // Errors that stand still since the vehicle took off are no further evidence.
        let weighs = shown.weighs;
        self.faces_forward |= self
            .upright
            .update(weighs && explains(self.forward, self.backward, self.sideways));
        self.mirrored
            .update(weighs && explains(self.backward, self.forward, self.sideways))
    }

    /// Restarts the watch with standing wheels, when nothing drives them or the IMU is not believed. The accelerometer
    /// feels `sideways_m_s2` to the left.
    pub fn reset(&mut self, sideways_m_s2: f32) {
        self.relative.reset(0.0);
        self.steady_forward.reset(0.0);
        self.steady_backward.reset(0.0);
        self.steady_sideways.reset(sideways_m_s2 / G);
        [self.forward, self.backward, self.sideways] = [0.0; 3];
        self.mirrored.update(false);
        self.upright.update(false);
        self.faces_forward = false;
        self.regained = REGAINS_INTERVALS;
    }
}

/// Whether one hypothesis explains a motion that the other one does not, by their errors' mean squares.
fn explains(error: f32, other: f32, sideways: f32) -> bool {
    other > UNEXPLAINED_MIN && error < MIRRORED_SHARE * other && sideways < SIDEWAYS_SHARE * other
}

#[cfg(test)]
mod tests;
