//! Stage 2: the vehicle's estimate of its own motion.

use crate::estimate::Estimate;
use crate::estimate::accelerometer_offset::AccelerometerOffset;
use crate::estimate::alignment::Alignment;
use crate::estimate::heading::{HeadingEstimator, YawReading};
use crate::estimate::odometry::Odometry;
use crate::estimate::rate_filter::LowPass;
use crate::estimate::roll::RollEstimator;
use crate::estimate::slope::SlopeEstimator;
use crate::estimate::stall::{Intent, Stall};
use crate::estimate::tilt::{Disturbance, TiltEstimator, TiltReading};
use crate::estimate::traction::{Evidence, Traction};
use crate::estimate::trust::Trust;
use crate::estimate::weight::Weight;
use crate::sample::{Motor, TICK_S};
use crate::sensed::Sensed;
use crate::supervise::supervisor::Believed;
use crate::vehicle::{Scales, Vehicle};

mod calibration;
mod contradiction;
mod ground;
mod motion;
mod standing;

use calibration::{Calibration, is_new};
use contradiction::Mountings;
use ground::{SLOPE_RATE_TIME_CONSTANT_S, Trail};
use motion::MeasuredMotion;
use standing::{Posture, Standing};

/// Stage 2's state.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Estimator {
    scales: Scales<f32>,
    half_track_m: f32,
    arm_radius_m: f32,
    arm: TiltEstimator,
    spar: Option<TiltEstimator>,
    slope: SlopeEstimator,
    slope_rate: LowPass,
    slope_turn_per_s: f32,
    heading: HeadingEstimator,
    alignment: Alignment,
    odometry: Odometry,
    traction: Traction,
    stall: Stall,
    /// Sine of the slope before the vehicle began to hesitate.
    free_sin_slope: f32,
    trail: Trail,
    theta_acceleration: LowPass,
    roll: RollEstimator,
    weight: Weight,
    standing: Standing,
    /// The arm IMU was lost in the last tick, or has not yet given a reading.
    arm_lost: bool,
    spar_lost: bool,
    mountings: Mountings,
    spar_calibration: Calibration<1>,
    ballast_offset_rad: f32,
    last_heading_rad: f32,
}

/// Sines and cosines of the angles, which the laws also need.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Estimated {
    /// What the vehicle believes of its own motion.
    pub estimate: Estimate,
    /// What the laws need of the same angles beside it.
    pub sines: Sines,
}

/// Sines and cosines of the estimated angles.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sines {
    /// Sine and cosine of the arm's angle from the vertical.
    pub phi: (f32, f32),
    /// Sine and cosine of the slope.
    pub slope: (f32, f32),
    /// Sine of the axle's roll: positive with its left end up.
    pub roll: f32,
    /// Change of the slope's sine by the vehicle's own turn, 1/s.
    pub slope_turn_per_s: f32,
}

/// Speed below which the vehicle counts as stopped, m/s.
pub const STOPPED_M_S: f32 = 0.05;
/// Rate of the arm below which the vehicle counts as stopped, rad/s.
const STOPPED_ARM_RAD_S: f32 = 0.2;
/// Time constant of the axle acceleration's filter.
const AXLE_ACCELERATION_TIME_CONSTANT_S: f32 = 0.02;

