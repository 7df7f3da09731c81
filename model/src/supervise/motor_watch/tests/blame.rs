//! Which of a motor's parts is to blame, from both sides.

use super::*;
use crate::sample::MOTORS;

/// A witness of a rate that is off by `apart_v` of back-EMF, beside a motor that does the same work.
fn witness(apart_v: f32, reading: &MotorReading) -> Witness {
    Witness {
        apart_rad_s: apart_v / EMF_V_S,
        other_v: reading.applied_v.unwrap_or(0.0) - EMF_V_S * reading.rate_rad_s,
    }
}

/// The first findings under the same readings, and their tick, of at most 1000.
fn first(watch: &mut MotorWatch, reading: &MotorReading, witness: Option<Witness>) -> Option<(u32, MotorHealth)> {
    (1..=1000).find_map(|tick| {
        let health = health(watch, reading, witness);
        (health != MotorHealth::default()).then_some((tick, health))
    })
}

const ENCODER: MotorHealth = MotorHealth {
    encoder: true,
    current_sensor: false,
    current_offset: false,
    open: false,
};
const CURRENT_SENSOR: MotorHealth = MotorHealth {
    encoder: false,
    current_sensor: true,
    ..ENCODER
};
const OPEN: MotorHealth = MotorHealth {
    encoder: false,
    open: true,
    ..ENCODER
};

/// An encoder that is wrong differs from the other wheel and the gyro by what is missing; half of that tells, and 0.03 V.
#[test]
fn what_contradicts_an_encoder_that_others_bear_out_is_the_current_sensor() {
    for direction in [1.0, -1.0] {
        // 3 V less a drop of 1 V.
        let reading = steady(3.0 * direction, direction / RESISTANCE_OHM, 0.0);
        for (apart_v, expected) in [
            (0.0, CURRENT_SENSOR),
            (1.02, CURRENT_SENSOR),
            (-1.02, CURRENT_SENSOR),
            (1.04, ENCODER),
            (-1.04, ENCODER),
            (f32::NAN, ENCODER),
        ] {
            let found = first(&mut watch(), &reading, Some(witness(apart_v, &reading)));
            assert_eq!(found, Some((250, expected)), "{apart_v} V");
        }
    }
}

/// What a failed sensor shows is evidence of nothing else, until the bridge opens.
#[test]
fn a_current_sensor_that_has_failed_is_no_evidence() {
    let reading = steady(3.0, 0.0, 0.0);
    let denies = Some(witness(3.0, &reading));
    let mut watch = watch();
    let found = first(&mut watch, &reading, Some(witness(0.0, &reading)));
    assert_eq!(found, Some((250, CURRENT_SENSOR)));
    assert_eq!(first(&mut watch, &reading, denies), None);
    let opened = MotorReading {
        applied_v: None,
        ..reading
    };
    assert_eq!(health(&mut watch, &opened, denies), MotorHealth::default());
    // One contradiction less.
    assert_eq!(first(&mut watch, &reading, denies), Some((1, ENCODER)));
}

/// Its output falls behind by more than 0.1 rad/s, or the other motor differs by more than half of what drives this one.
#[test]
fn a_lead_is_open_if_the_motor_is_without_torque() {
    for direction in [1.0, -1.0] {
        for (behind_rad_s, other_v, apart_v, expected) in [
            (0.0, 3.0, 0.0, (250, CURRENT_SENSOR)),
            (0.09, 3.0, 0.0, (250, CURRENT_SENSOR)),
            (-0.2, 3.0, 0.0, (250, CURRENT_SENSOR)),
            (0.11, 3.0, 0.0, (100, OPEN)),
            (0.0, 1.55, 0.0, (250, CURRENT_SENSOR)),
            (0.0, 1.45, 0.0, (100, OPEN)),
            (0.0, 4.45, 0.0, (250, CURRENT_SENSOR)),
            (0.0, 4.55, 0.0, (100, OPEN)),
            // The encoder is wrong: reversed, it makes any current too small.
            (0.2, 0.0, 3.0, (250, ENCODER)),
        ] {
            let mut watch = watch();
            // The first tick without a current.
            health(
                &mut watch,
                &steady(direction * 3.0, 0.0, direction * behind_rad_s),
                None,
            );
            let reading = steady(direction * 3.0, 0.0, 0.0);
            let witness = Witness {
                other_v: direction * other_v,
                ..witness(direction * apart_v, &reading)
            };
            let found = first(&mut watch, &reading, Some(witness)).map(|(ticks, health)| (ticks + 1, health));
            assert_eq!(found, Some(expected), "{behind_rad_s} rad/s, {other_v} V, {apart_v} V");
        }
    }
    // Where nothing else shows the rate, falling behind is all that tells.
    for (behind_rad_s, found) in [(0.09, None), (0.11, Some((99, OPEN)))] {
        let mut watch = watch();
        health(&mut watch, &steady(3.0, 0.0, behind_rad_s), None);
        assert_eq!(first(&mut watch, &steady(3.0, 0.0, 0.0), None), found, "{behind_rad_s}");
    }
}

/// Where nothing else shows the rate, an encoder is not to blame while no current flows: a lead may be open.
#[test]
fn a_motor_without_current_tells_nothing_of_its_encoder() {
    let found = |current_a| first(&mut watch(), &steady(2.0, current_a, 0.0), None);
    assert_eq!(found(0.0), None);
    assert_eq!(found(0.62), None, "a tenth of 6.33 A");
    assert_eq!(found(0.65), Some((250, ENCODER)));
}

/// Two wheels that contradict their motors bear nothing out, though they agree: both encoders may be dead.
#[test]
fn two_encoders_that_are_doubted_are_both_to_blame() {
    for (right, expected) in [
        (steady(3.0, 3.0, 0.0), [ENCODER, ENCODER]),
        (steady(1.0, 3.0, 0.0), [CURRENT_SENSOR, MotorHealth::default()]),
    ] {
        let readings: [MotorReading; MOTORS] = [steady(3.0, 3.0, 0.0), right, steady(0.0, 0.0, 0.0)];
        let mut watches = [watch(); MOTORS];
        for tick in 1..=250 {
            let mut wrong = [false; MOTORS];
            for ((wrong, watch), reading) in wrong.iter_mut().zip(&mut watches).zip(&readings) {
                *wrong = watch.update(reading);
            }
            let [left, right, ballast] = healths(&mut watches, wrong, &readings, 0.0);
            assert_eq!(ballast, MotorHealth::default());
            let expected = if tick < 250 {
                [MotorHealth::default(); 2]
            } else {
                expected
            };
            assert_eq!([left, right], expected, "{tick}");
        }
    }
    // The gyro shows that the left wheel turns, and not the right one.
    let readings = [steady(3.0, 3.0, 0.0), steady(1.0, 3.0, 0.0), steady(0.0, 0.0, 0.0)];
    let mut watches = [watch(); MOTORS];
    for _ in 0..249 {
        watches[0].update(&readings[0]);
    }
    let wrong = [watches[0].update(&readings[0]), false, false];
    let [left, right, _] = healths(&mut watches, wrong, &readings, -2.05 / EMF_V_S);
    assert_eq!([left, right], [ENCODER, MotorHealth::default()]);
}
