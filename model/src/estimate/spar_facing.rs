//! Detects a spar IMU that faces backward: the IMU must show the motion that ballast and axle cause.
//!
//! The spar's own equation (7.12, about the levelled spar, the axle accelerating by `a` g, the far side of the bearing on the
//! arm) does not contain the motor, because the ballast motor acts between spar and ballast:
//!
//! ```text
//! (m1 + m2 + 2 m3) psi'' + (k1 + k2) psi = -(m2 + m3) gamma'' - k2 gamma - (k1 + k2) a + zeta (phi' - psi')
//! ```
//!
//! The watch neglects the bearing's zeta, whose term is small.
//!
//! The spar IMU shows the left side, the answer. The encoders of ballast and wheels show the right side, the drive.
//! With an IMU that is mounted half a turn about its z axis the left side changes its sign: the law drives the spar
//! away from level and throws the ballast. The answer should therefore equal the drive or minus the drive, and the
//! watch compares the mean squares of `answer - drive` and `answer + drive`. Another push on the spar, by a hand or the
//! wind, adds to the answer before the ballast follows, and makes both differences non-zero. An IMU that is mounted a
//! quarter of a turn shows no answer: see [`exchanged`](super::exchanged).

use super::facing::{INTERVAL_S, MEAN_GAIN, STEADY_TIME_CONSTANT_S};
use super::rate_filter::LowPass;
use crate::persistence::Persistence;
use crate::vehicle::Vehicle;

/// The evidence of one tick of an armed vehicle about its spar.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SparShown {
    /// The spar's angle from the vertical by its IMU, rad.
    pub spar_rad: f32,
    /// The spar's angular acceleration, rad/s^2.
    pub spar_rad_s2: f32,
    /// Angle of the ballast relative to the spar by the ballast's encoder, rad.
    pub ballast_rad: f32,
    /// Rate of that angle, rad/s.
    pub ballast_rate_rad_s: f32,
    /// Horizontal acceleration of the axle by the wheels, over g.
    pub axle_g: f32,
    /// The arm IMU's horizontal acceleration less the wheels', over g.
    pub unexplained: f32,
    /// Whether the arm's accelerometer has felt about the weight for some time: for a moment after a blow the spar swings by the
    /// blow, and the filters of spar, ballast and wheels lag behind each other.
    pub weighs: bool,
}

/// The watch for a spar IMU that faces backward.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SparFacing {
    /// The weight moments of spar and ballast, 1/s^2, and the ballast's inertia, all over the spar's inertia.
    weight_per_s2: f32,
    ballast_weight_per_s2: f32,
    ballast_inertia: f32,
    ballast_rate: LowPass,
    steady_answer: LowPass,
    steady_drive: LowPass,
    /// Mean squares of the residuals under the two hypotheses: the IMU faces forward, or backward.
    forward: f32,
    backward: f32,
    mirrored: Persistence,
}

/// Least mean square, (rad/s^2)^2, of the residual under the hypothesis of a forward-facing IMU: that of 5 rad/s^2,
/// twice the effect of a ballast that has swung by 0.15 rad.
const LEFT_OVER_MIN: f32 = 5.0 * 5.0;
/// Largest share of that mean square in the residual under the hypothesis of a backward-facing IMU: a fifth of the
/// amplitude. A hand's push that the ballast has half countered would leave as small a residual for a moment.
const SPAR_MIRRORED_SHARE: f32 = 0.04;
/// Intervals for which only the backward hypothesis must explain the readings: 45 ms.
const SPAR_MIRRORED_INTERVALS: u16 = 9;
/// Largest difference between wheels and arm IMU in the axle's acceleration, as rad/s^2 of the spar and as a share of
/// the drive. Beyond this difference, where wheels slide or on a blow, the spar feels another acceleration than the
/// wheels show, and the evidence does not count.
const DOUBT_RAD_S2: f32 = 1.0;
const DOUBT_SHARE: f32 = 0.1;
/// Time constant of the ballast's acceleration, s: together with the filter of the ballast's encoder, the delay equals
/// that of the spar's acceleration.
const BALLAST_TIME_CONSTANT_S: f32 = 0.003;
/// Angles of spar and ballast within which the watch treats the equation as linear, rad.
const SPAR_MAX_RAD: f32 = 0.6;
const BALLAST_MAX_RAD: f32 = 1.3;

