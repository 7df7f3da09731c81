//! Stage 1: raw counts become physical quantities.

use super::{BoardScales, G, VehicleCore, reference, resting, without_spar};
use crate::sample::{ImuRaw, ImuSample, Motor};

/// The part's axes are x forward, y left, z up, with 4000 counts per g and 30 counts per deg/s.
#[test]
fn an_imus_counts_become_si_units_and_swinging_forward_is_positive() {
    let mut sample = resting();
    let raw = |factor: i16| ImuSample {
        raw: ImuRaw {
            accel: [1000 * factor, -500 * factor, 4000 * factor],
            gyro: [300 * factor, -600 * factor, 900 * factor],
            temperature: 0,
        },
        age_us: 0,
    };
    (sample.arm_imu, sample.spar_imu) = (raw(1), raw(2));
    let sensed = VehicleCore::new(&reference(), &BoardScales::EXAMPLE).sense(&sample);
    let near = |found: f32, expected: f32| assert!((found - expected).abs() < 1e-4, "{found} for {expected}");
    for (tilt, factor) in [(sensed.arm, 1.0), (sensed.spar, 2.0)] {
        near(tilt.rate_rad_s, factor * 20.0_f32.to_radians());
        near(tilt.force_x_m_s2, factor * 0.25 * G);
        near(tilt.force_z_m_s2, factor * G);
    }
    near(sensed.arm_force_y_m_s2, -0.125 * G);
    near(sensed.arm_gyro_xz_rad_s[0], 10.0_f32.to_radians());
    near(sensed.arm_gyro_xz_rad_s[1], 30.0_f32.to_radians());
}

/// A motor's encoder has 1024 counts per turn of the motor. The drive motors' gear ratio is 43, the ballast motor's 28.
#[test]
fn an_encoders_counts_become_angles_and_rates_at_the_output() {
    let mut core = VehicleCore::new(&reference(), &BoardScales::EXAMPLE);
    let mut sample = resting();
    // The counters may show any value at boot.
    sample.encoder_counts = [1 << 40, -500, 7000];
    let first = core.sense(&sample);
    assert_eq!(first.relative_advance_rad, [0.0; 3]);
    assert_eq!(first.ballast_turned_rad, 0.0);
    let turn = 2.0 * core::f32::consts::PI;
    let per_count = [turn / (1024.0 * 43.0), turn / (1024.0 * 43.0), turn / (1024.0 * 28.0)];
    let moved = [40_i64, -20, 10];
    let mut sensed = first;
    for _ in 0..100 {
        for (count, moved) in sample.encoder_counts.iter_mut().zip(moved) {
            *count += moved;
        }
        sensed = core.sense(&sample);
    }
    for ((motor, per_count), moved) in per_count.iter().enumerate().zip(moved) {
        let advance_rad = moved as f32 * per_count;
        assert!((sensed.relative_advance_rad[motor] / advance_rad - 1.0).abs() < 1e-5);
        assert!((sensed.relative_rate_rad_s[motor] / (1000.0 * advance_rad) - 1.0).abs() < 1e-3);
    }
    assert!((sensed.ballast_turned_rad / (1000.0 * per_count[2]) - 1.0).abs() < 1e-5);
}

/// A current has 2 mA per count around 32,000. The supply voltage follows a step of the battery with a time constant of 5 ms.
#[test]
fn analogue_counts_become_amperes_and_volts() {
    let mut core = VehicleCore::new(&reference(), &BoardScales::EXAMPLE);
    let mut sample = resting();
    sample.analog.left_current = 32_000 + 5000;
    sample.analog.right_current = 32_000 - 5000;
    sample.analog.ballast_current = 32_000 + 500;
    let sensed = core.sense(&sample);
    for (found, expected) in sensed.current_a.into_iter().zip([10.0, -10.0, 1.0]) {
        assert!((found - expected).abs() < 0.01, "{found} A for {expected} A");
    }
    assert!(
        (sensed.battery_v - 25.0).abs() < 0.01,
        "the first reading counts in full"
    );
    sample.analog.battery_voltage = (20.0 / BoardScales::EXAMPLE.analog.battery_voltage.per_count) as u16;
    let after: [f32; 5] = core::array::from_fn(|_| core.sense(&sample).battery_v);
    let expected = 20.0 + 5.0 * (-1.0_f32).exp();
    assert!((after[4] - expected).abs() < 0.01, "{} V after 5 ms", after[4]);
}

/// The vehicle has no ballast, and nothing is wired to the ballast's inputs.
#[test]
fn a_vehicle_without_a_spar_senses_no_ballast() {
    let mut core = VehicleCore::new(&without_spar(), &BoardScales::EXAMPLE);
    let mut sample = resting();
    sample.analog.ballast_current = 65000;
    for _ in 0..50 {
        sample.encoder_counts[Motor::Ballast as usize] += 30;
        let sensed = core.sense(&sample);
        assert_eq!(
            (
                sensed.relative_rate_rad_s[2],
                sensed.relative_advance_rad[2],
                sensed.current_a[2]
            ),
            (0.0, 0.0, 0.0)
        );
    }
}

/// The encoders' counts stay when the parameters change: the distance of the tick in which they change is not lost.
#[test]
fn another_vehicle_takes_over_counts_and_supply() {
    let mut core = VehicleCore::new(&reference(), &BoardScales::EXAMPLE);
    let mut sample = resting();
    sample.encoder_counts = [-7000, 5000, 9000];
    core.sense(&sample);
    sample.encoder_counts = [100, -200, 9300];
    let turned_rad = core.sense(&sample).ballast_turned_rad;
    core = core.with_vehicle(&reference());
    sample.encoder_counts = [140, -260, 9310];
    sample.analog.battery_voltage = (20.0 / BoardScales::EXAMPLE.analog.battery_voltage.per_count) as u16;
    let sensed = core.sense(&sample);
    let rad_per_count = 2.0 * core::f32::consts::PI / (1024.0 * 43.0);
    for (found, counts) in sensed.relative_advance_rad.into_iter().zip([40.0, -60.0]) {
        assert!(
            (found - counts * rad_per_count).abs() < 1e-6,
            "{found} rad for {counts} counts"
        );
    }
    let ballast_rad = sensed.ballast_turned_rad / turned_rad;
    assert!((ballast_rad - 310.0 / 300.0).abs() < 1e-5, "{ballast_rad}");
    assert!(
        sensed.battery_v > 24.0,
        "the supply is filtered on: {} V",
        sensed.battery_v
    );
}
