//! Stage 2 of a vehicle that stands, falls, swings and is blocked: flags and thresholds, each from both sides.

use super::super::estimate::Estimator;
use super::{feels, reference, sensed_at_rest};
use crate::estimate::Estimate;
use crate::estimate::stall::Intent;
use crate::estimate::tilt::TiltReading;
use crate::sensed::Sensed;
use crate::supervise::supervisor::Believed;

/// The estimator with what stage 1 shows it.
pub(super) struct Bench {
    pub(super) estimator: Estimator,
    pub(super) sensed: Sensed,
    pub(super) believed: Believed,
    pub(super) disarmed: bool,
    pub(super) intent: Intent,
}

impl Bench {
    pub(super) fn new() -> Self {
        let mut sensed = sensed_at_rest();
        sensed.arm = feels([0.0, 1.0]);
        sensed.spar = feels([0.0, 1.0]);
        Self {
            estimator: Estimator::new(&reference()),
            sensed,
            believed: Believed::ALL,
            disarmed: true,
            intent: Intent::default(),
        }
    }

    /// Calibrated on the level, then armed with wheels that turn a little.
    pub(super) fn driving() -> Self {
        let mut bench = Self::new();
        bench.ticks(600);
        bench.disarmed = false;
        bench.sensed.relative_rate_rad_s = [0.1; 3];
        bench.ticks(20);
        bench
    }

    /// Commands a vehicle that stands to drive `way`.
    fn told(&mut self, way: f32) {
        self.intent.target_m_s = 0.0;
        self.ticks(100);
        self.intent = Intent {
            target_m_s: 0.5 * way,
            reference_m_s: 0.5 * way,
            ..Intent::default()
        };
    }

    /// Swings the arm out by a sine of 0.3: as on a slope of 0.3 * 0.72 / (1 + S).
    fn arm_out(&mut self, way: f32) {
        self.sensed.arm.rate_rad_s = way * 0.3 / 0.1;
        self.ticks(100);
        self.sensed.arm = feels([way * libm::sinf(0.3), libm::cosf(0.3)]);
    }

    pub(super) fn tick(&mut self) -> Estimate {
        if self.sensed.relative_rate_rad_s[0] != 0.0 {
            // Wheels that turn go on counting.
            self.sensed.encoder_counts[0] += 3;
            self.sensed.encoder_counts[1] += 3;
        }
        self.estimator
            .step(&self.sensed, self.believed, self.disarmed, self.intent)
    }

    pub(super) fn ticks(&mut self, ticks: u32) -> Estimate {
        (1..ticks).for_each(|_| {
            self.tick();
        });
        self.tick()
    }
}

/// The vehicle is at rest after 100 ticks and calibrated after 500. Biases of 0.02 rad/s show as motion before, and not after.
#[test]
fn a_vehicle_that_stands_is_at_rest_and_calibrates_in_time() {
    let mut bench = Bench::new();
    bench.sensed.arm.rate_rad_s = 0.02;
    bench.sensed.arm_gyro_xz_rad_s = [-0.01, 0.03];
    for tick in 1..=500 {
        let estimate = bench.tick();
        assert_eq!(estimate.at_rest, tick >= 100, "{tick}");
        assert_eq!(estimate.calibrated, tick == 500, "{tick}");
        assert_eq!((estimate.heading_rad, estimate.yaw_rate_rad_s), (0.0, 0.0), "{tick}");
    }
    let calibrated = bench.tick();
    let estimate = bench.ticks(2000);
    assert!((estimate.gyro_bias_rad_s - 0.02).abs() < 1e-4, "{estimate:?}");
    assert!(estimate.phi_rate_rad_s.abs() < 1e-4 && estimate.phi_rad.abs() < 1e-4);
    assert!(estimate.heading_rad.abs() < 1e-4 && estimate.yaw_rate_rad_s.abs() < 1e-5);
    assert!(
        (estimate.distance_m - calibrated.distance_m).abs() < 1e-4,
        "a bias moves nothing"
    );
}

