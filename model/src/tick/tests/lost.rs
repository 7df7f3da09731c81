//! Stage 2 of a vehicle whose sensors were lost for a while, or whose gyros' biases changed.

use super::feels;
use super::rest::Bench;
use crate::estimate::tilt::TiltReading;
use crate::supervise::supervisor::Believed;

const ARM_LOST: Believed = Believed {
    arm_imu: false,
    ..Believed::ALL
};

/// While the vehicle is armed, an IMU that feels its weight from above contradicts itself within 40 ticks, although the sine of
/// 180 degrees is 0. Hands may turn a disarmed vehicle over: there the same reading shows how the vehicle lies.
#[test]
fn an_imu_that_is_upside_down_is_told_while_the_vehicle_is_armed() {
    for (disarmed, expected) in [(false, Some(40)), (true, None)] {
        let mut bench = Bench::driving();
        bench.disarmed = disarmed;
        bench.sensed.arm = feels([0.0, -1.0]);
        let told = (1..=100).find(|_| bench.tick().contradicted);
        assert_eq!(told, expected, "disarmed: {disarmed}");
    }
    let mut bench = Bench::driving();
    bench.sensed.arm = feels([0.0, -1.0]);
    bench.ticks(39);
    bench.believed = ARM_LOST;
    bench.tick();
    bench.believed = Believed::ALL;
    assert!(!bench.tick().contradicted, "what was not believed is forgotten");
}

/// The same for the spar's IMU.
#[test]
fn a_spar_imu_that_is_upside_down_is_told_while_the_vehicle_is_armed() {
    for (disarmed, expected) in [(false, Some(40)), (true, None)] {
        let mut bench = Bench::driving();
        bench.disarmed = disarmed;
        bench.sensed.spar = feels([0.0, -1.0]);
        let told = (1..=100).find(|_| bench.tick().spar_contradicted);
        assert_eq!(told, expected, "disarmed: {disarmed}");
    }
    let mut bench = Bench::driving();
    bench.sensed.spar = feels([0.0, -1.0]);
    bench.ticks(39);
    bench.believed.spar_imu = false;
    bench.tick();
    bench.believed.spar_imu = true;
    assert!(!bench.tick().spar_contradicted, "what was not believed is forgotten");
}

/// An IMU that lies on its side feels its weight along the axle. The vehicle reports it before a calibration ends,
/// while nothing is armed, and for as long as the IMU lies there. An IMU that is shaken at 3 Hz, or stands on a side
/// slope of 44 degrees, does not lie on its side.
#[test]
fn an_imu_on_its_side_is_told_before_anything_is_armed() {
    for (side_g, in_plane_g, expected) in [(1.0_f32, 0.0_f32, true), (-0.8, 0.6, true), (0.69, 0.72, false)] {
        for of_spar in [false, true] {
            let mut bench = Bench::new();
            let (force, reading) = (side_g * 9.81, feels([0.0, in_plane_g]));
            if of_spar {
                (bench.sensed.spar_force_y_m_s2, bench.sensed.spar) = (force, reading);
            } else {
                (bench.sensed.arm_force_y_m_s2, bench.sensed.arm) = (force, reading);
            }
            let found = |bench: &mut Bench| {
                let estimate = bench.tick();
                [estimate.contradicted, estimate.spar_contradicted]
            };
            let mut told = None;
            for tick in 1..=1000 {
                let found = found(&mut bench);
                assert!(!found[usize::from(!of_spar)], "only one of them lies");
                if told.is_none() && found[usize::from(of_spar)] {
                    told = Some(tick);
                }
            }
            assert_eq!(told, expected.then_some(400), "{side_g} g, spar: {of_spar}");
            bench.disarmed = false;
            assert_eq!(found(&mut bench)[usize::from(of_spar)], expected);
        }
    }
    let mut bench = Bench::new();
    for tick in 0..3000_u16 {
        let shaken = 10.0 * libm::sinf(2.0 * core::f32::consts::PI * 3.0 * 0.001 * f32::from(tick));
        bench.sensed.arm_force_y_m_s2 = shaken;
        bench.sensed.arm = feels([0.0, 1.0 - shaken / 9.81]);
        assert!(!bench.tick().contradicted, "{tick}");
    }
}