impl Estimator {
    pub(super) fn new(vehicle: &Vehicle<f32>) -> Self {
        let (p, planar) = (vehicle.parameters(), vehicle.planar(0.0));
        let times = &p.estimator;
        // The wheels show the axle's acceleration late: by the two stages of the rates' filter, and by the
        // acceleration's own filter.
        let lag_s = 2.0 * times.wheel_rate_time_constant_s + AXLE_ACCELERATION_TIME_CONSTANT_S;
        let tilt = |radius_m| {
            let (tilt_s, bias_s) = (times.tilt_time_constant_s, times.bias_time_constant_s);
            TiltEstimator::new(TICK_S, radius_m, tilt_s, bias_s, lag_s)
        };
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
            slope_rate: LowPass::new(TICK_S, SLOPE_RATE_TIME_CONSTANT_S),
            slope_turn_per_s: 0.0,
            heading: HeadingEstimator::new(TICK_S, times.bias_time_constant_s),
            alignment: Alignment::default(),
            odometry: Odometry::default(),
            traction: Traction::new(
                TICK_S,
                p.body.half_track_m,
                AccelerometerOffset::new(times.tilt_time_constant_s),
            ),
            stall: Stall::default(),
            free_sin_slope: 0.0,
            trail: Trail::default(),
            weight: Weight::new(TICK_S),
            theta_acceleration: LowPass::new(TICK_S, AXLE_ACCELERATION_TIME_CONSTANT_S),
            roll: RollEstimator::new(TICK_S, times.tilt_time_constant_s),
            standing: Standing::default(),
            arm_lost: true,
            spar_lost: true,
            mountings: Mountings::new(vehicle, AXLE_ACCELERATION_TIME_CONSTANT_S),
            spar_calibration: Calibration::default(),
            ballast_offset_rad: 0.0,
            last_heading_rad: 0.0,
        }
    }

    /// This estimator with the heading and the pose of another estimator. Every other quantity is estimated anew.
    pub(super) fn with_pose_of(self, other: &Self) -> Self {
        Self {
            heading: self.heading.with_heading_of(&other.heading),
            odometry: other.odometry,
            last_heading_rad: other.last_heading_rad,
            ..self
        }
    }

    /// Sines and cosines of the arm's angle and of the slope.
    pub(super) fn sines(&self) -> Sines {
        Sines {
            phi: (self.arm.sin(), self.arm.cos()),
            slope: (self.slope.sin(), self.slope.cos()),
            roll: self.sin_roll(),
            slope_turn_per_s: self.slope_turn_per_s,
        }
    }

    /// Sine of the axle's roll: positive with its left end up.
    fn sin_roll(&self) -> f32 {
        self.roll.sin() - self.alignment.sin_roll()
    }

    /// One tick. `disarmed` means that no motor is driven: only then does the ballast hang freely. `intent` is the
    /// command to the speed law in the last tick, and `believed` are the sensors that supervision believed then.
    pub(super) fn step(&mut self, sensed: &Sensed, believed: Believed, disarmed: bool, intent: Intent) -> Estimate {
        let [.., ballast_rate_rad_s] = sensed.relative_rate_rad_s;
        let [bias_x, bias_z] = self.heading.bias_rad_s();
        let biases = [self.arm.bias_rad_s(), bias_x, bias_z];
        let (posture, found) = self.standing.update(sensed, biases, believed, disarmed);
        if let Some([arm, x, z]) = found {
            self.arm.set_bias(arm);
            self.heading.set_bias([x, z]);
        }
        self.calibrate_spar(sensed, believed, posture.still && disarmed);
        if posture.calibrating || believed.arm_imu && self.arm_lost {
            // On a slope the hanging arm leans relative to the ground's normal. The estimator would learn an angle that
            // is not yet known as a bias of the gyro and as motion. Nor is it known how the arm turned while its IMU
            // was lost.
            self.arm.align(&sensed.arm);
            self.roll.align(sensed.arm_force_y_m_s2);
            self.slope.align(self.arm.sin());
        }
        self.arm_lost = !believed.arm_imu;

        let force_m_s2 = [sensed.arm.force_x_m_s2, sensed.arm.force_z_m_s2];
        self.weight.update(believed.arm_imu.then_some(force_m_s2));
        let trust = self.trust(posture);
        let motion = self.turn(sensed, believed, posture, trust);
        self.tilt(sensed, believed, &motion, trust);
        if posture.idle || !self.standing.is_calibrated() {
            // An angle that is not yet known looks like a slide.
            self.traction.stand();
        }
        let [contradicted, spar_contradicted] = self.contradicts(sensed, &motion, believed, disarmed);
        let stuck = self.climb(&motion, disarmed, intent);
        self.advance(sensed, &motion);

        let (spar_rad, spar_rate_rad_s) = self
            .spar
            .as_ref()
            .map_or((0.0, 0.0), |s| (s.angle_rad(), s.angle_rate_rad_s()));
        if posture.idle {
            // An idle ballast hangs straight down: its angle from the vertical is 0.
            self.ballast_offset_rad = -spar_rad - sensed.ballast_turned_rad;
        }
        Estimate {
            phi_rad: self.arm.angle_rad(),
            phi_rate_rad_s: self.arm.rate_rad_s(),
            theta_rate_rad_s: motion.theta_rate_rad_s,
            speed_m_s: if self.traction.slides() {
                self.traction.speed_m_s()
            } else {
                motion.wheels_m_s
            },
            slope_rad: if stuck {
                libm::asinf(self.free_sin_slope)
            } else {
                self.slope.angle_rad()
            },
            sin_slope: self.slope.sin(),
            heading_rad: self.heading.heading_rad(),
            yaw_rate_rad_s: self.heading.yaw_rate_rad_s(),
            distance_m: self.odometry.distance_m(),
            x_m: self.odometry.x_m(),
            y_m: self.odometry.y_m(),
            spar_rad,
            spar_rate_rad_s,
            ballast_rad: sensed.ballast_turned_rad + self.ballast_offset_rad,
            ballast_rate_rad_s,
            gyro_bias_rad_s: self.arm.bias_rad_s(),
            calibrated: self.standing.is_calibrated(),
            at_rest: posture.at_rest,
            stopped: motion.wheels_m_s.abs() < STOPPED_M_S
                && motion.phi_rate_rad_s.abs() < STOPPED_ARM_RAD_S
                && self.lowered(),
            contradicted,
            spar_contradicted,
            sliding: self.traction.slides(),
            stalled: self.stall.stalls(),
        }
    }

    /// Heading and wheel rate, which the gyro and the encoders show without delay, and the axle's roll.
    fn turn(&mut self, sensed: &Sensed, believed: Believed, posture: Posture, trust: Trust) -> MeasuredMotion {
        let [left, right, _] = sensed.relative_rate_rad_s;
        let r = self.scales.length_m;
        // The plane's normal in the arm's axes: turned by phi - beta from the arm's z axis.
        let (sin, cos) = (self.arm.sin(), self.arm.cos());
        let sin_normal = sin * self.slope.cos() - cos * self.slope.sin();
        let cos_normal = cos * self.slope.cos() + sin * self.slope.sin();
        let wheels_yaw_rad_s = 0.5 * (right - left) * r / self.half_track_m;
        if posture.calibrating {
            self.heading.stand();
        } else if !believed.arm_imu {
            self.heading.follow(wheels_yaw_rad_s);
        } else {
            let reading = YawReading {
                gyro_xz_rad_s: sensed.arm_gyro_xz_rad_s,
                normal_sin_cos: [sin_normal, cos_normal],
                wheels_rad_s: wheels_yaw_rad_s,
            };
            self.heading.update(&reading, posture.at_rest);
        }
        let yaw_rate_rad_s = self.heading.yaw_rate_rad_s();
        // Wheel rate: the relative rate less the arm's rate. Without its gyro the arm is assumed to hang still.
        let swing_rad_s = if believed.arm_imu {
            sensed.arm.rate_rad_s - self.arm.bias_rad_s()
        } else {
            0.0
        };
        let phi_rate_rad_s = swing_rad_s - self.alignment.swing_rad_s(yaw_rate_rad_s);
        let theta_rate_rad_s = 0.5 * (left + right) - phi_rate_rad_s;
        if posture.calibrating {
            // The step by which the bias disappears is no acceleration.
            self.theta_acceleration.reset(theta_rate_rad_s);
        }
        let wheels_m_s = theta_rate_rad_s * r;
        if believed.arm_imu {
            self.roll(sensed, phi_rate_rad_s, wheels_m_s, trust);
        }
        self.alignment
            .update(TICK_S, yaw_rate_rad_s, swing_rad_s, self.roll.sin(), wheels_m_s);
        MeasuredMotion {
            phi_rate_rad_s,
            theta_rate_rad_s,
            wheels_m_s,
            wheels_m_s2: r * self.theta_acceleration.update(theta_rate_rad_s),
            yaw_rate_rad_s,
            wheels_yaw_rad_s,
            sin_roll: self.sin_roll(),
        }
    }

    /// Estimates the angles of arm and spar, and whether the wheels roll.
    fn tilt(&mut self, sensed: &Sensed, believed: Believed, motion: &MeasuredMotion, trust: Trust) {
        self.slope.turn(motion.yaw_rate_rad_s * motion.sin_roll * TICK_S);
        let disturbance = Disturbance {
            axle_acceleration_m_s2: motion.wheels_m_s2,
            cos_slope: self.slope.cos(),
            yaw_rate_rad_s: motion.yaw_rate_rad_s,
            sin_roll: motion.sin_roll,
        };
        let aligned = TiltReading {
            rate_rad_s: sensed.arm.rate_rad_s - self.alignment.swing_rad_s(motion.yaw_rate_rad_s),
            ..sensed.arm
        };
        if believed.arm_imu {
            self.arm.update(&aligned, &disturbance, trust);
        } else {
            self.arm.hold();
        }
        self.traction.update(&Evidence {
            wheels_m_s: motion.wheels_m_s,
            wheels_m_s2: motion.wheels_m_s2,
            swing_m_s2: self.arm_radius_m * self.arm.acceleration_rad_s2(),
            tilt_error: self.arm.error(),
            sideways_m_s2: self.roll.unexplained_m_s2(),
            yaw_rate_rad_s: motion.yaw_rate_rad_s,
            wheels_yaw_rad_s: motion.wheels_yaw_rad_s,
            weighs: self.weight.is_steady(),
            slow: self.mountings.rest_next(),
        });
        if let Some(spar) = &mut self.spar {
            if believed.spar_imu {
                spar.update(&sensed.spar, &disturbance, trust);
            } else {
                spar.hold();
            }
        }
    }

    /// Advances the pose by the mean advance of the wheels, or of the sliding vehicle, at the mean heading of the tick.
    fn advance(&mut self, sensed: &Sensed, motion: &MeasuredMotion) {
        let [advance_m, left_m] = if self.traction.slides() {
            [
                self.traction.speed_m_s() * TICK_S,
                self.traction.sideways_m_s() * TICK_S,
            ]
        } else {
            let advance = sensed.relative_advance_rad;
            let relative = 0.5 * (advance[Motor::Left as usize] + advance[Motor::Right as usize]);
            [(relative - motion.phi_rate_rad_s * TICK_S) * self.scales.length_m, 0.0]
        };
        let heading = self.heading.heading_rad();
        self.odometry
            .advance(advance_m, left_m, 0.5 * (heading + self.last_heading_rad));
        self.last_heading_rad = heading;
    }

    /// Averages the spar's gyro at rest, separately from the arm's, because the vehicle can also drive without a spar.
    /// The average starts again after the spar IMU was lost.
    fn calibrate_spar(&mut self, sensed: &Sensed, believed: Believed, still: bool) {
        let Some(spar) = &mut self.spar else { return };
        if believed.spar_imu && self.spar_lost {
            spar.align(&sensed.spar);
        }
        self.spar_lost = !believed.spar_imu;
        if self.spar_lost {
            self.spar_calibration = Calibration::default();
        }
        if let Some([bias]) = self
            .spar_calibration
            .update([sensed.spar.rate_rad_s], still && is_new(&sensed.spar_imu))
        {
            spar.set_bias(bias);
            spar.align(&sensed.spar);
        }
    }
}
