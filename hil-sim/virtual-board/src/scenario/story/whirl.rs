//! Why the arm whirled: what did the work on the arm during its upswing.

use core::f64::consts::FRAC_PI_3;

use plant::Truth;

/// Torque below which the motors do not contribute to a swing, N m.
const IDLE_N_M: f64 = 0.05;

/// The arm's upswing since its angle was last within 60 deg of the vertical.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct WhirlWitness {
    time_s: f64,
    phi_rad: f64,
    phi_rate_rad_s: f64,
    /// Work of the wheels' motors on the arm, J.
    arm_work_j: f64,
    /// Work of the wheels' motors on the wheels, J: negative while they brake.
    wheel_work_j: f64,
    /// Highest torque of the wheels' motors, N m.
    torque_n_m: f64,
}

impl WhirlWitness {
    pub(super) fn see(&mut self, truth: &Truth) {
        // A motor that drives its wheel forward turns the arm's lower end forward.
        let [left_n_m, right_n_m, _] = truth.torque_n_m;
        let [left_rad_s, right_rad_s] = truth.wheel_rate_rad_s;
        let torque_n_m = left_n_m + right_n_m;
        if truth.phi_rad.abs() < FRAC_PI_3 {
            *self = Self::default();
        } else {
            self.arm_work_j += torque_n_m * (truth.phi_rad - self.phi_rad);
            self.wheel_work_j += (left_n_m * left_rad_s + right_n_m * right_rad_s) * (truth.time_s - self.time_s);
            self.torque_n_m = self.torque_n_m.max(torque_n_m.abs());
        }
        self.time_s = truth.time_s;
        self.phi_rad = truth.phi_rad;
        self.phi_rate_rad_s = truth.phi_rate_rad_s;
    }

    /// The whirl in a sentence.
    pub(super) fn told(&self) -> String {
        let way = if self.phi_rate_rad_s >= 0.0 {
            "forward"
        } else {
            "backward"
        };
        let rate_rad_s = self.phi_rate_rad_s.abs();
        let part = if self.wheel_work_j < 0.0 { "brake" } else { "drive" };
        let cause = if self.torque_n_m < IDLE_N_M {
            "the motors have no part in it, a push or a jolt threw it up".to_owned()
        } else if self.arm_work_j > 0.0 {
            format!(
                "the motors, which {part} the wheels with up to {:.1} N m, lift it",
                self.torque_n_m
            )
        } else {
            format!(
                "a push or a jolt threw it up, the motors, which {part} the wheels with up to {:.1} N m, hold against it",
                self.torque_n_m
            )
        };
        format!("the arm turns over {way} at {rate_rad_s:.1} rad/s: {cause}")
    }
}