impl SparFacing {
    /// A watch for the spar of `vehicle`; `None` without a spar.
    pub fn new(vehicle: &Vehicle<f32>) -> Option<Self> {
        let c = vehicle.camera()?.coefficients();
        let time_s = vehicle.spar_scales()?.time_s;
        let inertia = c.m1 + c.m2 + 2.0 * c.m3;
        Some(Self {
            weight_per_s2: (c.k1 + c.k2) / (inertia * time_s * time_s),
            ballast_weight_per_s2: c.k2 / (inertia * time_s * time_s),
            ballast_inertia: (c.m2 + c.m3) / inertia,
            ballast_rate: LowPass::new(INTERVAL_S, BALLAST_TIME_CONSTANT_S),
            steady_answer: LowPass::new(INTERVAL_S, STEADY_TIME_CONSTANT_S),
            steady_drive: LowPass::new(INTERVAL_S, STEADY_TIME_CONSTANT_S),
            forward: 0.0,
            backward: 0.0,
            mirrored: Persistence::new(SPAR_MIRRORED_INTERVALS),
        })
    }

    /// Updates the watch with one interval. Returns whether the IMU has shown for a while that it faces backward.
    #[inline]
    pub fn update(&mut self, shown: &SparShown) -> bool {
        let ballast_rad_s2 = self.ballast_rate.update(shown.ballast_rate_rad_s);
        let answer = shown.spar_rad_s2 + self.weight_per_s2 * shown.spar_rad;
        let drive = -self.ballast_inertia * ballast_rad_s2
            - self.ballast_weight_per_s2 * shown.ballast_rad
            - self.weight_per_s2 * shown.axle_g;
        self.steady_answer.update(answer);
        self.steady_drive.update(drive);
        let linear = shown.spar_rad.abs() < SPAR_MAX_RAD && shown.ballast_rad.abs() < BALLAST_MAX_RAD;
        let doubt = self.weight_per_s2 * shown.unexplained.abs();
        if shown.weighs && linear && doubt < DOUBT_RAD_S2 + DOUBT_SHARE * drive.abs() {
            let (answer, drive) = (answer - self.steady_answer.value(), drive - self.steady_drive.value());
            let mean = |mean: &mut f32, error: f32| *mean += MEAN_GAIN * (error * error - *mean);
            mean(&mut self.forward, answer - drive);
            mean(&mut self.backward, answer + drive);
        }
        let is_mirrored = self.forward > LEFT_OVER_MIN && self.backward < SPAR_MIRRORED_SHARE * self.forward;
        self.mirrored.update(shown.weighs && is_mirrored)
    }

