//! The roll of the axle, from the gyro and the accelerometer on the arm.
//!
//! Of the unit vector that points up, the gyro turns the component along the axle by
//!
//! ```text
//! sin(roll)' = omega_x cos(phi) - omega_z sin(phi)
//! ```
//!
//! and the component along the heading by `sin(roll) psi'` ([`tilt`](super::tilt)). Together the two turn an error of the
//! estimated direction with the vehicle, so that no turn makes it larger, on any ground. What corrects it is the accelerometer:
//! the specific force along the axle, less the acceleration `v psi'` of the turn and the Coriolis acceleration of the
//! swinging IMU, is `g sin(roll)`. Wheels that slide sideways do
//! not give that acceleration. A correction of at most `r` per second then makes an error of the arm's angle of at most
//! `r / psi'`, because that error turns back into the roll.

use super::trust::Trust;
use crate::bounded::Bounded;
use crate::vehicle::G;

/// What one tick shows of the roll.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RollReading {
    /// Rates about the arm's x and z axes with the biases taken out, rad/s.
    pub gyro_xz_rad_s: [f32; 2],
    /// Sine and cosine of the arm's angle.
    pub phi_sin_cos: [f32; 2],
    /// Specific force along the axle, to the left, less the acceleration of the turn, m/s^2.
    pub force_m_s2: f32,
}

/// Complementary filter for the sine of the axle's roll.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RollEstimator {
    dt_s: f32,
    gain: f32,
    sin: f32,
    unexplained: f32,
}

/// Largest error, as a sine, that corrects the roll while driving: the start of a slide in a turn looks like a wrong roll.
const ROLL_CORRECTION_MAX: f32 = 0.03;

impl RollEstimator {
    /// An estimator called every `dt_s` seconds, corrected with the time constant `time_constant_s`.
    pub fn new(dt_s: f32, time_constant_s: f32) -> Self {
        Self {
            dt_s,
            gain: dt_s / time_constant_s,
            sin: 0.0,
            unexplained: 0.0,
        }
    }

    /// Sets the roll from gravity alone: right only while everything is at rest.
    pub fn align(&mut self, force_m_s2: f32) {
        self.sin = (force_m_s2 / G).bounded(-1.0, 1.0);
    }

    /// Takes one reading.
    #[inline]
    pub fn update(&mut self, reading: &RollReading, trust: Trust) {
        let [x, z] = reading.gyro_xz_rad_s;
        let [sin, cos] = reading.phi_sin_cos;
        let turned = self.sin + self.dt_s * (x * cos - z * sin);
        self.unexplained = (reading.force_m_s2 / G).bounded(-1.0, 1.0) - turned;
        let error = if trust.stands() {
            self.unexplained
        } else {
            self.unexplained.bounded(-ROLL_CORRECTION_MAX, ROLL_CORRECTION_MAX)
        };
        let (factor, _) = trust.factors();
        self.sin = (turned + factor * self.gain * error).bounded(-1.0, 1.0);
    }

    /// Sine of the axle's roll as the IMU is mounted: positive with the left end up.
    pub fn sin(&self) -> f32 {
        self.sin
    }

    /// What the accelerometer felt to the left beyond roll and turn in the last update, m/s^2.
    pub fn unexplained_m_s2(&self) -> f32 {
        G * self.unexplained
    }
}

#[cfg(test)]
mod tests {
    use super::super::tilt::{Disturbance, TiltEstimator, TiltReading};
    use super::*;

    const DT: f32 = 0.001;

    /// The arm's three axes in those of the world, while the arm swings as `phi(t)` and the vehicle turns at `yaw_rad_s` on a plane
    /// of `slope_rad`. The oracle turns the axes themselves and uses no formula of the rates.
    fn up(t: f64, yaw_rad_s: f64, slope_rad: f64, phi: &dyn Fn(f64) -> f64) -> [[f64; 3]; 3] {
        let (sh, ch) = (yaw_rad_s * t).sin_cos();
        let (ss, cs) = slope_rad.sin_cos();
        // The plane's axes in those of the world, uphill first; then the axes of the heading on the plane.
        let [uphill, across, normal] = [[cs, 0.0, ss], [0.0, 1.0, 0.0], [-ss, 0.0, cs]];
        let mix = |a: f64, x: [f64; 3], b: f64, y: [f64; 3]| [0, 1, 2].map(|k: usize| a * x[k] + b * y[k]);
        let (forward, left) = (mix(ch, uphill, sh, across), mix(-sh, uphill, ch, across));
        // phi counts from the vertical: the rise of the forward axis is the plane's part of it.
        let (sp, cp) = (phi(t) - (forward[2] / (1.0 - left[2] * left[2]).sqrt()).asin()).sin_cos();
        [mix(cp, forward, sp, normal), left, mix(-sp, forward, cp, normal)]
    }

