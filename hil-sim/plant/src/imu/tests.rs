//! Compares the sensed motion with a trajectory that is differentiated numerically in an inertial
//! frame.

use super::*;
use crate::body::PHI;
use crate::noise::Noise;

const RADIUS: f64 = 0.13;

/// A smooth motion of all coordinates: axle x, y, z, heading, angle from the normal.
fn trajectory(t: f64) -> [f64; 5] {
    [
        0.8 * t + 0.1 * (2.0 * t).sin(),
        0.3 * (1.3 * t).cos(),
        0.02 * (5.0 * t).sin(),
        0.4 * t + 0.2 * (3.0 * t).sin(),
        0.5 * (4.0 * t).sin() + 0.2,
    ]
}

/// Axes of the swinging body in the inertial frame: rows x, y, z.
fn axes(t: f64) -> [[f64; 3]; 3] {
    let [_, _, _, heading, angle] = trajectory(t);
    let (s, c) = heading.sin_cos();
    let (sa, ca) = angle.sin_cos();
    [[ca * c, ca * s, sa], [-s, c, 0.0], [-sa * c, -sa * s, ca]]
}

/// Position of the IMU: below the axle along the body's -z axis.
fn place(t: f64) -> [f64; 3] {
    let [x, y, z, ..] = trajectory(t);
    let down = axes(t)[2];
    [x - RADIUS * down[0], y - RADIUS * down[1], z - RADIUS * down[2]]
}

fn derivative<const N: usize>(f: impl Fn(f64) -> [f64; N], t: f64) -> [f64; N] {
    let e = 1e-4;
    let (a, b, c, d) = (f(t - 2.0 * e), f(t - e), f(t + e), f(t + 2.0 * e));
    core::array::from_fn(|i| (a[i] - 8.0 * b[i] + 8.0 * c[i] - d[i]) / (12.0 * e))
}