    /// Restarts the watch, when nothing drives the ballast or the IMU is not believed.
    pub fn reset(&mut self) {
        self.ballast_rate.reset(0.0);
        self.steady_answer.reset(0.0);
        self.steady_drive.reset(0.0);
        [self.forward, self.backward] = [0.0; 2];
        self.mirrored.update(false);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sample::TICK_S;
    use crate::vehicle::test_vehicle::reference;

    /// The spar of the reference vehicle, integrated with its full equation (7.12). The test prescribes the ballast's
    /// motion.
    struct Bench {
        watch: SparFacing,
        spar: [f64; 2],
        spar_rate: LowPass,
        ballast_rate: LowPass,
        ticks: u32,
        /// The axle's true acceleration, and the acceleration that the wheels and the arm IMU show, g.
        axle_g: f64,
        shown_g: f32,
        unexplained: f32,
        weighs: bool,
        /// A push on the spar, rad/s^2.
        push_rad_s2: f64,
    }

    impl Bench {
        fn new() -> Self {
            Self {
                watch: SparFacing::new(&reference()).expect("it has a spar"),
                spar: [0.0; 2],
                // With the delays of the tilt estimate and of the encoder's filter.
                spar_rate: LowPass::new(TICK_S, 0.01),
                ballast_rate: LowPass::new(TICK_S, 0.008),
                ticks: 0,
                axle_g: 0.0,
                shown_g: 0.0,
                unexplained: 0.0,
                weighs: true,
                push_rad_s2: 0.0,
            }
        }

        /// One interval with a ballast at `ballast` (angle, rate, acceleration), and an IMU that shows `way` times the spar.
        fn interval(&mut self, ballast: impl Fn(f64) -> [f64; 3], way: f32) -> bool {
            let camera = reference().camera().expect("a spar").cast::<f64>();
            let c = camera.coefficients();
            let time_s = f64::from(reference().spar_scales().expect("a spar").time_s);
            let (mut gamma, mut spar_rad_s2) = ([0.0; 3], 0.0);
            for _ in 0..super::super::facing::INTERVAL_TICKS {
                self.ticks += 1;
                gamma = ballast(f64::from(TICK_S) * f64::from(self.ticks));
                let [angle, rate, acceleration] = gamma;
                let [psi, psi_rate] = self.spar;
                // The full equation: kinetic terms that depend on the ballast's angle, weights as sines.
                let mass = c.m1 + c.m2 + 2.0 * c.m3 * angle.cos();
                let coupling = c.m2 + c.m3 * angle.cos();
                let t2 = time_s * time_s;
                let swing = c.m3 * angle.sin() * (2.0 * psi_rate * rate + rate * rate) * t2;
                let weight = c.k1 * psi.sin() + c.k2 * (psi + angle).sin();
                let base = (c.k1 * psi.cos() + c.k2 * (psi + angle).cos()) * self.axle_g;
                let damping = camera.zeta * psi_rate * time_s;
                let psi2 =
                    (swing - coupling * acceleration * t2 - weight - base - damping) / (mass * t2) + self.push_rad_s2;
                self.spar = [psi + f64::from(TICK_S) * psi_rate, psi_rate + f64::from(TICK_S) * psi2];
                spar_rad_s2 = self.spar_rate.update(way * self.spar[1] as f32);
                self.ballast_rate.update(gamma[1] as f32);
            }
            self.watch.update(&SparShown {
                spar_rad: way * self.spar[0] as f32,
                spar_rad_s2,
                ballast_rad: gamma[0] as f32,
                ballast_rate_rad_s: self.ballast_rate.value(),
                axle_g: self.shown_g,
                unexplained: self.unexplained,
                weighs: self.weighs,
            })
        }
    }

    /// A ballast that swings by `size` rad, from rest.
    fn swings(size: f64, omega: f64) -> impl Fn(f64) -> [f64; 3] {
        move |t| {
            let (sin, cos) = (omega * t).sin_cos();
            [size * (1.0 - cos), size * omega * sin, size * omega * omega * cos]
        }
    }

    #[test]
    fn a_mirrored_imu_is_told_by_the_ballasts_first_swing_and_an_upright_one_never() {
        for (size, omega) in [(0.3, 8.0), (-0.4, 6.0), (0.25, 12.0)] {
            let told = |way: f32| {
                let mut bench = Bench::new();
                (1..=500).find(|_| bench.interval(swings(size, omega), way))
            };
            let found = told(-1.0);
            let period = (2.0 * core::f64::consts::PI / omega / f64::from(INTERVAL_S)) as u16;
            assert!(
                found.is_some_and(|k| (SPAR_MIRRORED_INTERVALS..=period).contains(&k)),
                "{size} rad at {omega} rad/s: {found:?}"
            );
            for way in [1.0, 0.8, 1.2, 0.0] {
                assert_eq!(told(way), None, "{size} rad at {omega} rad/s, {way}");
            }
        }
    }

    /// The axle speeds up and slows down: the spar swings, and the IMU agrees with the wheels. That alone
    /// shows a mirrored IMU.
    #[test]
    fn the_axles_acceleration_tells_too() {
        for (way, expected) in [(1.0, false), (-1.0, true)] {
            let mut bench = Bench::new();
            let found = (0..400_u16).find(|k| {
                let angle = 5.0 * INTERVAL_S * f32::from(*k);
                bench.axle_g = f64::from(0.2 * libm::sinf(angle));
                // With the delay of the wheels' measurement.
                bench.shown_g = 0.2 * libm::sinf(angle - 5.0 * 0.028);
                bench.interval(|_| [0.0; 3], way)
            });
            assert_eq!(found.is_some(), expected, "{way}: {found:?}");
        }
    }

    /// Spinning wheels accelerate while the axle does not, so neither the arm's accelerometer nor the spar feels an
    /// acceleration.
    #[test]
    fn what_wheels_and_arm_do_not_agree_on_tells_nothing() {
        for (unexplained, expected) in [(0.5, false), (-0.4, false), (0.04, true)] {
            let mut bench = Bench::new();
            bench.unexplained = unexplained;
            let found = (0..200_u16).find(|_| bench.interval(swings(0.3, 8.0), -1.0));
            assert_eq!(found.is_some(), expected, "{unexplained}");
        }
    }

    /// A blow ends the evidence, also that of the moment before: a finding that was almost certain before the blow is not
    /// reported because of it.
    #[test]
    fn a_blow_tells_nothing() {
        let mut bench = Bench::new();
        let told = (0..200_u16).find(|_| bench.interval(swings(0.3, 8.0), -1.0));
        for before in [told.expect("a mirrored IMU") - 1, 0] {
            let mut bench = Bench::new();
            assert!((0..before).all(|_| !bench.interval(swings(0.3, 8.0), -1.0)));
            bench.weighs = false;
            assert!((0..200_u16).all(|_| !bench.interval(swings(0.3, 8.0), -1.0)));
        }
    }

    /// Beyond a quarter turn of the ballast the equation no longer describes the pull of its weight.
    #[test]
    fn large_angles_tell_nothing() {
        let mut bench = Bench::new();
        let far = |t: f64| {
            let [angle, rate, acceleration] = swings(0.3, 8.0)(t);
            [1.4 + angle, rate, acceleration]
        };
        assert!((0..200_u16).all(|_| !bench.interval(far, -1.0)));
    }

    /// A hand pushes the spar, and the ballast counters half of the push, the whole push, and more than the push.
    #[test]
    fn a_push_that_the_ballast_counters_is_no_mirrored_imu() {
        for lag_s in [0.03, 0.1] {
            for share in [0.5, 1.0, 1.5] {
                for push in [5.0, 20.0] {
                    let mut bench = Bench::new();
                    bench.push_rad_s2 = push;
                    // Effect of the ballast's weight: 17.1 rad/s^2 per rad.
                    let most = (share * push / 17.1_f64).min(1.2);
                    let follows = |t: f64| {
                        let decay = (-t / lag_s).exp();
                        [
                            most * (1.0 - decay),
                            most / lag_s * decay,
                            -most / (lag_s * lag_s) * decay,
                        ]
                    };
                    let found = (0..300_u16).find(|_| bench.interval(follows, 1.0));
                    assert_eq!(found, None, "{push} rad/s^2, {share} of it in {lag_s} s");
                }
            }
        }
    }

    #[test]
    fn a_reset_forgets_what_was() {
        let mut bench = Bench::new();
        for _ in 0..20 {
            bench.interval(swings(0.3, 8.0), -1.0);
        }
        bench.watch.reset();
        assert_eq!(bench.watch, Bench::new().watch);
    }
}