    /// Runs the estimators for `seconds` of a turn, of whose acceleration `turn_m_s2` the ground gives the share `held`.
    /// Returns the largest errors of the arm's angle and of the roll's sine.
    fn turned(seconds: f64, yaw_rad_s: f64, slope_rad: f64, turn_m_s2: f64, held: f64) -> [f64; 2] {
        let phi = |t: f64| 0.1 * (3.0 * t).sin();
        let (mut roll, mut tilt) = (
            RollEstimator::new(DT, 2.0),
            TiltEstimator::new(DT, 0.0, 2.0, 60.0, 1e-6),
        );
        let force = |axes: &[[f64; 3]; 3]| axes.map(|axis| (f64::from(G) * axis[2]) as f32);
        let h = 1e-4;
        let mut worst = [0.0_f64; 2];
        for k in 0..(seconds * 1000.0) as u32 {
            let t = f64::from(k) * f64::from(DT);
            let [before, now, after] = [-h, 0.0, h].map(|step| up(t + step, yaw_rad_s, slope_rad, &phi));
            let rate = |a: usize, b: usize| {
                // The rate at which axis a turns towards axis b.
                let turned = |k: usize| (after[a][k] - before[a][k]) / (2.0 * h) * now[b][k];
                (turned(0) + turned(1) + turned(2)) as f32
            };
            let [x, y, z] = [rate(1, 2), rate(2, 0), rate(0, 1)];
            let [force_x_m_s2, force_y_m_s2, force_z_m_s2] = force(&now);
            let reading = TiltReading {
                rate_rad_s: -y,
                force_x_m_s2,
                force_z_m_s2,
            };
            if k == 0 {
                roll.align(force_y_m_s2);
                tilt.align(&reading);
            }
            roll.update(
                &RollReading {
                    gyro_xz_rad_s: [x, z],
                    phi_sin_cos: [tilt.sin(), tilt.cos()],
                    force_m_s2: force_y_m_s2 + ((held - 1.0) * turn_m_s2) as f32,
                },
                Trust::Driving,
            );
            let disturbance = Disturbance {
                axle_acceleration_m_s2: 0.0,
                cos_slope: 1.0,
                yaw_rate_rad_s: yaw_rad_s as f32,
                sin_roll: roll.sin(),
            };
            tilt.update(&reading, &disturbance, Trust::Driving);
            worst[0] = worst[0].max((f64::from(tilt.angle_rad()) - phi(t)).abs());
            worst[1] = worst[1].max((f64::from(roll.sin()) - now[1][2]).abs());
        }
        worst
    }

    #[test]
    fn a_turn_on_any_plane_is_followed() {
        for (yaw_rad_s, slope_rad) in [(2.0, 0.0), (2.0, 0.2), (-1.0, 0.2), (0.5, 0.1)] {
            let [tilt_rad, roll] = turned(20.0, yaw_rad_s, slope_rad, 0.0, 1.0);
            assert!(
                tilt_rad < 0.01 && roll < 0.01,
                "{yaw_rad_s}, {slope_rad}: {tilt_rad} rad, {roll}"
            );
        }
    }

    /// The ground gives a turn a tenth of its acceleration, and no watch reports the slide. The correction of the roll is at most
    /// 0.015 rad/s. Over the yaw rate, that is the largest error of the arm's angle, and as much again while the error turns.
    #[test]
    fn a_slide_that_nobody_tells_hardly_turns_the_arm() {
        for yaw_rad_s in [-2.0_f64, -0.7, 0.7, 1.0, 2.0] {
            let turn_m_s2 = 2.5 * yaw_rad_s;
            let [tilt_rad, roll] = turned(20.0, yaw_rad_s, 0.0, turn_m_s2, 0.1);
            let most = 2.0 * f64::from(ROLL_CORRECTION_MAX) / 2.0 / yaw_rad_s.abs() + 0.005;
            assert!(tilt_rad < most && roll < most, "{yaw_rad_s}: {tilt_rad} rad, {roll}");
        }
    }

    #[test]
    fn at_rest_the_roll_is_what_gravity_shows() {
        let mut roll = RollEstimator::new(DT, 2.0);
        let reading = RollReading {
            gyro_xz_rad_s: [0.0; 2],
            phi_sin_cos: [0.0, 1.0],
            force_m_s2: 0.2 * G,
        };
        for _ in 0..1000 {
            roll.update(&reading, Trust::Settling);
        }
        assert!((roll.sin() - 0.2).abs() < 1e-3, "{}", roll.sin());
        let told = roll.sin();
        roll.update(&reading, Trust::None);
        assert_eq!(roll.sin(), told);
    }
}