/// The last reading of a lost IMU may repeat for any time. It does not count as rest, and the estimator learns neither bias nor
/// angle from it; the heading follows the wheels. When the IMU is back, the estimator calibrates it in the time that a boot takes.
#[test]
fn what_a_lost_imu_last_showed_teaches_nothing() {
    for rate_rad_s in [0.0, 0.02, -0.04, 0.9] {
        for sine in [0.3_f32, -0.5] {
            let mut bench = Bench::driving();
            let before = bench.tick();
            bench.disarmed = true;
            bench.believed = ARM_LOST;
            bench.sensed.relative_rate_rad_s = [0.0; 3];
            bench.sensed.arm = TiltReading {
                rate_rad_s,
                ..feels([sine, (1.0 - sine * sine).sqrt()])
            };
            bench.sensed.arm_gyro_xz_rad_s = [0.5, -0.4];
            let story = (rate_rad_s, sine);
            for _ in 0..3000 {
                let estimate = bench.tick();
                assert!(!estimate.at_rest && !estimate.calibrated, "{story:?}");
                assert_eq!((estimate.speed_m_s, estimate.phi_rate_rad_s), (0.0, 0.0), "{story:?}");
            }
            let estimate = bench.tick();
            assert_eq!(estimate.gyro_bias_rad_s, before.gyro_bias_rad_s, "{story:?}");
            assert_eq!(estimate.phi_rad, before.phi_rad, "{story:?}");
            assert!((estimate.heading_rad - before.heading_rad).abs() < 1e-3, "{story:?}");
            bench.sensed.relative_rate_rad_s = [-0.5, 0.5, 0.0];
            let turned = bench.ticks(1000).heading_rad - estimate.heading_rad;
            assert!(turned > 0.1, "{story:?}: turned by {turned}");

            bench.sensed.relative_rate_rad_s = [0.0; 3];
            bench.believed = Believed::ALL;
            bench.sensed.arm = TiltReading {
                rate_rad_s: 0.03,
                ..feels([0.1, 0.995])
            };
            bench.sensed.arm_gyro_xz_rad_s = [0.01, -0.02];
            let first = bench.tick();
            assert!(
                (first.phi_rad - 0.1).abs() < 1e-3,
                "{story:?}: aligned at once, {first:?}"
            );
            let estimate = bench.ticks(520);
            assert!(estimate.calibrated && estimate.at_rest, "{story:?}");
            assert!(
                (estimate.gyro_bias_rad_s - 0.03).abs() < 1e-3,
                "{story:?}: {estimate:?}"
            );
            assert!(estimate.phi_rate_rad_s.abs() < 1e-3 && estimate.yaw_rate_rad_s.abs() < 1e-3);
        }
    }
}

/// A lost IMU's accelerometer does not count: while the wheels speed up, the estimator learns no slope.
#[test]
fn wheels_that_speed_up_beside_a_lost_imu_teach_no_slope() {
    let mut bench = Bench::driving();
    bench.disarmed = true;
    bench.believed = ARM_LOST;
    let before = bench.ticks(100);
    for _ in 0..500 {
        for rate in &mut bench.sensed.relative_rate_rad_s {
            *rate += 0.02;
        }
        bench.tick();
    }
    let after = bench.tick();
    assert!(after.speed_m_s > 2.0, "{after:?}");
    assert_eq!(after.slope_rad, before.slope_rad);
}

/// An IMU that comes back while the vehicle rolls is aligned at once, and its angle's error is no slide.
#[test]
fn an_imu_that_is_back_on_a_rolling_vehicle_is_aligned_and_shows_no_slide() {
    for sine in [0.2_f32, -0.4] {
        let mut bench = Bench::driving();
        bench.disarmed = true;
        bench.believed = ARM_LOST;
        bench.ticks(300);
        bench.believed = Believed::ALL;
        bench.sensed.arm = feels([sine, (1.0 - sine * sine).sqrt()]);
        let first = bench.tick();
        assert!((first.phi_rad - sine.asin()).abs() < 1e-3, "{sine}: {first:?}");
        assert!(!first.calibrated);
        // From now on the arm's angle is wrong by this sine. If the estimator took the error for a slide, the speed would be
        // wrong by metres per second within the two seconds; a bias learnt from the error changes it by millimetres per second.
        bench.sensed.arm = feels([0.0, 1.0]);
        for tick in 0..2000 {
            let estimate = bench.tick();
            assert!(!estimate.sliding, "{sine}: after {tick} ticks");
            assert!(
                (estimate.speed_m_s - 0.1 * 0.25).abs() < 0.01,
                "{sine}: the wheels show another speed: {estimate:?}"
            );
        }
    }
}

/// The estimator keeps the bias that it found, however long the vehicle stands: a rate that the bias explains is no turn.
#[test]
fn a_bias_that_explains_what_the_gyro_shows_is_not_sought_again() {
    let mut bench = Bench::new();
    bench.sensed.arm.rate_rad_s = 0.04;
    bench.sensed.arm_gyro_xz_rad_s = [0.08, -0.07];
    assert!(bench.ticks(600).calibrated);
    for tick in 0..5000 {
        assert!(bench.tick().calibrated, "{tick}");
    }
}

