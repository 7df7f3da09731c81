//! Stage 2: what the vehicle knows of itself.

use crate::bounded::Bounded;
use crate::estimate::Estimate;
use crate::estimate::heading::HeadingEstimator;
use crate::estimate::odometry::Odometry;
use crate::estimate::rate_filter::LowPass;
use crate::estimate::slope::SlopeEstimator;
use crate::estimate::tilt::{Disturbance, TiltEstimator};
use crate::sample::{Motor, TICK_S};
use crate::sensed::Sensed;
use crate::supervise::plausibility::Persistence;
use crate::vehicle::{GRAVITY_M_S2, Scales, Vehicle};

/// Stage 2's state.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Estimator {
    scales: Scales<f32>,
    half_track_m: f32,
    arm: TiltEstimator,
    spar: Option<TiltEstimator>,
    slope: SlopeEstimator,
    heading: HeadingEstimator,
    odometry: Odometry,
    theta_acceleration: LowPass,
    roll: LowPass,
    rest: Persistence,
    contradicted: Persistence,
    calibration: Calibration,
    ballast_offset_rad: f32,
    last_heading_rad: f32,
}

const G: f32 = GRAVITY_M_S2 as f32;
/// Speed and arm rate below which the vehicle is stopped.
const STOPPED_M_S: f32 = 0.05;
const STOPPED_ARM_RAD_S: f32 = 0.2;
/// Wheel and arm rates below which the vehicle stands still.
const REST_WHEEL_RAD_S: f32 = 0.03;
const REST_ARM_RAD_S: f32 = 0.05;
/// Ticks in a row for which the vehicle must stand still to be at rest.
const STILL_TICKS: u16 = 100;
/// Largest gyro bias that a calibration may find; more is motion.
const BIAS_MAX_RAD_S: f32 = 0.1;
/// Ticks over which a calibration averages the gyros.
const CALIBRATION_TICKS: u16 = 500;
/// Time constant of the axle acceleration's filter.
const AXLE_ACCELERATION_TIME_CONSTANT_S: f32 = 0.02;
/// Time constant of the axle's roll.
const ROLL_TIME_CONSTANT_S: f32 = 0.2;
/// Sine of the angle between integrated gyro and accelerometer that cannot last: one of the two is wrong.
const CONTRADICTION: f32 = 0.7;
const CONTRADICTION_TICKS: u16 = 300;

impl Estimator {
    pub(super) fn new(vehicle: &Vehicle<f32>) -> Self {
        let (p, planar) = (vehicle.parameters(), vehicle.planar(0.0));
        let times = &p.estimator;
        let tilt =
            |radius_m| TiltEstimator::new(TICK_S, radius_m, times.tilt_time_constant_s, times.bias_time_constant_s);
        Self {
            scales: vehicle.scales(),
            half_track_m: p.body.half_track_m,
            arm: tilt(p.imu.arm_radius_m),
            // The spar's IMU sits above the axle: a negative radius.
            spar: p.spar.as_ref().map(|_| tilt(-p.imu.spar_radius_m)),
            slope: SlopeEstimator::new(
                TICK_S,
                times.slope_time_constant_s,
                planar.l,
                planar.alpha,
                planar.mu,
                vehicle.spar_mass_ratio(),
            ),
            heading: HeadingEstimator::new(TICK_S, times.bias_time_constant_s),
            odometry: Odometry::default(),
            theta_acceleration: LowPass::new(TICK_S, AXLE_ACCELERATION_TIME_CONSTANT_S),
            roll: LowPass::new(TICK_S, ROLL_TIME_CONSTANT_S),
            rest: Persistence::new(STILL_TICKS),
            contradicted: Persistence::new(CONTRADICTION_TICKS),
            calibration: Calibration::default(),
            ballast_offset_rad: 0.0,
            last_heading_rad: 0.0,
        }
    }

    /// This estimator with the heading and the pose of another one; everything else is estimated anew.
    pub(super) fn with_pose_of(self, other: &Self) -> Self {
        Self {
            heading: self.heading.with_heading_of(&other.heading),
            odometry: other.odometry,
            last_heading_rad: other.last_heading_rad,
            ..self
        }
    }

