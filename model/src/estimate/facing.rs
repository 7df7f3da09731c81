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
//! A mirrored IMU looks like a slide, so the watch judges slides too, until the IMU has shown that it faces forward.
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
        let relative = self.radius_s2 * self.relative.update(shown.relative_rad_s);
        let [forward, backward] = [shown.unexplained, shown.unexplained + 2.0 * relative];
        let sideways = shown.sideways_m_s2 / G;
        let paused = self.regained < REGAINS_INTERVALS;
        self.regained = if shown.slides && (self.faces_forward || shown.unexplained.abs() > REGAINS) {
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
        self.faces_forward |= self
            .upright
            .update(explains(self.forward, self.backward, self.sideways));
        self.mirrored
            .update(explains(self.backward, self.forward, self.sideways))
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
mod tests {
    use super::*;

    const RADIUS_M: f32 = 0.25;
    const AXLE_S: f32 = 0.02;
    const MIRRORED_TICKS: u16 = MIRRORED_INTERVALS * INTERVAL_TICKS as u16;
    /// Angular frequency, 2 Hz, at which the tests turn the wheels to and fro against the arm.
    const OMEGA_RAD_S: f32 = 12.6;

    /// A watch, and simulated wheels with an IMU.
    struct Bench {
        facing: Facing,
        ticks: u16,
        axle: LowPass,
        weighs: bool,
        slides: bool,
        /// The IMU's sideways acceleration as a share of the wheels' relative acceleration.
        sideways: f32,
    }

    impl Bench {
        fn new() -> Self {
            let mut facing = Facing::new(RADIUS_M, AXLE_S);
            // As on a side slope.
            facing.reset(3.0);
            Self {
                facing,
                ticks: 0,
                axle: LowPass::new(INTERVAL_S, AXLE_S),
                weighs: true,
                slides: false,
                sideways: 0.0,
            }
        }

        /// One interval at a relative rate. The error is this share of the wheels' relative acceleration, plus
        /// `offset_g`.
        fn interval(&mut self, relative_rad_s: f32, share: f32, offset_g: f32) -> bool {
            let relative_g = RADIUS_M / G * self.axle.update(relative_rad_s);
            self.facing.update(&Shown {
                relative_rad_s,
                unexplained: share * relative_g + offset_g,
                sideways_m_s2: 3.0 + self.sideways * relative_g * G,
                weighs: self.weighs,
                slides: self.slides,
            })
        }

        /// The tick in which the watch first reports a mirrored IMU while the wheels swing by `amplitude_m_s2`.
        fn told(&mut self, amplitude_m_s2: f32, share: f32, ticks: u16) -> Option<u16> {
            let step = u16::from(INTERVAL_TICKS);
            (step..=ticks).step_by(usize::from(step)).find(|_| {
                self.ticks += step;
                let angle = OMEGA_RAD_S * TICK_S * f32::from(self.ticks);
                let relative_rad_s = amplitude_m_s2 / (RADIUS_M * OMEGA_RAD_S) * libm::sinf(angle);
                self.interval(relative_rad_s, share, 0.0)
            })
        }
    }

    #[test]
    fn a_mirrored_imu_is_told_within_a_quarter_of_a_second_of_motion_and_an_upright_one_never() {
        for amplitude_m_s2 in [2.0_f32, 6.0, -4.0] {
            let told = Bench::new().told(amplitude_m_s2, -2.0, 1000);
            assert!(
                told.is_some_and(|tick| (MIRRORED_TICKS..=250).contains(&tick)),
                "{amplitude_m_s2}: {told:?}"
            );
            // An exact IMU, wheels that spin on ice or slip a little, an accelerometer of a wrong scale, and an error of
            // the wrong sign.
            for share in [0.0, -1.0, -1.3, 0.3, 2.0] {
                assert_eq!(
                    Bench::new().told(amplitude_m_s2, share, 3000),
                    None,
                    "{amplitude_m_s2}, {share}"
                );
            }
        }
        // Scales and radii that are wrong by a fifth do not hide a mirrored IMU.
        for share in [-1.6, -2.4] {
            assert!(Bench::new().told(3.0, share, 1000).is_some(), "{share}");
        }
    }

    /// An amplitude of 2 m/s^2 has the mean square of 1.4 m/s^2 and is twice the wheels' relative acceleration.
    #[test]
    fn little_motion_tells_nothing() {
        assert_eq!(Bench::new().told(0.8, -2.0, 3000), None);
        assert!(Bench::new().told(1.25, -2.0, 3000).is_some());
    }

    /// The watch does not report a blow that looks mirrored for 40 ticks, because the report needs 60 ticks.
    #[test]
    fn what_does_not_last_tells_nothing() {
        let mut bench = Bench::new();
        assert_eq!(bench.told(5.0, -2.0, MIRRORED_TICKS - 1), None);
        assert!(
            bench.facing.backward < MIRRORED_SHARE * bench.facing.forward,
            "it looks mirrored"
        );
        assert_eq!(bench.told(5.0, 0.0, 1000), None);
        // Two blows do not add up.
        assert_eq!(bench.told(5.0, -2.0, MIRRORED_TICKS - 1), None);
        assert_eq!(bench.told(5.0, 0.0, 1000), None);
        assert!(bench.told(5.0, -2.0, 600).is_some());
    }

    #[test]
    fn without_weight_and_after_a_reset_nothing_is_told_of_what_was() {
        let mut bench = Bench::new();
        bench.weighs = false;
        assert_eq!(bench.told(5.0, -2.0, 2000), None);
        bench.weighs = true;
        let told = bench.told(5.0, -2.0, 1000);
        assert!(told.is_some());
        bench.facing.reset(0.0);
        assert_eq!(bench.facing, Facing::new(RADIUS_M, AXLE_S));
    }

    /// A vehicle hops off a kerb. In the air its motors slow the wheels, which does not accelerate the axle. The blow of
    /// the landing, of two ticks, changes the axle's speed, and a friction of 0.6 spins the wheels up again. The
    /// estimator mistakes the wheels' acceleration for the axle's, and filters the blow by 28 ms.
    #[test]
    fn no_landing_looks_like_a_mirrored_imu() {
        const SPUN_UP_M_S2: f32 = 0.6 * G / 0.066;
        const WEIGHS_TICKS: u16 = 250;
        for slowed_m_s in [0.0_f32, 0.2, 0.5, 0.8, 1.2, 2.5] {
            for blow_m_s in [-1.0_f32, -0.5, -0.3, 0.0, 0.3, 0.5, 1.0] {
                let mut facing = Facing::new(RADIUS_M, AXLE_S);
                let (mut axle, mut felt) = (LowPass::new(TICK_S, AXLE_S), LowPass::new(TICK_S, 0.028));
                axle.reset(2.5);
                facing.relative.reset(2.5 / RADIUS_M);
                let mut grounded_ticks = WEIGHS_TICKS;
                let mut wheels_m_s = 2.5_f32;
                for k in 0..1000_u16 {
                    let (flies, lands) = ((100..160).contains(&k), (160..162).contains(&k));
                    grounded_ticks = if flies || lands { 0 } else { grounded_ticks + 1 };
                    wheels_m_s = if flies {
                        wheels_m_s - slowed_m_s / 60.0
                    } else {
                        (wheels_m_s + SPUN_UP_M_S2 * TICK_S).min(2.5)
                    };
                    felt.update(if lands { blow_m_s / (2.0 * TICK_S) } else { 0.0 });
                    let unexplained = (felt.value() - axle.update(wheels_m_s)) / G;
                    if !k.is_multiple_of(u16::from(INTERVAL_TICKS)) {
                        continue;
                    }
                    let told = facing.update(&Shown {
                        relative_rad_s: wheels_m_s / RADIUS_M,
                        unexplained,
                        sideways_m_s2: 0.0,
                        weighs: grounded_ticks >= WEIGHS_TICKS,
                        slides: false,
                    });
                    assert!(
                        !told,
                        "slowed by {slowed_m_s} m/s, a blow of {blow_m_s} m/s: told in tick {k}"
                    );
                }
            }
        }
    }

    /// Wheels that grip again look like a mirrored IMU with more than half a g. The watch finds a mirrored IMU even in
    /// what looks like a slide.
    #[test]
    fn in_a_slide_only_what_is_below_half_a_g_tells() {
        for (amplitude_m_s2, slides, expected) in [(30.0, true, false), (30.0, false, true), (2.0, true, true)] {
            let mut bench = Bench::new();
            // Until then the largest acceleration falls to no less than half a g.
            bench.slides = slides;
            let told = bench.told(amplitude_m_s2, -2.0, 110);
            assert_eq!(told.is_some(), expected, "{amplitude_m_s2}, {slides}");
        }
    }

    /// An IMU that has shown that it faces forward is not blamed for a slide, until the vehicle has been disarmed.
    #[test]
    fn an_imu_that_faces_forward_is_not_blamed_for_a_slide() {
        let mut bench = Bench::new();
        assert_eq!(bench.told(4.0, 0.0, 500), None);
        bench.slides = true;
        assert_eq!(bench.told(2.0, -2.0, 3000), None);
        bench.facing.reset(0.0);
        assert!(bench.told(2.0, -2.0, 500).is_some());
        // Motion that is too small to show a mirrored IMU does not show that the IMU faces forward either.
        let mut bench = Bench::new();
        assert_eq!(bench.told(0.8, 0.0, 3000), None);
        bench.slides = true;
        assert!(bench.told(2.0, -2.0, 500).is_some());
    }

    /// A motion that shakes the IMU sideways as much as forward is a vibration. A steady side force, as in a bend, is
    /// not.
    #[test]
    fn a_vibration_that_the_law_answers_tells_nothing() {
        for (sideways, expected) in [(0.0, true), (0.9, true), (1.3, false), (-2.0, false)] {
            let mut bench = Bench::new();
            bench.sideways = sideways;
            assert_eq!(bench.told(5.0, -2.0, 2000).is_some(), expected, "{sideways}");
        }
    }

    /// An arm angle that is wrong by 17 degrees while the vehicle accelerates steadily gives a steady error, too.
    #[test]
    fn what_is_steady_tells_nothing() {
        let mut bench = Bench::new();
        let mut relative_rad_s = 0.0;
        for k in 0..1000_u16 {
            let grown = (f32::from(k) * 0.002).min(1.0);
            relative_rad_s += 0.15 * grown * G / RADIUS_M * INTERVAL_S;
            assert!(!bench.interval(relative_rad_s, 0.0, -0.3 * grown), "{k}");
        }
    }
}