/// Encoders that the vehicle does not believe show no rest: the estimator learns nothing meanwhile.
#[test]
fn wheels_whose_encoders_are_lost_do_not_stand() {
    let mut bench = Bench::new();
    bench.believed = Believed {
        encoders: false,
        ..Believed::ALL
    };
    let estimate = bench.ticks(2000);
    assert!(!estimate.at_rest && !estimate.calibrated);
    bench.believed = Believed::ALL;
    assert!(bench.ticks(500).calibrated);
}

/// The estimator corrects an angle that is wrong when the vehicle comes to rest, and takes no bias from it. With a wrong bias the
/// gyro would show a turn for ever, and the vehicle would never be at rest again.
#[test]
fn a_wrong_angle_at_rest_is_no_bias() {
    for sine in [0.02_f32, 0.1, -0.3, 0.6] {
        let mut bench = Bench::driving();
        bench.sensed.relative_rate_rad_s = [0.0; 3];
        bench.disarmed = true;
        bench.sensed.arm = feels([sine, (1.0 - sine * sine).sqrt()]);
        for tick in 1..=3000 {
            let estimate = bench.tick();
            assert!(tick <= 110 || estimate.at_rest, "{sine}: {tick}");
            // A fifth of the rate that counts as motion.
            assert!(estimate.gyro_bias_rad_s.abs() < 0.01, "{sine}: {estimate:?}");
        }
        let estimate = bench.tick();
        assert!((estimate.phi_rad - sine.asin()).abs() < 1e-3, "{sine}: {estimate:?}");
    }
}

/// The estimator finds a bias that changed while the vehicle stood in 2 s and the time of a calibration. A rate that is larger
/// than a bias can be is a turn.
#[test]
fn a_bias_that_changed_at_rest_is_found_again() {
    for (axis, bias_rad_s, found) in [
        (0, 0.07_f32, true),
        (0, -0.09, true),
        (1, 0.08, true),
        (2, -0.09, true),
        (0, 0.12, false),
    ] {
        let mut bench = Bench::new();
        assert!(bench.ticks(600).calibrated);
        let mut rates = [0.0; 3];
        rates[axis] = bias_rad_s;
        let [arm, x, z] = rates;
        bench.sensed.arm.rate_rad_s = arm;
        bench.sensed.arm_gyro_xz_rad_s = [x, z];
        bench.ticks(2600);
        let estimate = bench.tick();
        let settled = estimate.at_rest && estimate.phi_rate_rad_s.abs() < 1e-3 && estimate.yaw_rate_rad_s.abs() < 1e-3;
        assert_eq!(settled, found, "{axis} {bias_rad_s}: {estimate:?}");
        assert!(
            estimate.calibrated,
            "{axis} {bias_rad_s}: motion is no reason to calibrate anew"
        );
    }
}

/// An armed vehicle that turns slowly while its wheels stand, for example in somebody's hands, keeps its calibration.
#[test]
fn an_armed_vehicle_does_not_calibrate_anew() {
    let mut bench = Bench::new();
    assert!(bench.ticks(600).calibrated);
    bench.disarmed = false;
    bench.sensed.arm_gyro_xz_rad_s = [0.0, 0.08];
    assert!((0..3000).all(|_| bench.tick().calibrated));
}

/// The estimator aligns a spar's IMU that was lost as soon as it is back, and calibrates it at the next rest.
#[test]
fn a_spars_imu_that_was_lost_begins_anew() {
    let mut bench = Bench::new();
    bench.ticks(600);
    bench.sensed.spar.rate_rad_s = 0.02;
    assert!(bench.tick().spar_rate_rad_s > 0.01);
    bench.believed = Believed {
        spar_imu: false,
        ..Believed::ALL
    };
    bench.sensed.spar = TiltReading {
        rate_rad_s: 0.5,
        ..feels([-0.4, 0.9])
    };
    let estimate = bench.ticks(2000);
    assert!(
        estimate.spar_rad.abs() < 1e-3 && estimate.spar_rate_rad_s == 0.0,
        "{estimate:?}"
    );
    bench.believed = Believed::ALL;
    bench.sensed.spar = TiltReading {
        rate_rad_s: 0.04,
        ..feels([0.2_f32.sin(), 0.2_f32.cos()])
    };
    assert!((bench.tick().spar_rad - 0.2).abs() < 1e-3);
    assert!(bench.ticks(520).spar_rate_rad_s.abs() < 1e-3);
}
