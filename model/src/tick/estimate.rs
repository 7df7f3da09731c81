//! Stage 2: what the vehicle knows of itself.

use crate::bounded::Bounded;
use crate::estimate::Estimate;
use crate::estimate::heading::{HeadingEstimator, YawReading};
use crate::estimate::odometry::Odometry;
use crate::estimate::rate_filter::LowPass;
use crate::estimate::slope::SlopeEstimator;
use crate::estimate::stall::{Intent, Progress, Stall};
use crate::estimate::tilt::{Disturbance, TiltEstimator, TiltReading, Trust};
use crate::estimate::traction::{Evidence, Traction};
use crate::sample::{Motor, TICK_S};
use crate::sensed::Sensed;
use crate::supervise::plausibility::Persistence;
use crate::vehicle::{GRAVITY_M_S2, Scales, Vehicle};

/// Stage 2's state.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Estimator {
    scales: Scales<f32>,
    half_track_m: f32,
    arm_radius_m: f32,
    arm: TiltEstimator,
    spar: Option<TiltEstimator>,
    slope: SlopeEstimator,
    heading: HeadingEstimator,
    odometry: Odometry,
    traction: Traction,
    stall: Stall,
    /// Sine of the slope before the vehicle began to hesitate.
    free_sin_slope: f32,
    theta_acceleration: LowPass,
    roll: LowPass,
    weighs: Persistence,
    rest: Persistence,
    contradicted: Persistence,
    calibration: Calibration<3>,
    spar_calibration: Calibration<1>,
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
/// Range of the specific force, in g, in which the accelerometer shows where down is: below, the vehicle falls; above,
/// it lands.
const WEIGHT_MIN_G: f32 = 0.5;
const WEIGHT_MAX_G: f32 = 2.0;
/// Ticks for which it must be back in the range before it is trusted again: the wheels rebound.
const WEIGHT_TICKS: u16 = 30;
/// Distance of the sine of the arm's angle from that of its equilibrium within which the arm counts as lowered.
const LOWERED: f32 = 0.15;
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
            arm_radius_m: p.imu.arm_radius_m,
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
            traction: Traction::new(TICK_S, p.body.half_track_m),
            stall: Stall::default(),
            free_sin_slope: 0.0,
            weighs: Persistence::new(WEIGHT_TICKS),
            theta_acceleration: LowPass::new(TICK_S, AXLE_ACCELERATION_TIME_CONSTANT_S),
            roll: LowPass::new(TICK_S, ROLL_TIME_CONSTANT_S),
            rest: Persistence::new(STILL_TICKS),
            contradicted: Persistence::new(CONTRADICTION_TICKS),
            calibration: Calibration::default(),
            spar_calibration: Calibration::default(),
            ballast_offset_rad: 0.0,
            last_heading_rad: 0.0,
        }
    }

    /// One tick. `disarmed` tells that no motor is driven: only then does the ballast hang. `intent` is what the
    /// speed law was told in the last tick.
    pub(super) fn step(&mut self, sensed: &Sensed, disarmed: bool, intent: &Intent) -> Estimate {
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
        // The plane's normal seen from the arm: turned by phi - beta from the arm's z axis.
        let (sin, cos) = (self.arm.sin(), self.arm.cos());
        let sin_normal = sin * self.slope.cos() - cos * self.slope.sin();
        let cos_normal = cos * self.slope.cos() + sin * self.slope.sin();
        let wheels_yaw_rad_s = 0.5 * (right - left) * r / self.half_track_m;
        self.heading.update(
            &YawReading {
                gyro_xz_rad_s: sensed.arm_gyro_xz_rad_s,
                normal_sin_cos: [sin_normal, cos_normal],
                wheels_rad_s: wheels_yaw_rad_s,
            },
            at_rest,
        );

        // Roll of the axle: gravity along it, once the acceleration of the turn is taken away.
        let yaw_rate = self.heading.yaw_rate_rad_s();
        let lateral_m_s2 = sensed.arm_force_y_m_s2 - theta_rate * r * yaw_rate;
        self.roll.update((lateral_m_s2 / G).bounded(-1.0, 1.0));
        let sin_roll = self.roll.value();
        self.slope.turn(yaw_rate * TICK_S, sin_roll);
        let wheels_m_s2 = r * theta_acceleration;
        let axle_m_s2 = self.traction.acceleration_m_s2(wheels_m_s2);
        let disturbance = Disturbance {
            axle_acceleration_m_s2: wheels_m_s2,
            sin_slope: self.slope.sin(),
            cos_slope: self.slope.cos(),
            yaw_rate_rad_s: yaw_rate,
            sin_roll,
        };
        let rest = at_rest && disarmed;
        let weighs = self.weighs.update(weighs(&sensed.arm));
        let trust = match (weighs, self.traction.slides()) {
            _ if rest => Trust::AtRest,
            (false, _) => Trust::None,
            (true, true) => Trust::Little,
            (true, false) => Trust::Driving,
        };
        self.arm.update(&sensed.arm, &disturbance, trust);
        self.traction.update(&Evidence {
            wheels_m_s: theta_rate * r,
            wheels_m_s2,
            swing_m_s2: self.arm_radius_m * self.arm.acceleration_rad_s2(),
            tilt_error: self.arm.error(),
            yaw_difference_rad_s: yaw_rate - wheels_yaw_rad_s,
            weighs,
        });
        let contradicted = self.contradicted.update(self.arm.error().abs() > CONTRADICTION);
        if let Some(spar) = &mut self.spar {
            spar.update(&sensed.spar, &disturbance, trust);
        }
        let stuck = self.progress(disarmed, intent, theta_rate * r) == Progress::Stuck;
        if stuck && !self.stall.stalls() {
            self.slope.reset(self.free_sin_slope);
        } else if weighs {
            let t = self.scales.time_s;
            self.slope.update(
                self.arm.sin(),
                self.arm.cos(),
                phi_rate * t,
                self.arm.acceleration_rad_s2() * t * t,
                axle_m_s2 / r * t * t,
            );
        }

        // The mean advance of the wheels over the plane, or of the sliding vehicle, at the mean heading of the tick.
        let advance = sensed.relative_advance_rad;
        let advance_rad = 0.5 * (advance[Motor::Left as usize] + advance[Motor::Right as usize]) - phi_rate * TICK_S;
        let advance_m = if self.traction.slides() {
            self.traction.speed_m_s() * TICK_S
        } else {
            advance_rad * r
        };
        let heading = self.heading.heading_rad();
        self.odometry
            .advance(advance_m, 0.5 * (heading + self.last_heading_rad));
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
            speed_m_s: self.traction.speed_m_s(),
            slope_rad: if stuck {
                libm::asinf(self.free_sin_slope)
            } else {
                self.slope.angle_rad()
            },
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
            stopped: (theta_rate * r).abs() < STOPPED_M_S && phi_rate.abs() < STOPPED_ARM_RAD_S && self.lowered(),
            contradicted,
            sliding: self.traction.slides(),
            stalled: self.stall.stalls(),
        }
    }

    /// Whether something blocks the vehicle; until it hesitates, the slope under it is noted.
    fn progress(&mut self, disarmed: bool, intent: &Intent, speed_m_s: f32) -> Progress {
        if disarmed {
            self.stall.reset();
            return Progress::Free;
        }
        let was_stuck = self.stall.is_stuck();
        let progress = self.stall.update(intent, speed_m_s, self.odometry.distance_m());
        if was_stuck && progress != Progress::Stuck {
            // Behind the obstacle the ground goes on as before it.
            self.slope.reset(self.free_sin_slope);
        }
        if progress == Progress::Free {
            self.free_sin_slope = self.slope.sin();
        }
        progress
    }

    /// Whether the arm hangs about where it does when the vehicle stands still on this slope: open bridges then leave
    /// it there.
    fn lowered(&self) -> bool {
        let sin_slope = if self.stall.is_stuck() {
            self.free_sin_slope
        } else {
            self.slope.sin()
        };
        (self.arm.sin() - self.slope.sin_equilibrium(sin_slope)).abs() < LOWERED
    }

    /// Averages the gyros once, while the vehicle stands still: the spar's by itself, as the vehicle drives without.
    fn calibrate(&mut self, sensed: &Sensed, still: bool) {
        let [gyro_x, gyro_z] = sensed.arm_gyro_xz_rad_s;
        if let Some([arm, x, z]) = self.calibration.update([sensed.arm.rate_rad_s, gyro_x, gyro_z], still) {
            self.arm.set_bias(arm);
            self.arm.align(&sensed.arm);
            self.heading.set_bias([x, z]);
            self.slope.align(self.arm.sin());
        }
        if let Some(estimator) = &mut self.spar
            && let Some([spar]) = self.spar_calibration.update([sensed.spar.rate_rad_s], still)
        {
            estimator.set_bias(spar);
            estimator.align(&sensed.spar);
        }
    }
}

/// Whether the accelerometer feels about the weight of a vehicle that stands on its wheels.
fn weighs(reading: &TiltReading) -> bool {
    let TiltReading {
        force_x_m_s2: x,
        force_z_m_s2: z,
        ..
    } = *reading;
    let squared_g2 = (x * x + z * z) / (G * G);
    (WEIGHT_MIN_G * WEIGHT_MIN_G..WEIGHT_MAX_G * WEIGHT_MAX_G).contains(&squared_g2)
}

/// Average of gyro axes at rest.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Calibration<const N: usize> {
    sums: [f32; N],
    ticks: u16,
    done: bool,
}

impl<const N: usize> Default for Calibration<N> {
    fn default() -> Self {
        Self {
            sums: [0.0; N],
            ticks: 0,
            done: false,
        }
    }
}

impl<const N: usize> Calibration<N> {
    /// Arm rate that still counts as rest: before the bias is known, all of it may be bias.
    fn tolerance(&self) -> f32 {
        if self.done { 0.0 } else { BIAS_MAX_RAD_S }
    }

    /// Takes the gyros of one tick; returns the averages once, when there are enough.
    fn update(&mut self, rates: [f32; N], still: bool) -> Option<[f32; N]> {
        if self.done {
            return None;
        }
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