#[test]
fn the_felt_motion_is_that_of_its_place() {
    // Gravity tilted in both directions, as on a slope.
    let up = [1.1, -0.7, 9.7];
    let t = 0.3;
    let speeds_at = |t: f64| {
        let [x, y, z, heading, angle] = derivative(trajectory, t);
        let (s, c) = trajectory(t)[3].sin_cos();
        let mut speeds = [0.0; 9];
        speeds[FORWARD] = c * x + s * y;
        speeds[SIDE] = c * y - s * x;
        speeds[LIFT] = z;
        speeds[YAW] = heading;
        speeds[PHI] = angle;
        speeds
    };
    let speeds = speeds_at(t);
    let accelerations = derivative(speeds_at, t);
    let heading = trajectory(t)[3];
    let (s, c) = heading.sin_cos();
    let gravity = Gravity {
        along: up[0] * c + up[1] * s,
        across: up[1] * c - up[0] * s,
        normal: up[2],
    };
    let swing = Swing {
        sin_cos: trajectory(t)[4].sin_cos(),
        rate: speeds[PHI],
        acceleration: accelerations[PHI],
    };
    let found = motion_at(RADIUS, &swing, &speeds, &accelerations, &gravity, AxleRoll::default());

    let acceleration = derivative(|t| derivative(place, t), t);
    let axes_now = axes(t);
    for (i, axis) in axes_now.iter().enumerate() {
        let expected: f64 = (0..3).map(|k| axis[k] * (acceleration[k] + up[k])).sum();
        let found = found.specific_force[i];
        assert!((found - expected).abs() < 1e-4, "force {i}: {found} against {expected}");
    }
    // Rotation rate from the axes' derivatives: omega_x = z . y', and cyclically.
    let turn = derivative(|t| axes(t).concat().try_into().unwrap_or([0.0; 9]), t);
    let turn_of = |axis: usize| [turn[3 * axis], turn[3 * axis + 1], turn[3 * axis + 2]];
    let along = |a: [f64; 3], b: [f64; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    let expected = [
        along(axes_now[2], turn_of(1)),
        along(axes_now[0], turn_of(2)),
        along(axes_now[1], turn_of(0)),
    ];
    for (i, (found, expected)) in found.rate.iter().zip(expected).enumerate() {
        assert!((found - expected).abs() < 1e-6, "rate {i}: {found} against {expected}");
    }
    assert!(found.rate.iter().all(|w| w.abs() > 0.05), "every axis is exercised");
}

/// A turn with an axle that has a roll and is rolling: the upward direction, in the body's axes, turns at the measured rates.
#[test]
fn a_rolled_axle_shows_its_part_of_the_turn() {
    let (yaw, swing_rate) = (1.3, -0.4);
    let roll_at = |t: f64| AxleRoll {
        sin: 0.05 * (2.0 * t).sin(),
        rate: 0.1 * (2.0 * t).cos(),
    };
    let motion = |t: f64| {
        let (roll, angle) = (roll_at(t), 0.2 + swing_rate * t);
        let swing = Swing {
            sin_cos: angle.sin_cos(),
            rate: swing_rate,
            acceleration: 0.0,
        };
        let mut speeds = [0.0; 9];
        speeds[YAW] = yaw;
        let level = (1.0 - roll.sin * roll.sin).sqrt();
        let gravity = Gravity {
            along: 0.0,
            across: 9.81 * roll.sin,
            normal: 9.81 * level,
        };
        motion_at(0.0, &swing, &speeds, &[0.0; 9], &gravity, roll)
    };
    for t in [0.0, 0.3, 0.7] {
        let Motion {
            specific_force: f,
            rate,
        } = motion(t);
        let turned = derivative(|t| motion(t).specific_force, t);
        // d(up)/dt = up x omega; here the roll's sine stands for its angle.
        for (i, turned) in turned.iter().enumerate() {
            let (j, k) = ((i + 1) % 3, (i + 2) % 3);
            let expected = f[j] * rate[k] - f[k] * rate[j];
            assert!(
                (turned - expected).abs() < 0.01,
                "{t} s, axis {i}: {turned} against {expected}"
            );
        }
        assert!(t == 0.0 || (rate[1] + swing_rate).abs() > 0.03, "the axle is rolled");
    }
}

#[test]
fn the_filter_delays_a_ramp_by_its_group_delay_and_halves_the_power_at_its_corner() {
    // Also at steps as long as the delay.
    for h in [1e-3, 2.5e-4] {
        let mut filter = Butterworth::new(250.0);
        let mut out = 0.0;
        for k in 0..400 {
            out = filter.advance(h, &[(k as f64 + 0.5) * h; 6])[0];
        }
        let delay = 400.0 * h - out;
        // 0.90 ms; the mean of a ramp in place of the ramp shifts it by less than a percent.
        // Sqrt(2) over the corner's angular frequency.
        let group_delay_s = SQRT_2 / (2.0 * PI * filter.corner_hz());
        assert!((8.9e-4..9.1e-4).contains(&group_delay_s));
        assert!((delay / group_delay_s - 1.0).abs() < 0.01, "{h} s: {delay} s");
    }

    let h = 5e-5;
    let mut filter = Butterworth::new(250.0);
    let mut peak = 0.0_f64;
    for k in 0..4000 {
        let y = filter.advance(h, &[(2.0 * PI * 250.0 * (k as f64 + 0.5) * h + 0.3).sin(); 6])[5];
        if k > 2000 {
            peak = peak.max(y.abs());
        }
    }
    // Eighty samples per period find the peak within 0.1 %; the steps reduce the input by 0.03 %.
    assert!((peak - 0.5_f64.sqrt()).abs() < 1.5e-3, "{peak}");
}

#[test]
fn bias_and_noise_have_the_size_of_the_data_sheet() {
    let errors = ImuErrors::default();
    let still = Motion {
        specific_force: [0.0, 0.0, 9.81],
        rate: [0.0; 3],
    };
    let mut sensor = ImuSensor::new(errors, 250.0, Noise::new(5, 0));
    let n = 20_000;
    let (mut sum, mut square) = ([0.0; 6], [0.0; 6]);
    for k in 0..n {
        sensor.advance(1e-3, &still);
        let m = sensor.sample(f64::from(k) * 1e-3).expect("it takes every sample");
        for i in 0..6 {
            sum[i] += m[i];
            square[i] += m[i] * m[i];
        }
    }
    let n = f64::from(n);
    for i in 0..6 {
        let mean = sum[i] / n;
        let deviation = (square[i] / n - mean * mean).sqrt();
        let truth = if i == 2 { 9.81 } else { 0.0 };
        assert!(
            (mean - truth - sensor.bias()[i]).abs() < 5.0 * deviation / n.sqrt(),
            "channel {i}"
        );
        // 70 ug and 2.8 mdps per root Hz over 1.11 x 250 Hz.
        let expected = if i < 3 { 70e-6 * 9.81 } else { 2.8e-3_f64.to_radians() } * 277.5_f64.sqrt();
        assert!(
            (deviation / expected - 1.0).abs() < 0.03,
            "channel {i}: {deviation} against {expected}"
        );
    }
    // Biases over many parts.
    let parts = 4000;
    let mut squares = [0.0; 2];
    for seed in 0..parts {
        let part = ImuSensor::new(errors, 250.0, Noise::new(seed, 1));
        squares[0] += part.bias()[0] * part.bias()[0];
        squares[1] += part.bias()[3] * part.bias()[3];
    }
    for (square, expected) in squares.iter().zip([errors.accel_bias, errors.gyro_bias]) {
        let deviation = (square / parts as f64).sqrt();
        assert!(
            (deviation / expected - 1.0).abs() < 0.05,
            "{deviation} against {expected}"
        );
    }
}
