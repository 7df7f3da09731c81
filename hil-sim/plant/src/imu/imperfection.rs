//! The imperfections of a mounted IMU: misalignment, scale, bias, drift with temperature, and vibration.
//!
//! All imperfections are applied when the sensor measures. Misalignment and scale commute with the
//! sensor's linear filter; a vibration's sine passes it with the gain of a second-order Butterworth
//! low-pass, `1 / sqrt(1 + (f / corner)^4)`, so that frequencies beyond the simulation's substeps fold as
//! they do in the part.

use core::f64::consts::TAU;

use model::real::Real;
use serde::Deserialize;

use crate::ranges::{Setting, SettingsError, settings_table, within};

settings_table! {
    /// Mounting and errors of one IMU.
    ImuSettings {
        /// Mounting angle about the x axis (forward), deg
        misalignment_x_deg: -180.0 to 180.0 = 0.0,
        /// Mounting angle about the y axis (left), deg; applied after the turn about x
        misalignment_y_deg: -180.0 to 180.0 = 0.0,
        /// Mounting angle about the z axis (up), deg; applied last
        misalignment_z_deg: -180.0 to 180.0 = 0.0,
        /// Relative scale error of the accelerometer
        accel_scale_error: -0.5 to 0.5 = 0.0,
        /// Relative scale error of the gyro
        gyro_scale_error: -0.5 to 0.5 = 0.0,
        /// Bias of the accelerometer's x axis in addition to the drawn bias, m/s^2
        accel_bias_x_m_s2: -20.0 to 20.0 = 0.0,
        /// Bias of its y axis, m/s^2
        accel_bias_y_m_s2: -20.0 to 20.0 = 0.0,
        /// Bias of its z axis, m/s^2
        accel_bias_z_m_s2: -20.0 to 20.0 = 0.0,
        /// Bias of the gyro's x axis in addition to the drawn bias, deg/s
        gyro_bias_x_deg_s: -100.0 to 100.0 = 0.0,
        /// Bias of its y axis, deg/s
        gyro_bias_y_deg_s: -100.0 to 100.0 = 0.0,
        /// Bias of its z axis, deg/s
        gyro_bias_z_deg_s: -100.0 to 100.0 = 0.0,
        /// Drift of every accelerometer axis with the temperature above 25 C, m/s^2 per K
        accel_drift_m_s2_per_k: -1.0 to 1.0 = 0.0,
        /// Drift of every gyro axis with the temperature above 25 C, deg/s per K
        gyro_drift_deg_s_per_k: -1.0 to 1.0 = 0.0,
        /// Temperature of the part at the start, C
        temperature_c: -40.0 to 85.0 = 30.0,
        /// Error of the part's clock, share; with 0 the part measures in step with the board's ticks
        clock_error: -0.05 to 0.05 = 0.0,
    }
}

settings_table! {
    /// A sine that shakes an IMU, with a third of a period between its axes.
    Vibration {
        /// Amplitude of the acceleration on every axis, m/s^2
        amplitude_m_s2: 0.0 to 500.0 = 0.0,
        /// Amplitude of the angular rate about every axis, rad/s
        amplitude_rad_s: 0.0 to 50.0 = 0.0,
        /// Frequency, Hz
        frequency_hz: 0.1 to 10000.0 = 100.0,
    }
}

/// A temperature that changes at a steady rate and then stays.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Temperature {
    from_c: f64,
    to_c: f64,
    start_s: f64,
    over_s: f64,
}

impl Temperature {
    /// A constant temperature.
    pub fn steady(temperature_c: f64) -> Self {
        Self {
            from_c: temperature_c,
            to_c: temperature_c,
            start_s: 0.0,
            over_s: 0.0,
        }
    }

    /// The temperature at `time_s`, in C.
    pub fn at(&self, time_s: f64) -> f64 {
        let passed = time_s - self.start_s;
        if passed >= self.over_s {
            self.to_c
        } else {
            self.from_c + (self.to_c - self.from_c) * (passed / self.over_s).max(0.0)
        }
    }

    /// Changes from the temperature at `now_s` to `to_c` within `over_s`.
    pub fn ramp(&mut self, now_s: f64, to_c: f64, over_s: f64) {
        *self = Self {
            from_c: self.at(now_s),
            to_c,
            start_s: now_s,
            over_s,
        };
    }
}

