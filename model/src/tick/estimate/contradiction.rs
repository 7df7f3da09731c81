//! Whether what the arm IMU shows can be true, judged by itself and by the wheels.

use super::{Estimator, MeasuredMotion};
use crate::estimate::facing::{GROUNDED_TICKS, Shown};
use crate::supervise::supervisor::Believed;

/// Sine of the angle between integrated gyro and accelerometer that cannot last: one of the two is wrong.
const CONTRADICTION: f32 = 0.7;
pub(super) const CONTRADICTION_TICKS: u16 = 300;

impl Estimator {
    /// Whether gyro and accelerometer have contradicted each other, or both the wheels, for a while. Only wheels that a motor
    /// holds or drives are asked: hands turn a disarmed vehicle upside down.
    pub(super) fn contradicts(&mut self, motion: &MeasuredMotion, believed: Believed, disarmed: bool) -> bool {
        let apart = self
            .contradicted
            .update(self.arm.unfiltered_error().abs() > CONTRADICTION);
        if disarmed || !believed.arm_imu {
            self.facing.reset();
            return apart;
        }
        let faces_elsewhere = self.facing.update(&Shown {
            relative_rad_s: motion.theta_rate_rad_s + motion.phi_rate_rad_s,
            unexplained: self.arm.unexplained(),
            vertical_m_s2: self.arm.vertical_m_s2(),
            grounded: self.weighs.lasts(GROUNDED_TICKS),
            slides: self.traction.slides(),
        });
        apart || faces_elsewhere
    }
}
