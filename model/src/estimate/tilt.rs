//! The angle of a body that swings about the axle, from a gyro and an accelerometer on it.
//!
//! For an IMU at `radius` from the axle towards the hanging side, at the angle phi from the vertical
//! (positive forward), with the axle accelerating at `a` up a slope beta, the specific force in the
//! body's axes (x forward, z up at phi = 0) is
//!
//! ```text
//! f_x = g sin(phi) + a cos(beta - phi) + radius (phi'' - psi'^2 sin(phi) cos(phi))
//! f_z = g cos(phi) + a sin(beta - phi) + radius (phi'^2 + psi'^2 sin(phi)^2)
//! ```
//!
//! (differentiating `radius (sin(phi), -cos(phi))` twice, and turning about the vertical at psi').
//! While the vehicle turns on a slope, the slope along its heading changes by `sin(roll) psi'`. The body swings with
//! the plane; its gyro also turns with the plane and shows phi' less that rate.
//!
//! The estimator computes every term except gravity's and subtracts it; the remainder slowly corrects the integrated
//! gyro. Without this compensation, 0.3 g of axle acceleration would read as 17 degrees. The axle's acceleration is
//! known late, because it is differentiated from filtered rates. The accelerometer's horizontal component therefore
//! passes through a filter of the same lag. Without that filter, every change of the acceleration by a would leave an
//! error of lag a / (g tau) in the angle.

use super::rate_filter::LowPass;
use super::trust::Trust;
use crate::bounded::Bounded;
use crate::vehicle::G;

/// Accelerations of the body besides gravity, known from encoders and from the other estimates.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Disturbance {
    /// Acceleration of the axle up the slope, m/s^2.
    pub axle_acceleration_m_s2: f32,
    /// Cosine of the slope.
    pub cos_slope: f32,
    /// Yaw rate, rad/s.
    pub yaw_rate_rad_s: f32,
    /// Sine of the axle's roll: positive with its left end up.
    pub sin_roll: f32,
}

/// One reading of the body's IMU in SI units, in the plane of the wheels.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct TiltReading {
    /// Angular rate phi' (positive forward; the negative of the gyro's y axis), rad/s.
    pub rate_rad_s: f32,
    /// Specific force along the body's x axis, m/s^2.
    pub force_x_m_s2: f32,
    /// Specific force along the body's z axis, m/s^2.
    pub force_z_m_s2: f32,
}

/// Complementary filter for angle and gyro bias.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TiltEstimator {
    dt_s: f32,
    radius_m: f32,
    angle_gain_per_s: f32,
    bias_gain_per_s2: f32,
    angle_rad: f32,
    sin: f32,
    cos: f32,
    bias_rad_s: f32,
    rate_rad_s: f32,
    angle_rate_rad_s: f32,
    acceleration: LowPass,
    horizontal: LowPass,
    acceleration_rad_s2: f32,
    unfiltered_error: f32,
    unexplained: f32,
    vertical_m_s2: f32,
}

/// Largest error, as a sine, that corrects the angle while driving. The start of a slide looks like a wrong angle, and
/// must not correct the angle much before the estimator has detected the slide.
const CORRECTION_MAX: f32 = 0.015;
/// Time constant of the angular acceleration's filter.
const ACCELERATION_TIME_CONSTANT_S: f32 = 0.01;

impl TiltEstimator {
    /// An estimator called every `dt_s` seconds for an IMU at `radius_m` from the axle towards the
    /// hanging side (negative above the axle). The axle's acceleration is known `axle_lag_s` late.
    pub fn new(
        dt_s: f32,
        radius_m: f32,
        tilt_time_constant_s: f32,
        bias_time_constant_s: f32,
        axle_lag_s: f32,
    ) -> Self {
        Self {
            dt_s,
            radius_m,
            angle_gain_per_s: 1.0 / tilt_time_constant_s,
            bias_gain_per_s2: 1.0 / (tilt_time_constant_s * bias_time_constant_s),
            angle_rad: 0.0,
            sin: 0.0,
            cos: 1.0,
            bias_rad_s: 0.0,
            rate_rad_s: 0.0,
            angle_rate_rad_s: 0.0,
            acceleration: LowPass::new(dt_s, ACCELERATION_TIME_CONSTANT_S),
            horizontal: LowPass::new(dt_s, axle_lag_s),
            acceleration_rad_s2: 0.0,
            unfiltered_error: 0.0,
            unexplained: 0.0,
            vertical_m_s2: 0.0,
        }
    }