/// Reference temperature of the drift, in C.
const REFERENCE_C: f64 = 25.0;

/// Settings and vibration, prepared for measuring.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Imperfection {
    /// Rows: the sensor's axes in the body's axes.
    axes: [[f64; 3]; 3],
    scale: [f64; 2],
    bias: [f64; 6],
    /// Drift of accelerometer and gyro, per K.
    drift: [f64; 2],
    pub(super) vibration: Vibration,
}

impl Imperfection {
    /// The imperfection that `settings` describe, without vibration.
    pub(super) fn new(settings: &ImuSettings) -> Self {
        let s = settings;
        let turn = |angle_deg: f64| Real::sin_cos(angle_deg.to_radians());
        let ((sx, cx), (sy, cy), (sz, cz)) = (
            turn(s.misalignment_x_deg),
            turn(s.misalignment_y_deg),
            turn(s.misalignment_z_deg),
        );
        Self {
            // The columns of Rz Ry Rx are the sensor's axes; these are its rows transposed.
            axes: [
                [cy * cz, cy * sz, -sy],
                [sx * sy * cz - cx * sz, sx * sy * sz + cx * cz, sx * cy],
                [cx * sy * cz + sx * sz, cx * sy * sz - sx * cz, cx * cy],
            ],
            scale: [1.0 + s.accel_scale_error, 1.0 + s.gyro_scale_error],
            bias: [
                s.accel_bias_x_m_s2,
                s.accel_bias_y_m_s2,
                s.accel_bias_z_m_s2,
                s.gyro_bias_x_deg_s.to_radians(),
                s.gyro_bias_y_deg_s.to_radians(),
                s.gyro_bias_z_deg_s.to_radians(),
            ],
            drift: [s.accel_drift_m_s2_per_k, s.gyro_drift_deg_s_per_k.to_radians()],
            vibration: Vibration::default(),
        }
    }

