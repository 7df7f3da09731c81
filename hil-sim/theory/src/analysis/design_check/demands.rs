//! What the file lets an operator ask for, beside what the vehicle can do.

use super::{Inspector, Severity};

impl Inspector<'_> {
    /// Speeds, accelerations and yaw rates.
    pub(super) fn demands(&mut self) {
        let control = &self.vehicle.parameters().control;
        self.tell(
            control.speed_max_m_s == 0.0,
            Severity::Warning,
            "control.speed_max_m_s",
            "at 0 m/s the vehicle does not drive".to_owned(),
        );
        let [arm, grip, current] = [
            "acceleration_by_arm_m_s2",
            "acceleration_by_grip_m_s2",
            "acceleration_by_current_m_s2",
        ]
        .map(|name| self.number(name));
        self.tell(
            control.acceleration_max_m_s2 > arm.min(grip).min(current),
            Severity::Warning,
            "control.acceleration_max_m_s2",
            format!(
                "{} m/s^2 is more than the vehicle has: the arm gives {arm:.1} m/s^2, the grip {grip:.1}, the current limit \
                 {current:.1}",
                control.acceleration_max_m_s2
            ),
        );
        let [spin, voltage] = ["yaw_rate_by_spin_rad_s", "yaw_rate_by_voltage_rad_s"].map(|name| self.number(name));
        self.tell(
            control.yaw_rate_max_rad_s > spin.min(voltage),
            Severity::Warning,
            "control.yaw_rate_max_rad_s",
            format!(
                "{} rad/s is more than the vehicle has on the spot: the arm hangs still up to {spin:.1} rad/s, the supply keeps \
                 {voltage:.1}",
                control.yaw_rate_max_rad_s
            ),
        );
    }
}