    /// Sets the angle from the direction of gravity alone, which is right only while the body is at rest.
    pub fn align(&mut self, reading: &TiltReading) {
        self.set_angle(libm::atan2f(reading.force_x_m_s2, reading.force_z_m_s2));
        self.rate_rad_s = reading.rate_rad_s - self.bias_rad_s;
        self.angle_rate_rad_s = self.rate_rad_s;
        self.acceleration.reset(self.rate_rad_s);
        self.horizontal.reset(0.0);
    }

    /// Updates the estimate with one reading.
    pub fn update(&mut self, reading: &TiltReading, disturbance: &Disturbance, trust: Trust) {
        let Disturbance {
            axle_acceleration_m_s2: a,
            cos_slope,
            yaw_rate_rad_s,
            sin_roll,
        } = *disturbance;
        let swing = reading.rate_rad_s - self.bias_rad_s;
        self.acceleration_rad_s2 = self.acceleration.update(swing);
        self.rate_rad_s = swing;
        let rate = swing + sin_roll * yaw_rate_rad_s;
        self.angle_rate_rad_s = rate;
        let (sin, cos) = (self.sin, self.cos);
        let turn = yaw_rate_rad_s * yaw_rate_rad_s * sin;
        let x = reading.force_x_m_s2 - self.radius_m * (self.acceleration_rad_s2 - turn * cos);
        let z = reading.force_z_m_s2 - self.radius_m * (swing * swing + turn * sin);
        let horizontal = x * cos - z * sin;
        self.vertical_m_s2 = x * sin + z * cos;
        let stands = trust.stands();
        if stands {
            // Nothing accelerates, so the loop of the faster correction needs no lag.
            self.horizontal.reset(horizontal);
        } else {
            self.horizontal.update(horizontal);
        }
        // g sin(phi_measured - phi): no inverse function, and bounded for any reading.
        self.unfiltered_error = ((horizontal - a * cos_slope) / G).bounded(-1.0, 1.0);
        self.unexplained = (self.horizontal.value() - a * cos_slope) / G;
        let error = self.error();
        let (factor, bias_factor) = trust.factors();
        self.bias_rad_s -= bias_factor * self.bias_gain_per_s2 * error * self.dt_s;
        let correction = if stands {
            error
        } else {
            error.bounded(-CORRECTION_MAX, CORRECTION_MAX)
        };
        self.set_angle(self.angle_rad + self.dt_s * (rate + factor * self.angle_gain_per_s * correction));
    }

    /// One tick without a believable reading: the estimate keeps the angle.
    pub fn hold(&mut self) {
        self.rate_rad_s = 0.0;
        self.angle_rate_rad_s = 0.0;
        self.acceleration.reset(0.0);
        self.acceleration_rad_s2 = 0.0;
        self.horizontal.reset(0.0);
        self.unexplained = 0.0;
        self.unfiltered_error = 0.0;
    }

    fn set_angle(&mut self, angle_rad: f32) {
        use core::f32::consts::PI;
        let mut angle = angle_rad;
        if angle > PI {
            angle -= 2.0 * PI;
        } else if angle < -PI {
            angle += 2.0 * PI;
        }
        self.angle_rad = angle;
        (self.sin, self.cos) = libm::sincosf(angle);
    }

    /// Sets the gyro bias, rad/s.
    pub fn set_bias(&mut self, bias_rad_s: f32) {
        self.bias_rad_s = bias_rad_s;
    }