    /// One tick. `disarmed` tells that no motor is driven: only then does the ballast hang.
    pub(super) fn step(&mut self, sensed: &Sensed, disarmed: bool) -> Estimate {
        let [left, right, ballast_rate_rad_s] = sensed.relative_rate_rad_s;
        let still = left.abs() < REST_WHEEL_RAD_S
            && right.abs() < REST_WHEEL_RAD_S
            && (sensed.arm.rate_rad_s - self.arm.bias_rad_s()).abs() < REST_ARM_RAD_S.max(self.calibration.tolerance());
        let at_rest = self.rest.update(still);
        self.calibrate(sensed, still && disarmed);

        // Wheel rate: the relative rate less the arm's.
        let r = self.scales.length_m;
        let phi_rate = sensed.arm.rate_rad_s - self.arm.bias_rad_s();
        let theta_rate = 0.5 * (left + right) - phi_rate;
        let theta_acceleration = self.theta_acceleration.update(theta_rate);
        let [gyro_x, gyro_z] = sensed.arm_gyro_xz_rad_s;
        // The plane's normal seen from the arm: turned by phi - beta from the arm's z axis.
        let (sin, cos) = (self.arm.sin(), self.arm.cos());
        let sin_normal = sin * self.slope.cos() - cos * self.slope.sin();
        let cos_normal = cos * self.slope.cos() + sin * self.slope.sin();
        let gyro_yaw = gyro_z * cos_normal + gyro_x * sin_normal;
        let wheels_yaw = 0.5 * (right - left) * r / self.half_track_m;
        self.heading.update(gyro_yaw, wheels_yaw, at_rest);

        // Roll of the axle: gravity along it, once the acceleration of the turn is taken away.
        let yaw_rate = self.heading.yaw_rate_rad_s();
        let lateral_m_s2 = sensed.arm_force_y_m_s2 - theta_rate * r * yaw_rate;
        self.roll.update((lateral_m_s2 / G).bounded(-1.0, 1.0));
        let sin_roll = self.roll.value();
        self.slope.turn(yaw_rate * TICK_S, sin_roll);
        let disturbance = Disturbance {
            axle_acceleration_m_s2: r * theta_acceleration,
            sin_slope: self.slope.sin(),
            cos_slope: self.slope.cos(),
            yaw_rate_rad_s: yaw_rate,
            sin_roll,
        };
        let rest = at_rest && disarmed;
        self.arm.update(&sensed.arm, &disturbance, rest);
        let contradicted = self.contradicted.update(self.arm.error().abs() > CONTRADICTION);
        if let Some(spar) = &mut self.spar {
            spar.update(&sensed.spar, &disturbance, rest);
        }
        let t = self.scales.time_s;
        self.slope.update(
            self.arm.sin(),
            self.arm.cos(),
            phi_rate * t,
            self.arm.acceleration_rad_s2() * t * t,
            theta_acceleration * t * t,
        );

        // The mean advance of the wheels over the plane, at the mean heading of the tick.
        let advance = sensed.relative_advance_rad;
        let advance_rad = 0.5 * (advance[Motor::Left as usize] + advance[Motor::Right as usize]) - phi_rate * TICK_S;
        let heading = self.heading.heading_rad();
        self.odometry
            .advance(advance_rad * r, 0.5 * (heading + self.last_heading_rad));
        self.last_heading_rad = heading;

        let (spar_rad, spar_rate_rad_s) = self
            .spar
            .as_ref()
            .map_or((0.0, 0.0), |s| (s.angle_rad(), s.rate_rad_s()));
        if rest {
            // An idle ballast hangs straight down: its angle from the vertical is 0.
            self.ballast_offset_rad = -spar_rad - sensed.ballast_turned_rad;
        }
        Estimate {
            phi_rad: self.arm.angle_rad(),
            phi_rate_rad_s: self.arm.rate_rad_s(),
            theta_rate_rad_s: theta_rate,
            speed_m_s: theta_rate * r,
            slope_rad: self.slope.angle_rad(),
            sin_slope: self.slope.sin(),
            heading_rad: heading,
            yaw_rate_rad_s: self.heading.yaw_rate_rad_s(),
            distance_m: self.odometry.distance_m(),
            x_m: self.odometry.x_m(),
            y_m: self.odometry.y_m(),
            spar_rad,
            spar_rate_rad_s,
            ballast_rad: sensed.ballast_turned_rad + self.ballast_offset_rad,
            ballast_rate_rad_s,
            gyro_bias_rad_s: self.arm.bias_rad_s(),
            calibrated: self.calibration.done,
            at_rest,
            stopped: (theta_rate * r).abs() < STOPPED_M_S && phi_rate.abs() < STOPPED_ARM_RAD_S,
            contradicted,
        }
    }

    /// Averages the gyros once, while the vehicle stands still.
    fn calibrate(&mut self, sensed: &Sensed, still: bool) {
        if self.calibration.done {
            return;
        }
        let [gyro_x, gyro_z] = sensed.arm_gyro_xz_rad_s;
        let Some([arm, spar, x, z]) = self
            .calibration
            .update([sensed.arm.rate_rad_s, sensed.spar.rate_rad_s, gyro_x, gyro_z], still)
        else {
            return;
        };
        self.arm.set_bias(arm);
        self.arm.align(&sensed.arm);
        if let Some(estimator) = &mut self.spar {
            estimator.set_bias(spar);
            estimator.align(&sensed.spar);
        }
        self.heading.set_bias(z * self.arm.cos() + x * self.arm.sin());
        self.slope.align(self.arm.sin());
    }
}

/// Average of the gyros at rest.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
struct Calibration {
    sums: [f32; 4],
    ticks: u16,
    done: bool,
}

impl Calibration {
    /// Arm rate that still counts as rest: before the bias is known, all of it may be bias.
    fn tolerance(&self) -> f32 {
        if self.done { 0.0 } else { BIAS_MAX_RAD_S }
    }

    /// Takes the gyros of one tick; returns the averages once there are enough.
    fn update(&mut self, rates: [f32; 4], still: bool) -> Option<[f32; 4]> {
        let plausible = rates.iter().all(|rate| rate.abs() < BIAS_MAX_RAD_S);
        if !still || !plausible {
            *self = Self::default();
            return None;
        }
        for (sum, rate) in self.sums.iter_mut().zip(rates) {
            *sum += rate;
        }
        self.ticks += 1;
        if self.ticks < CALIBRATION_TICKS {
            return None;
        }
        self.done = true;
        Some(self.sums.map(|sum| sum / f32::from(CALIBRATION_TICKS)))
    }
}