/// A vehicle is at rest when its wheels turn below 0.03 rad/s, and its arm below 0.05 rad/s, or below 0.1 rad/s until its gyro's
/// bias is known.
#[test]
fn what_moves_is_not_at_rest() {
    for (wheel_rad_s, arm_rad_s, calibrated, expected) in [
        (0.0, 0.049, true, true),
        (0.0, -0.051, true, false),
        (0.0, 0.051, true, false),
        (0.0, 0.09, false, true),
        (0.0, 0.11, false, false),
        (0.029, 0.0, true, true),
        (0.031, 0.0, true, false),
    ] {
        for wheel in 0..2 {
            let mut bench = Bench::new();
            if calibrated {
                bench.ticks(500);
            }
            bench.sensed.relative_rate_rad_s[wheel] = wheel_rad_s;
            bench.sensed.arm.rate_rad_s = arm_rad_s;
            // A moving estimate of the bias would move the bound.
            bench.disarmed = false;
            let at_rest = (0..100).fold(false, |_, _| {
                if wheel_rad_s != 0.0 {
                    // A wheel that turns goes on counting.
                    bench.sensed.encoder_counts[wheel] += 2;
                }
                bench
                    .estimator
                    .step(&bench.sensed, Believed::ALL, bench.disarmed, bench.intent)
                    .at_rest
            });
            assert_eq!(at_rest, expected, "{wheel_rad_s} {arm_rad_s} {calibrated}");
        }
    }
}

/// On a slope the arm hangs off the wheels' vertical from the start, and the gyro is at rest all the same: after a boot, and after
/// a change of the parameters.
#[test]
fn a_vehicle_on_a_slope_calibrates_in_the_same_time() {
    for sin_phi in [0.7_f32, 0.2, -0.2, -0.7] {
        for bias_rad_s in [0.0, 0.02, -0.05] {
            let mut bench = Bench::new();
            bench.sensed.arm = TiltReading {
                rate_rad_s: bias_rad_s,
                ..feels([sin_phi, (1.0 - sin_phi * sin_phi).sqrt()])
            };
            assert!(!bench.ticks(499).calibrated);
            let estimate = bench.tick();
            assert!(estimate.calibrated, "{sin_phi} {bias_rad_s}");
            let estimate = bench.ticks(1000);
            assert!(
                (estimate.gyro_bias_rad_s - bias_rad_s).abs() < 1e-4,
                "{sin_phi} {bias_rad_s}"
            );
            assert!(
                (estimate.phi_rad - sin_phi.asin()).abs() < 1e-4,
                "{sin_phi} {bias_rad_s}"
            );
        }
    }
}

/// Only while nothing drives does the estimator calibrate at rest, and take it that the ballast hangs down.
#[test]
fn an_armed_vehicle_that_stands_neither_calibrates_nor_lets_its_ballast_hang() {
    let mut bench = Bench::new();
    bench.disarmed = false;
    bench.sensed.ballast_turned_rad = 0.3;
    let estimate = bench.ticks(1000);
    assert!(estimate.at_rest && !estimate.calibrated);
    assert_eq!(estimate.ballast_rad, 0.3);
    bench.disarmed = true;
    let estimate = bench.ticks(1000);
    assert!(estimate.calibrated);
    assert_eq!(estimate.ballast_rad, 0.0);
    bench.disarmed = false;
    bench.sensed.ballast_turned_rad = 0.4;
    assert!((bench.tick().ballast_rad - 0.1).abs() < 1e-6);
}

/// An idle ballast hangs along the vertical, so its angle relative to a tilted spar is the negative of the spar's. The estimator
/// learns the gyro's bias of the spar's IMU apart from the arm's.
#[test]
fn the_spars_angle_and_bias_are_its_own() {
    let mut bench = Bench::new();
    bench.sensed.spar = TiltReading {
        rate_rad_s: -0.03,
        ..feels([0.2_f32.sin(), 0.2_f32.cos()])
    };
    let estimate = bench.ticks(600);
    assert!((estimate.spar_rad - 0.2).abs() < 1e-4, "{}", estimate.spar_rad);
    assert!((estimate.ballast_rad + 0.2).abs() < 1e-4, "{}", estimate.ballast_rad);
    assert!(estimate.spar_rate_rad_s.abs() < 1e-4 && estimate.gyro_bias_rad_s.abs() < 1e-5);
    bench.disarmed = false;
    bench.sensed.ballast_turned_rad += 0.5;
    bench.sensed.relative_rate_rad_s[2] = 1.5;
    let estimate = bench.tick();
    assert!((estimate.ballast_rad - 0.3).abs() < 1e-3, "{}", estimate.ballast_rad);
    assert_eq!(estimate.ballast_rate_rad_s, 1.5);
}

/// An IMU that gives no new reading adds nothing to its average. Each IMU's age counts for that IMU alone.
#[test]
fn each_imu_calibrates_from_its_own_new_readings() {
    let mut bench = Bench::new();
    bench.sensed.arm_imu.age_us = 2000;
    assert!(!bench.ticks(600).calibrated);
    let mut bench = Bench::new();
    bench.sensed.arm_imu.age_us = 1999;
    bench.sensed.spar_imu.age_us = 2000;
    bench.sensed.spar.rate_rad_s = 0.05;
    let estimate = bench.ticks(600);
    assert!(estimate.calibrated, "the spar's IMU blocks nothing");
    assert!(estimate.spar_rate_rad_s.abs() > 1e-3, "{}", estimate.spar_rate_rad_s);
    bench.sensed.spar_imu.age_us = 1999;
    let estimate = bench.ticks(500);
    assert!(estimate.spar_rate_rad_s.abs() < 1e-4, "{}", estimate.spar_rate_rad_s);
}

