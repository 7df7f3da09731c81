//! Detects whether the vehicle stands still, and calibrates its gyros' biases.
//!
//! Only at rest do the gyros show their biases and the accelerometer gravity alone. A falsely detected rest leads to
//! wrong biases, and with a wrong bias the vehicle seems to move for ever. Therefore
//!
//! - a vehicle with a sensor that supervision does not believe never counts as at rest;
//! - an arm IMU that was lost is calibrated again, because it is not known how the arm turned meanwhile;
//! - wheels that stand for a long time while a gyro shows a constant rate prove a wrong bias.

use super::calibration::{BIAS_MAX_RAD_S, Calibration, is_new};
use crate::estimate::heading::AGREEMENT_RAD_S;
use crate::estimate::stillness::Stillness;
use crate::persistence::Persistence;
use crate::sensed::Sensed;
use crate::supervise::supervisor::Believed;

/// Arm rate below which the vehicle counts as standing still, rad/s.
const REST_ARM_RAD_S: f32 = 0.05;
/// Consecutive ticks for which the vehicle must stand still to be at rest.
const STILL_TICKS: u16 = 100;
/// Ticks at rest after which the arm's angle has settled on gravity. Before that, an error of the angle is no bias.
const SETTLED_TICKS: u16 = 500;
/// Ticks for which the wheels must stand while a gyro shows a turn, before that turn counts as its bias.
const UNEXPLAINED_TICKS: u16 = 2000;

/// The findings of one tick.
#[allow(clippy::struct_excessive_bools)] // Each is a finding of its own.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Posture {
    /// Wheels and arm stand still.
    pub(super) still: bool,
    /// Wheels and arm have stood still for a while.
    pub(super) at_rest: bool,
    /// The vehicle is disarmed, at rest, and nothing moves the arm.
    pub(super) idle: bool,
    /// The vehicle has been idle for long enough that the arm's angle has settled.
    pub(super) settled: bool,
    /// The vehicle stands still, disarmed, and its gyros' biases are being averaged.
    pub(super) calibrating: bool,
}

/// Watches for rest and averages the gyros.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Standing {
    wheels: Stillness,
    rest: Persistence,
    settled: Persistence,
    unexplained: Persistence,
    calibration: Calibration<3>,
}

impl Default for Standing {
    fn default() -> Self {
        Self {
            wheels: Stillness::default(),
            rest: Persistence::new(STILL_TICKS),
            settled: Persistence::new(SETTLED_TICKS),
            unexplained: Persistence::new(UNEXPLAINED_TICKS),
            calibration: Calibration::default(),
        }
    }
}

impl Standing {
    /// Whether the biases of the arm's gyros are known.
    pub(super) fn is_calibrated(&self) -> bool {
        self.calibration.is_done()
    }

    /// Updates the detector with one tick: the arm's gyro rates and their biases (y, x, z), in rad/s, and whether
    /// supervision believes the sensors. Returns the posture, and the biases in the tick in which they become known.
    pub(super) fn update(
        &mut self,
        sensed: &Sensed,
        biases_rad_s: [f32; 3],
        believed: Believed,
        disarmed: bool,
    ) -> (Posture, Option<[f32; 3]>) {
        let [left, right, _] = sensed.relative_rate_rad_s;
        let [left_count, right_count, _] = sensed.encoder_counts;
        let wheels_stand = self.wheels.stand([left_count, right_count], [left, right]) && believed.encoders;
        let arm = sensed.arm.rate_rad_s;
        let [arm_bias, ..] = biases_rad_s;
        let [x, z] = sensed.arm_gyro_xz_rad_s;
        let rates = [arm, x, z];
        if !believed.arm_imu || disarmed && self.is_a_bias_wrong(rates, biases_rad_s, wheels_stand) {
            self.calibration = Calibration::default();
        }
        let arm_stands = if self.calibration.is_done() {
            (arm - arm_bias).abs() < REST_ARM_RAD_S
        } else {
            // Before the bias is known, the whole rate may be bias.
            arm.abs() < BIAS_MAX_RAD_S
        };
        let still = wheels_stand && arm_stands && believed.arm_imu;
        let at_rest = self.rest.update(still);
        let idle = at_rest && disarmed;
        let calibrating = still && disarmed && !self.calibration.is_done();
        let posture = Posture {
            still,
            at_rest,
            idle,
            settled: self.settled.update(idle),
            calibrating,
        };
        let found = if self.calibration.is_done() {
            None
        } else {
            self.calibration
                .update(rates, still && disarmed && is_new(&sensed.arm_imu))
        };
        (posture, found)
    }

    /// Whether the wheels have stood for a long time while a gyro shows a constant rate that its bias does not
    /// explain.
    fn is_a_bias_wrong(&mut self, rates_rad_s: [f32; 3], biases_rad_s: [f32; 3], wheels_stand: bool) -> bool {
        if !wheels_stand || !self.calibration.is_done() {
            return self.unexplained.update(false);
        }
        let limits = [REST_ARM_RAD_S, AGREEMENT_RAD_S, AGREEMENT_RAD_S];
        let plausible = rates_rad_s.iter().all(|rate| rate.abs() < BIAS_MAX_RAD_S);
        let mut turns = rates_rad_s.iter().zip(biases_rad_s).zip(limits);
        let unexplained = turns.any(|((rate, bias), limit)| (rate - bias).abs() >= limit);
        self.unexplained.update(plausible && unexplained)
    }
}
