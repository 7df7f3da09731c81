//! An IMU that is mounted half a turn about its z axis, along motions that are known exactly.

use super::{Motion, Ride};
use crate::sample::TICK_S;

/// The arm swings while the wheels drive on: the wheels of an armed vehicle show that its IMU is mirrored.
#[test]
fn a_mirrored_imu_contradicts_the_wheels_once_they_turn_against_the_arm() {
    for (mirrored, disarmed, slope_rad) in [
        (true, false, 0.0),
        (true, false, 0.15),
        (true, true, 0.0),
        (false, false, 0.0),
        (false, false, -0.15),
    ] {
        let hangs = Motion {
            slope_rad,
            phi_rad: slope_rad,
            ..Motion::default()
        };
        let mut ride = Ride::from(hangs);
        ride.mirrored = mirrored;
        for _ in 0..1000 {
            assert!(!ride.tick(hangs, true).contradicted);
        }
        let told = (1..=600).find(|k| {
            let (omega, size_rad) = (12.0, 0.08);
            let angle = omega * f64::from(TICK_S) * f64::from(*k);
            let motion = Motion {
                phi_rad: slope_rad + size_rad * (1.0 - angle.cos()),
                swing_rad_s: size_rad * omega * angle.sin(),
                swing_rad_s2: size_rad * omega * omega * angle.cos(),
                ..hangs
            };
            ride.tick(motion, disarmed).contradicted
        });
        assert_eq!(
            told.is_some(),
            mirrored && !disarmed,
            "{mirrored}, {disarmed}, {slope_rad}"
        );
        assert!(told.is_none_or(|ticks| ticks <= 300), "{slope_rad}: {told:?}");
    }
}

/// A disarm clears what the watch has seen of the armed vehicle.
#[test]
fn what_was_seen_before_a_disarm_tells_nothing_after_it() {
    let swing = |k: u32| {
        let (omega, size_rad) = (12.0, 0.08);
        let angle = omega * f64::from(TICK_S) * f64::from(k);
        Motion {
            phi_rad: size_rad * (1.0 - angle.cos()),
            swing_rad_s: size_rad * omega * angle.sin(),
            swing_rad_s2: size_rad * omega * omega * angle.cos(),
            ..Motion::default()
        }
    };
    let ride = || {
        let mut ride = Ride::from(Motion::default());
        ride.mirrored = true;
        ride
    };
    let mut first = ride();
    let told = (1..=600)
        .find(|k| first.tick(swing(*k), false).contradicted)
        .expect("a mirrored IMU is told");
    for disarmed in [false, true] {
        let mut ride = ride();
        for k in 1..told {
            assert!(!ride.tick(swing(k), false).contradicted);
        }
        ride.tick(swing(told - 1), disarmed);
        let again = (told..told + 40).any(|k| ride.tick(swing(k), false).contradicted);
        assert_eq!(again, !disarmed, "disarmed for a tick: {disarmed}");
    }
}