/// A vehicle has stopped when it is slower than 0.05 m/s and 0.2 rad/s, with the arm within a sine of 0.15 of where it hangs at
/// rest.
#[test]
fn stopped_is_slow_with_the_arm_lowered() {
    for (speed_m_s, arm_rad_s, sin_phi, expected) in [
        (0.049, 0.0, 0.0, true),
        (-0.049, 0.0, 0.0, true),
        (0.051, 0.0, 0.0, false),
        (-0.051, 0.0, 0.0, false),
        (0.0, 0.199, 0.0, true),
        (0.0, 0.201, 0.0, false),
        (0.0, -0.201, 0.0, false),
        (0.0, 0.0, 0.145, true),
        (0.0, 0.0, 0.155, false),
        (0.0, 0.0, -0.145, true),
        (0.0, 0.0, -0.155, false),
    ] {
        let mut bench = Bench::driving();
        // Weightless, so that nothing but the gyro moves the arm.
        bench.sensed.arm = feels([0.0, 0.0]);
        bench.ticks(30);
        let swing_rad = libm::asinf(sin_phi) - bench.tick().phi_rad;
        bench.sensed.arm.rate_rad_s = swing_rad / 0.02;
        bench.ticks(20);
        bench.sensed.arm.rate_rad_s = arm_rad_s;
        // The wheels' rate is the encoders' rate less the arm's.
        let relative_rad_s = speed_m_s / 0.25 + arm_rad_s;
        bench.sensed.relative_rate_rad_s = [relative_rad_s, relative_rad_s, 0.0];
        let estimate = bench.tick();
        assert!((estimate.phi_rad.sin() - sin_phi).abs() < 2e-3, "{}", estimate.phi_rad);
        assert_eq!(estimate.stopped, expected, "{speed_m_s} {arm_rad_s} {sin_phi}");
    }
}

/// The accelerometer corrects the arm's angle only while its mean force is 0.5 g to 2 g, and again after 30 ticks within these.
#[test]
fn a_vehicle_that_falls_or_lands_does_not_believe_its_accelerometer() {
    for (force_g, believed) in [(0.49, false), (0.51, true), (1.99, true), (2.01, false)] {
        for direction in [[0.6, 0.8], [-0.8, 0.6]] {
            let mut bench = Bench::driving();
            bench.sensed.arm = feels(direction.map(|share| share * force_g));
            // Seven time constants of the mean.
            let before = bench.ticks(105).phi_rad;
            let after = bench.ticks(30).phi_rad;
            // Thirty corrections are 225 urad; the gyro's bias that was learnt before turns the arm by some 10.
            let corrected = (after - before).abs() > 1e-4;
            assert_eq!(corrected, believed, "{force_g} g along {direction:?}");
        }
    }
    let mut bench = Bench::driving();
    bench.sensed.arm = feels([0.0, 0.0]);
    let mut before = bench.ticks(50).phi_rad;
    bench.sensed.arm = feels([0.3, 0.95]);
    // The mean is half the weight after ln(2) of its 15 ms: in the tenth tick, with what was left of the weight before.
    for tick in 1..=39 {
        // A tick corrects by 7.5 urad.
        let after = bench.tick().phi_rad;
        assert_eq!((after - before).abs() > 4e-6, tick == 39, "{tick}");
        before = after;
    }
}

/// Gyro and accelerometer contradict each other when they differ by a sine of 0.7, either way, for 300 ticks. The accelerometer is
/// delayed as the wheels are, so that a difference of 0.75 takes up to 100 ticks more to show.
#[test]
fn gyro_and_accelerometer_contradict_each_other_in_300_ticks() {
    for (sine, expected) in [(0.75_f32, true), (-0.75, true), (0.69, false), (-0.69, false)] {
        let mut bench = Bench::driving();
        bench.sensed.arm = feels([sine, (1.0 - sine * sine).sqrt()]);
        let told = (1..=600).find(|_| bench.tick().contradicted);
        assert_eq!(told.is_some(), expected, "{sine}");
        assert!(told.is_none_or(|tick| (300..=400).contains(&tick)), "{sine}: {told:?}");
        bench.sensed.arm = feels([0.0, 1.0]);
        assert!(!bench.ticks(100).contradicted);
    }
}