    /// Applies the imperfections to `motion`, six channels in the axes of the body that carries the
    /// sensor.
    pub(super) fn apply(&self, motion: &[f64; 6], time_s: f64, temperature_c: f64, corner_hz: f64) -> [f64; 6] {
        let warmer = temperature_c - REFERENCE_C;
        let Vibration {
            amplitude_m_s2,
            amplitude_rad_s,
            frequency_hz,
        } = self.vibration;
        let ratio = (frequency_hz / corner_hz) * (frequency_hz / corner_hz);
        let gain = 1.0 / (1.0 + ratio * ratio).sqrt();
        core::array::from_fn(|i| {
            let (kind, axis) = (i / 3, i % 3);
            let row = &self.axes[axis];
            let along: f64 = (0..3).map(|k| row[k] * motion[3 * kind + k]).sum();
            let amplitude = [amplitude_m_s2, amplitude_rad_s][kind];
            let shaken = if amplitude > 0.0 {
                let turns = frequency_hz * time_s + axis as f64 / 3.0;
                gain * amplitude * libm::sin(TAU * (turns - turns.floor()))
            } else {
                0.0
            };
            (along + shaken) * self.scale[kind] + self.bias[i] + self.drift[kind] * warmer
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn settings(change: impl FnOnce(&mut ImuSettings)) -> Imperfection {
        let mut settings = ImuSettings::default();
        change(&mut settings);
        Imperfection::new(&settings)
    }

    const STILL: [f64; 6] = [0.0, 0.0, 9.81, 0.0, 0.0, 2.0];

    fn close(found: [f64; 6], expected: [f64; 6]) {
        for (found, expected) in found.iter().zip(expected) {
            assert!((found - expected).abs() < 1e-12, "{found} against {expected}");
        }
    }

    #[test]
    fn a_rolled_imu_sees_yaw_and_gravity_on_its_y_axis() {
        let rolled = settings(|s| s.misalignment_x_deg = 2.0);
        let (sin, cos) = 2.0_f64.to_radians().sin_cos();
        close(
            rolled.apply(&STILL, 0.0, 25.0, 250.0),
            [0.0, 9.81 * sin, 9.81 * cos, 0.0, 2.0 * sin, 2.0 * cos],
        );
        // Turned about y, so that its x axis points down, the sensor shows both on x with the other sign.
        let pitched = settings(|s| s.misalignment_y_deg = 2.0);
        close(
            pitched.apply(&STILL, 0.0, 25.0, 250.0),
            [-9.81 * sin, 0.0, 9.81 * cos, -2.0 * sin, 0.0, 2.0 * cos],
        );
        let turned = settings(|s| s.misalignment_z_deg = 90.0);
        let found = turned.apply(&[1.0, 0.0, 0.0, 0.0, 3.0, 0.0], 0.0, 25.0, 250.0);
        close(found, [0.0, -1.0, 0.0, 3.0, 0.0, 0.0]);
    }

    #[test]
    fn any_mounting_keeps_the_length_of_what_it_sees() {
        let turned = settings(|s| {
            s.misalignment_x_deg = 33.0;
            s.misalignment_y_deg = -71.0;
            s.misalignment_z_deg = 140.0;
        });
        let found = turned.apply(&[1.0, 2.0, 3.0, -0.1, 0.2, 0.7], 0.0, 25.0, 250.0);
        let length = |v: &[f64]| v.iter().map(|x| x * x).sum::<f64>();
        assert!((length(&found[..3]) - 14.0).abs() < 1e-12);
        assert!((length(&found[3..]) - 0.54).abs() < 1e-12);
    }

    #[test]
    fn scale_bias_and_drift_add_up() {
        let wrong = settings(|s| {
            s.accel_scale_error = 0.01;
            s.gyro_scale_error = -0.02;
            s.gyro_bias_z_deg_s = 0.5;
            s.accel_bias_y_m_s2 = 0.3;
            s.gyro_drift_deg_s_per_k = 0.02;
            s.accel_drift_m_s2_per_k = 0.001;
        });
        let drift = (0.02_f64 * 20.0).to_radians();
        close(
            wrong.apply(&STILL, 0.0, 45.0, 250.0),
            [
                0.02,
                0.32,
                9.81 * 1.01 + 0.02,
                drift,
                drift,
                2.0 * 0.98 + 0.5_f64.to_radians() + drift,
            ],
        );
    }

    #[test]
    fn a_ramp_of_temperature_is_straight_and_stays() {
        let mut temperature = Temperature::steady(30.0);
        temperature.ramp(10.0, 50.0, 40.0);
        for (time_s, expected) in [(10.0, 30.0), (20.0, 35.0), (50.0, 50.0), (90.0, 50.0)] {
            assert!((temperature.at(time_s) - expected).abs() < 1e-12, "{time_s}");
        }
        temperature.ramp(30.0, 0.0, 0.0);
        assert_eq!(temperature.at(30.0), 0.0);
    }

    #[test]
    fn a_vibration_shows_with_the_filters_gain_and_folds_at_the_sampling_rate() {
        let mut shaken = settings(|_| {});
        shaken.vibration = Vibration {
            amplitude_m_s2: 3.0,
            amplitude_rad_s: 0.5,
            frequency_hz: 500.3,
        };
        let (mut accel, mut gyro) = (0.0, 0.0);
        let n = 20_000;
        for k in 0..n {
            let m = shaken.apply(&[0.0; 6], f64::from(k) * 1e-3, 25.0, 250.0);
            accel += m[1] * m[1];
            gyro += m[5] * m[5];
        }
        let gain = 1.0 / (1.0 + (500.3_f64 / 250.0).powi(4)).sqrt();
        let rms = |sum: f64| (sum / f64::from(n)).sqrt();
        let expected = gain / 2.0_f64.sqrt();
        assert!((rms(accel) / (3.0 * expected) - 1.0).abs() < 1e-2, "{}", rms(accel));
        assert!((rms(gyro) / (0.5 * expected) - 1.0).abs() < 1e-2);
        // A 1000 Hz sine sampled at 1 kHz appears constant.
        shaken.vibration.frequency_hz = 1000.0;
        let found: Vec<f64> = (0..5)
            .map(|k| shaken.apply(&[0.0; 6], f64::from(k) * 1e-3, 25.0, 250.0)[1])
            .collect();
        assert!(found.iter().all(|x| (x - found[0]).abs() < 1e-9), "{found:?}");
    }
}
