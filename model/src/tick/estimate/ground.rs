//! The ground under the wheels: its slope, the roll of the axle on it, how far the accelerometers can be trusted, and
//! whether something blocks the vehicle.

use super::Estimator;
use super::motion::MeasuredMotion;
use super::standing::Posture;
use crate::bounded::Bounded;
use crate::estimate::roll::RollReading;
use crate::estimate::stall::{Intent, Progress};
use crate::estimate::trust::Trust;
use crate::sensed::Sensed;

/// Distance after which the estimator stores the slope again, m.
const TRAIL_M: f32 = 0.05;
/// Time constant of the slope's rate in a turn, and the sine of the largest roll of the axle that enters this rate.
pub(super) const SLOPE_RATE_TIME_CONSTANT_S: f32 = 0.1;
const SIN_ROLL_MAX: f32 = 0.5;
/// Difference between the sines of the arm's angle and of its equilibrium within which the arm counts as lowered.
const LOWERED: f32 = 0.15;

/// The slope a little way back, because the estimator of a vehicle that bounces off an obstacle mistakes the obstacle
/// for a hill.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct Trail {
    place_m: f32,
    sin_slope: f32,
}

impl Estimator {
    /// How far the accelerometers show where down is.
    pub(super) fn trust(&self, posture: Posture) -> Trust {
        match (self.weight.is_carried(), self.traction.slides()) {
            _ if posture.settled => Trust::AtRest,
            _ if posture.idle => Trust::Settling,
            (false, _) => Trust::None,
            (true, true) => Trust::Little,
            (true, false) => Trust::Driving,
        }
    }

    /// Estimates the roll of the axle of a vehicle whose wheels show `wheels_m_s`.
    #[inline]
    pub(super) fn roll(&mut self, sensed: &Sensed, phi_rate_rad_s: f32, wheels_m_s: f32, trust: Trust) {
        let ([x, z], [bias_x, bias_z]) = (sensed.arm_gyro_xz_rad_s, self.heading.bias_rad_s());
        let (sin, cos) = (self.arm.sin(), self.arm.cos());
        let cos_normal = cos * self.slope.cos() + sin * self.slope.sin();
        let yaw_rate_rad_s = self.heading.yaw_rate_rad_s();
        // The IMU is below the axle: while it swings forward, the turn accelerates it to the left (Coriolis).
        let coriolis_m_s2 = 2.0 * self.arm_radius_m * cos_normal * phi_rate_rad_s * yaw_rate_rad_s;
        let reading = RollReading {
            gyro_xz_rad_s: [x - bias_x, z - bias_z],
            phi_sin_cos: [sin, cos],
            force_m_s2: sensed.arm_force_y_m_s2 - wheels_m_s * yaw_rate_rad_s - coriolis_m_s2,
        };
        self.roll.update(&reading, trust);
    }

    /// Estimates the slope and whether an obstacle blocks the vehicle.
    pub(super) fn climb(&mut self, motion: &MeasuredMotion, disarmed: bool, intent: Intent) -> bool {
        let stuck = self.progress(disarmed, intent, motion.wheels_m_s) == Progress::Stuck;
        if let Some(lesson) = intent.slope_lesson
            && !self.traction.slides()
        {
            // A vehicle that falls or lands feels no slope.
            if self.weight.is_carried() {
                self.slope.learn(lesson);
            }
            self.free_sin_slope = self.slope.sin();
        } else if stuck && !self.stall.stalls() {
            self.slope.reset(self.free_sin_slope);
        } else if self.weight.is_carried() {
            let t = self.scales.time_s;
            let axle_m_s2 = self.traction.acceleration_m_s2(motion.wheels_m_s2);
            self.slope.update(
                self.arm.sin(),
                self.arm.cos(),
                motion.phi_rate_rad_s * t,
                self.arm.acceleration_rad_s2() * t * t,
                axle_m_s2 / self.scales.length_m * t * t,
            );
        }
        // A mounting error of the IMU falsifies the roll-based rate of the slope, but not the slope.
        let most_per_s = SIN_ROLL_MAX * motion.yaw_rate_rad_s.abs();
        self.slope_turn_per_s = self
            .slope_rate
            .update(self.slope.sin())
            .bounded(-most_per_s, most_per_s);
        stuck
    }

    /// Checks whether an obstacle blocks the vehicle. Until the vehicle hesitates, this function stores the slope
    /// under it.
    fn progress(&mut self, disarmed: bool, intent: Intent, speed_m_s: f32) -> Progress {
        if disarmed {
            self.stall.reset();
            return Progress::Free;
        }
        let was_stuck = self.stall.is_stuck();
        let progress = self.stall.update(intent, speed_m_s, self.odometry.distance_m());
        if was_stuck && progress != Progress::Stuck {
            // Behind the obstacle the ground continues with the slope from before the obstacle.
            self.slope.reset(self.free_sin_slope);
        }
        let driven_m = self.odometry.distance_m() - self.trail.place_m;
        if progress == Progress::Free && (driven_m.abs() > TRAIL_M || intent.target_m_s == 0.0) {
            let standing = intent.target_m_s == 0.0;
            self.free_sin_slope = if standing {
                self.slope.sin()
            } else {
                self.trail.sin_slope
            };
            self.trail = Trail {
                place_m: self.odometry.distance_m(),
                sin_slope: self.slope.sin(),
            };
        }
        progress
    }

    /// Whether the arm is close to its rest angle on this slope, where open bridges leave it.
    pub(super) fn lowered(&self) -> bool {
        let sin_slope = if self.stall.is_stuck() {
            self.free_sin_slope
        } else {
            self.slope.sin()
        };
        (self.arm.sin() - self.slope.sin_equilibrium(sin_slope)).abs() < LOWERED
    }
}