/// A blocked vehicle: after 700 ticks without motion the reported slope stays that of the ground, while the laws
/// carry the obstacle like a hill. Once a stop is commanded, the laws carry the ground again.
#[test]
fn a_blocked_vehicle_tells_so_and_keeps_the_slope_of_the_ground() {
    for way in [1.0_f32, -1.0] {
        let mut bench = Bench::driving();
        bench.told(way);
        bench.sensed.relative_rate_rad_s = [0.0; 3];
        bench.arm_out(way);
        let mut stalled_after = None;
        for tick in 101..=1500 {
            let estimate = bench.tick();
            if estimate.stalled && stalled_after.is_none() {
                stalled_after = Some(tick);
            }
            if estimate.stalled {
                assert!(estimate.slope_rad.abs() < 0.01, "{}", estimate.slope_rad);
            }
        }
        assert!(
            stalled_after.is_some_and(|tick| (799..=803).contains(&tick)),
            "{stalled_after:?}"
        );
        let hill = bench.tick().sin_slope;
        assert!(hill * way > 0.1, "{hill}");
        bench.intent = Intent::default();
        let estimate = bench.ticks(2);
        assert!(!estimate.stalled);
        assert!(estimate.sin_slope.abs() < 0.01, "{}", estimate.sin_slope);
        assert!(!estimate.stopped, "the arm still stands out");
        // Disarmed, the obstacle is forgotten.
        bench.disarmed = true;
        bench.tick();
        bench.disarmed = false;
        bench.intent.reference_m_s = 0.5 * way;
        bench.intent.target_m_s = 0.5 * way;
        assert!(!bench.tick().stalled);
    }
}

/// On the way, the estimator notes the slope of the ground. An obstacle on a hill stands on that slope.
#[test]
fn an_obstacle_on_a_hill_stands_on_the_hill() {
    for way in [1.0_f32, -1.0] {
        let mut bench = Bench::driving();
        bench.told(way);
        bench.sensed.relative_rate_rad_s = [2.0 * way, 2.0 * way, 0.0];
        bench.sensed.relative_advance_rad = [0.002 * way, 0.002 * way, 0.0];
        bench.arm_out(way);
        let hill_rad = bench.ticks(3000).slope_rad;
        assert!(hill_rad * way > 0.1, "{hill_rad}");
        bench.sensed.relative_rate_rad_s = [0.0; 3];
        bench.sensed.relative_advance_rad = [0.0; 3];
        let estimate = bench.ticks(1000);
        assert!(estimate.stalled);
        assert!(
            (estimate.slope_rad - hill_rad).abs() < 0.02,
            "{} of {hill_rad}",
            estimate.slope_rad
        );
    }
}

/// A new estimator takes over the pose and the heading of the one before, and calibrates anew.
#[test]
fn an_estimator_takes_over_the_pose_of_another_one() {
    let mut bench = Bench::driving();
    bench.sensed.relative_rate_rad_s = [3.0, 5.0, 0.0];
    bench.sensed.relative_advance_rad = [0.003, 0.005, 0.0];
    bench.sensed.arm_gyro_xz_rad_s = [0.0, 1.0];
    // The ground gives the turn its 1 m/s times 1 rad/s.
    bench.sensed.arm_force_y_m_s2 = 1.0;
    let before = bench.ticks(500);
    assert!(
        before.x_m > 0.3 && before.y_m > 0.1 && before.heading_rad > 0.4,
        "{before:?}"
    );
    bench.estimator = Estimator::new(&reference()).with_pose_of(&bench.estimator);
    bench.sensed.relative_rate_rad_s = [0.0; 3];
    bench.sensed.relative_advance_rad = [0.0; 3];
    bench.sensed.arm_gyro_xz_rad_s = [0.0; 2];
    bench.sensed.arm_force_y_m_s2 = 0.0;
    bench.disarmed = true;
    let after = bench.tick();
    assert_eq!(
        (after.x_m, after.y_m, after.heading_rad, after.distance_m),
        (before.x_m, before.y_m, before.heading_rad, before.distance_m)
    );
    assert!(!after.calibrated);
    // The next advance goes along the heading that was taken over, not along the mean of that heading and 0.
    bench.sensed.relative_advance_rad = [0.04, 0.04, 0.0];
    let on = bench.tick();
    // The same holds for the advance of a new estimator's first tick.
    bench.estimator = Estimator::new(&reference()).with_pose_of(&bench.estimator);
    let first = bench.tick();
    for (from, to) in [(after, on), (on, first)] {
        let along = libm::atan2f(to.y_m - from.y_m, to.x_m - from.x_m);
        assert!((along - before.heading_rad).abs() < 1e-3, "{along}");
    }
}
