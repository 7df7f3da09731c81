//! Sliding wheels and rolling wheels.

use super::*;

const ROLLING: Evidence = Evidence {
    wheels_m_s: 1.0,
    wheels_m_s2: 0.0,
    swing_m_s2: 0.0,
    tilt_error: 0.0,
    sideways_m_s2: 0.0,
    yaw_rate_rad_s: 0.0,
    wheels_yaw_rad_s: 0.0,
    weighs: true,
    slow: false,
};

fn after(evidence: &Evidence, ticks: usize) -> Traction {
    let mut traction = Traction::new(0.001, 0.25, AccelerometerOffset::new(2.0));
    for _ in 0..ticks {
        traction.update(evidence);
    }
    traction
}

/// Wheels that slip and grip again 4 times per second: a difference of `difference_m_s2` under a swing of 3 m/s^2, of
/// which a lag leaves a third. Returns the ticks until the watch reports a slide.
fn hunting(difference_m_s2: f32) -> Option<u16> {
    let mut traction = Traction::new(0.001, 0.25, AccelerometerOffset::new(2.0));
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
        // One wheel is 2 % larger than the other.
        Evidence {
            wheels_m_s: 2.5,
            wheels_yaw_rad_s: 0.1,
            ..ROLLING
        },
        // The vehicle turns, with 1.9 m/s^2 across the heading, on wheels that are 8 % larger than in its file.
        Evidence {
            sideways_m_s2: 0.15,
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
        // The vehicle still moves at another speed than its wheels. A difference that sliding wheels cannot have ends the slide.
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

/// The accelerometer agrees with the wheels again; only the error that the integral has gathered contradicts them.
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

/// A turn, either way, for which the ground has too little grip: it presses on the vehicle from the side with less force than
/// rolling wheels need. The estimate follows the speed that the vehicle loses.
#[test]
fn a_slide_across_the_heading_is_told() {
    for (yaw_rate_rad_s, sideways_m_s2, expected) in [
        (2.0, -0.5, true),
        (-2.0, 0.5, true),
        (0.0, 0.3, true),
        (2.0, -0.3, false),
        (0.0, -0.17, false),
    ] {
        let evidence = Evidence {
            yaw_rate_rad_s,
            wheels_yaw_rad_s: yaw_rate_rad_s,
            sideways_m_s2,
            ..ROLLING
        };
        let found = after(&evidence, 400).slides();
        assert_eq!(found, expected, "{yaw_rate_rad_s} rad/s, {sideways_m_s2} m/s^2");
    }
    let outward = Evidence {
        yaw_rate_rad_s: 1.0,
        wheels_yaw_rad_s: 1.0,
        sideways_m_s2: -1.0,
        ..ROLLING
    };
    let traction = after(&outward, 1000);
    // Without any force the speed turns to the right of the heading as the vehicle turns left.
    let [forward_m_s, left_m_s] = [traction.speed_m_s(), traction.sideways_m_s()];
    assert!((forward_m_s - libm::cosf(1.0)).abs() < 0.06, "{forward_m_s}");
    assert!((left_m_s + libm::sinf(1.0)).abs() < 0.06, "{left_m_s}");
}

/// Wheels whose radii differ by up to a tenth speed up at 2 m/s^2, on a wide track and a narrow one; then one of them slides.
#[test]
fn unequal_radii_are_no_slide_and_hide_none() {
    for half_track_m in [0.25, 0.12] {
        for share in [0.005, 0.02, 0.05, -0.1, 0.1] {
            let mut traction = Traction::new(0.001, half_track_m, AccelerometerOffset::new(2.0));
            let rolling = |tick: u16| {
                let wheels_m_s = (0.002 * f32::from(tick)).min(1.2);
                Evidence {
                    wheels_m_s,
                    yaw_rate_rad_s: share * wheels_m_s / (2.0 * half_track_m),
                    ..ROLLING
                }
            };
            for tick in 0..3000 {
                traction.update(&rolling(tick));
                assert!(!traction.slides(), "{share} of a track of {half_track_m} m, {tick} ms");
            }
            let sliding = Evidence {
                wheels_yaw_rad_s: 0.15 / half_track_m,
                ..rolling(3000)
            };
            for _ in 0..400 {
                traction.update(&sliding);
            }
            assert!(traction.slides(), "{share} of a track of {half_track_m} m");
        }
    }
}

/// A radius and a track that are each up to a tenth other than the file's, in a turn that grows at 4 rad/s^2 to 2 rad/s, on the spot
/// and at 1 m/s: no slide. Then the wheels spin half as fast again as they turn the vehicle, or the vehicle spins on by itself: a slide.
#[test]
fn a_track_other_than_the_files_is_no_slide_and_hides_none() {
    for wheels_m_s in [0.0, 1.0] {
        for share in [-0.18, -0.1, -0.06, 0.06, 0.1, 0.22] {
            for direction in [-2.0, 2.0] {
                let mut traction = Traction::new(0.001, 0.25, AccelerometerOffset::new(2.0));
                let rolling = |tick: u16| {
                    let wheels_yaw_rad_s = direction * (0.002 * f32::from(tick)).min(1.0);
                    Evidence {
                        wheels_m_s,
                        wheels_yaw_rad_s,
                        yaw_rate_rad_s: (1.0 + share) * wheels_yaw_rad_s,
                        ..ROLLING
                    }
                };
                for tick in 0..5000 {
                    traction.update(&rolling(tick));
                    assert!(
                        !traction.slides(),
                        "{share} of {direction} rad/s, {wheels_m_s} m/s, {tick} ms"
                    );
                }
                for factor in [1.5, 0.5] {
                    let mut sliding = traction;
                    let evidence = rolling(5000);
                    for _ in 0..400 {
                        sliding.update(&Evidence {
                            wheels_yaw_rad_s: factor * evidence.wheels_yaw_rad_s,
                            ..evidence
                        });
                    }
                    assert!(sliding.slides(), "{share} of {direction} rad/s, {factor} times as fast");
                }
            }
        }
    }
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

/// What tilt and roll estimate leave of an accelerometer's offset in a turn from rest on, m/s^2, by turning their errors as they do:
/// with the body, and towards the accelerometer with a time constant of 2 s. Returns whether the watch reports a slide in 20 s, of
/// which the second half turns the other way, and the largest difference that it was shown.
fn turned(offset_m_s2: [f32; 2], yaw_rate_rad_s: f32, slide_m_s2: f32) -> (Option<u16>, f32) {
    let mut traction = Traction::new(0.001, 0.25, AccelerometerOffset::new(2.0));
    let [mut forward, mut left] = offset_m_s2;
    let mut most_m_s2 = 0.0_f32;
    let told = (0..20_000_u16).find(|k| {
        let yaw = if *k < 10_000 { yaw_rate_rad_s } else { -yaw_rate_rad_s };
        let difference = [offset_m_s2[0] - forward, offset_m_s2[1] - left];
        let turned = 0.001 * yaw;
        (forward, left) = (
            forward + turned * left + 0.0005 * difference[0],
            left - turned * forward + 0.0005 * difference[1],
        );
        most_m_s2 = most_m_s2.max(difference[0].abs()).max(difference[1].abs());
        let slide_m_s2 = if *k < 15_000 { 0.0 } else { slide_m_s2 };
        traction.update(&Evidence {
            wheels_m_s: 0.2,
            tilt_error: difference[0] / G,
            sideways_m_s2: difference[1] + slide_m_s2,
            yaw_rate_rad_s: yaw,
            wheels_yaw_rad_s: yaw,
            slow: k.is_multiple_of(u16::from(super::super::facing::INTERVAL_TICKS)),
            ..ROLLING
        });
        traction.slides()
    });
    (told, most_m_s2)
}

/// The ICM-42688-P's data sheet allows 20 mg along each axis. In a turn that looks like up to 0.4 m/s^2, more than the limit of a slide.
#[test]
fn an_offset_of_the_accelerometer_is_no_slide_in_a_turn_and_hides_none() {
    let mut widest_m_s2 = 0.0_f32;
    for offset_m_s2 in [
        [0.2, 0.0],
        [0.0, -0.2],
        [0.2, 0.2],
        [-0.2, 0.2],
        [-0.1, 0.05],
        [0.0, 0.0],
    ] {
        for yaw_rate_rad_s in [0.5, -1.0, 2.0, -3.0] {
            let (told, most_m_s2) = turned(offset_m_s2, yaw_rate_rad_s, 0.0);
            assert_eq!(told, None, "{offset_m_s2:?} m/s^2, {yaw_rate_rad_s} rad/s");
            widest_m_s2 = widest_m_s2.max(most_m_s2);
            // A slide in the second turn is reported as if there were no offset.
            for slide_m_s2 in [0.6, -0.6] {
                let (told, _) = turned(offset_m_s2, yaw_rate_rad_s, slide_m_s2);
                assert!(
                    told.is_some_and(|tick| (15_000..15_250).contains(&tick)),
                    "{offset_m_s2:?} m/s^2, {yaw_rate_rad_s} rad/s, {slide_m_s2} m/s^2: {told:?}"
                );
            }
        }
    }
    assert!(widest_m_s2 > 0.4, "{widest_m_s2} m/s^2");
}

/// Without a turn an offset cannot be told from a slide, and nothing is learnt.
#[test]
fn a_slide_on_a_straight_is_no_offset() {
    for slow in [true, false] {
        let slides = Evidence {
            tilt_error: 0.4 / G,
            slow,
            ..ROLLING
        };
        assert!(after(&slides, 250).slides());
    }
}