    /// The angle from the vertical, rad in (-pi, pi].
    pub fn angle_rad(&self) -> f32 {
        self.angle_rad
    }

    /// Sine of the angle.
    pub fn sin(&self) -> f32 {
        self.sin
    }

    /// Cosine of the angle.
    pub fn cos(&self) -> f32 {
        self.cos
    }

    /// The rate of the angle itself, rad/s: the gyro's, and in a turn on a slope that of the plane which carries the body.
    pub fn angle_rate_rad_s(&self) -> f32 {
        self.angle_rate_rad_s
    }

    /// What the gyro shows with the bias taken out, rad/s.
    pub fn rate_rad_s(&self) -> f32 {
        self.rate_rad_s
    }

    /// The rate's filtered derivative, rad/s^2.
    pub fn acceleration_rad_s2(&self) -> f32 {
        self.acceleration_rad_s2
    }

    /// Sine of the angle between accelerometer and estimate in the last update, bounded to +-1.
    pub fn error(&self) -> f32 {
        self.unexplained.bounded(-1.0, 1.0)
    }

    /// The same error without the filter that delays the accelerometer as much as the axle's acceleration.
    pub fn unfiltered_error(&self) -> f32 {
        self.unfiltered_error
    }

    /// The accelerometer's horizontal component less the axle's acceleration in the last update, over g: the error
    /// without its bounds.
    pub fn unexplained(&self) -> f32 {
        self.unexplained
    }

    /// The accelerometer's vertical component in the last update, m/s^2: g at rest.
    pub fn vertical_m_s2(&self) -> f32 {
        self.vertical_m_s2
    }

