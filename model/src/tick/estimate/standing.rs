//! Whether the vehicle stands still, and whether its gyros' biases are known.
//!
//! Rest is the only state in which gyros show their biases and the accelerometer shows gravity alone. A false
//! rest teaches wrong biases, and with a wrong bias the vehicle seems to move for ever. Therefore
//!
//! - a sensor that supervision does not believe never counts as at rest;
//! - an arm IMU that was lost is calibrated anew, because nobody knows how the arm turned meanwhile;
//! - wheels that stand for long beside a gyro that turns evenly show a wrong bias.

use super::calibration::{BIAS_MAX_RAD_S, Calibration, is_new};
use crate::estimate::heading::AGREEMENT_RAD_S;
use crate::estimate::stillness::Stillness;
use crate::persistence::Persistence;
use crate::sensed::Sensed;
use crate::supervise::supervisor::Believed;

/// Arm rate below which the vehicle stands still, rad/s.
const REST_ARM_RAD_S: f32 = 0.05;
/// Ticks in a row for which the vehicle must stand still to be at rest.
const STILL_TICKS: u16 = 100;
/// Ticks at rest after which the arm's angle has settled on gravity: an error of the angle is no bias.
const SETTLED_TICKS: u16 = 500;
/// Ticks for which the wheels of a vehicle stand while a gyro shows a turn, after which that turn is its bias.
const UNEXPLAINED_TICKS: u16 = 2000;

/// What one tick shows.
#[allow(clippy::struct_excessive_bools)] // Each is a finding of its own.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Posture {
    /// Wheels and arm stand still.
    pub(super) still: bool,
    /// They have stood still for a while.
    pub(super) at_rest: bool,
    /// The vehicle is disarmed, at rest, and nothing moves the arm.
    pub(super) idle: bool,
    /// It has been idle long enough for the arm's angle to have settled.
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

    /// Takes one tick: the arm's gyros beside their biases (y, x, z), in rad/s, and whether supervision believes the
    /// sensors. Returns the posture, and the biases in the tick in which they become known.
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
            // Before the bias is known, all of the rate may be bias.
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

    /// Whether the wheels have stood for long while a gyro shows an even turn that its bias does not explain.
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