    /// The learnt gyro bias, rad/s.
    pub fn bias_rad_s(&self) -> f32 {
        self.bias_rad_s
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::vehicle::GRAVITY_M_S2;

    const DT: f32 = 0.001;
    /// Standing on level ground.
    const LEVEL: Disturbance = Disturbance {
        axle_acceleration_m_s2: 0.0,
        cos_slope: 1.0,
        yaw_rate_rad_s: 0.0,
        sin_roll: 0.0,
    };

    /// Specific force of an IMU that swings as phi(t) on an axle that moves as x(t), by numerical
    /// differentiation of its position: an oracle that knows none of the formulas above.
    fn reading(t: f64, radius: f64, phi: &dyn Fn(f64) -> f64, x: &dyn Fn(f64) -> [f64; 2]) -> TiltReading {
        let place = |t: f64| {
            let [ax, az] = x(t);
            [ax + radius * phi(t).sin(), az - radius * phi(t).cos()]
        };
        let h = 1e-4;
        let (before, now, after) = (place(t - h), place(t), place(t + h));
        let acceleration: [f64; 2] = core::array::from_fn(|i| (before[i] - 2.0 * now[i] + after[i]) / (h * h));
        let force = [acceleration[0], acceleration[1] + GRAVITY_M_S2];
        let (s, c) = phi(t).sin_cos();
        TiltReading {
            rate_rad_s: ((phi(t + h) - phi(t - h)) / (2.0 * h)) as f32,
            force_x_m_s2: (force[0] * c + force[1] * s) as f32,
            force_z_m_s2: (-force[0] * s + force[1] * c) as f32,
        }
    }

    fn estimator() -> TiltEstimator {
        // In the tests the axle's acceleration is known without delay.
        TiltEstimator::new(DT, 0.1, 2.0, 60.0, 1e-6)
    }

    #[test]
    fn swinging_on_an_accelerating_axle_on_a_slope_is_followed() {
        let phi = |t: f64| 0.2 + 0.3 * (3.0 * t).sin();
        let slope: f64 = 0.15;
        // 0.3 g of axle acceleration along the slope.
        let along = |t: f64| -(0.3 * GRAVITY_M_S2 / 4.0) * (2.0 * t).sin();
        let x = |t: f64| [along(t) * slope.cos(), along(t) * slope.sin()];
        let mut estimator = estimator();
        estimator.set_angle(0.2);
        let mut worst: f64 = 0.0;
        for k in 0..20_000 {
            let t = f64::from(k) * f64::from(DT);
            let a = 0.3 * GRAVITY_M_S2 * (2.0 * t).sin();
            let disturbance = Disturbance {
                axle_acceleration_m_s2: a as f32,
                cos_slope: slope.cos() as f32,
                yaw_rate_rad_s: 0.0,
                sin_roll: 0.0,
            };
            estimator.update(&reading(t, 0.1, &phi, &x), &disturbance, Trust::Driving);
            if k > 5000 {
                worst = worst.max((f64::from(estimator.angle_rad()) - phi(t)).abs());
            }
        }
        assert!(worst < 0.3_f64.to_radians(), "{}", worst.to_degrees());
        assert!(worst > 1e-6);
    }

    #[test]
    fn without_compensation_the_same_motion_reads_wrong() {
        let x = |t: f64| [0.5 * 0.3 * GRAVITY_M_S2 * t * t, 0.0];
        let mut estimator = estimator();
        // At most 0.43 deg/s: what looks like this may be a slide.
        for k in 0..120_000 {
            let t = f64::from(k) * f64::from(DT);
            estimator.update(&reading(t, 0.1, &|_| 0.0, &x), &LEVEL, Trust::Driving);
        }
        let degrees = estimator.angle_rad().to_degrees();
        assert!((degrees - 16.7).abs() < 0.5, "0.3 g reads as {degrees} degrees");
    }

    #[test]
    fn the_bias_is_learnt_slowly_while_moving_and_fast_at_rest() {
        let run = |trust: Trust, ticks: usize| {
            let mut estimator = estimator();
            let reading = TiltReading {
                rate_rad_s: 0.02,
                force_x_m_s2: 0.0,
                force_z_m_s2: G,
            };
            for _ in 0..ticks {
                estimator.update(&reading, &LEVEL, trust);
            }
            estimator
        };
        let rest = run(Trust::AtRest, 2000);
        assert!((rest.bias_rad_s() - 0.02).abs() < 0.002, "{}", rest.bias_rad_s());
        let moving = run(Trust::Driving, 2000);
        assert!(
            moving.bias_rad_s() > 0.0 && moving.bias_rad_s() < 0.004,
            "{}",
            moving.bias_rad_s()
        );
        let settled = run(Trust::Driving, 400_000);
        assert!((settled.bias_rad_s() - 0.02).abs() < 0.001, "{}", settled.bias_rad_s());
        assert!(settled.angle_rad().abs() < 0.002, "{}", settled.angle_rad());
    }

    #[test]
    fn what_is_not_trusted_corrects_nothing_or_little() {
        let run = |trust: Trust| {
            let mut estimator = estimator();
            let reading = TiltReading {
                rate_rad_s: 0.0,
                force_x_m_s2: 0.1 * G,
                force_z_m_s2: G,
            };
            for _ in 0..1000 {
                estimator.update(&reading, &LEVEL, trust);
            }
            (estimator.angle_rad(), estimator.bias_rad_s())
        };
        assert_eq!(run(Trust::None), (0.0, 0.0));
        let settling = run(Trust::Settling);
        assert!((settling.0 - 0.1).abs() < 0.001 && settling.1 == 0.0, "{settling:?}");
        let (little, driving) = (run(Trust::Little), run(Trust::Driving));
        assert!(
            little.0 > 0.0 && little.0 < 0.15 * driving.0 && little.1 == 0.0,
            "{little:?}"
        );
    }

    #[test]
    fn align_reads_gravity() {
        let mut estimator = estimator();
        let phi = 0.4_f32;
        estimator.align(&TiltReading {
            rate_rad_s: 0.0,
            force_x_m_s2: G * phi.sin(),
            force_z_m_s2: G * phi.cos(),
        });
        assert!((estimator.angle_rad() - phi).abs() < 1e-6);
    }
}
