//! The states of the law, for callers that linearise it.

use super::LandingLaw;

/// Number of states that [`LandingLaw::motion_states`] returns.
pub const MOTION_STATES: usize = 7;

impl LandingLaw {
    /// The law's states that depend on the vehicle's motion, nondimensional, for callers that linearise the law: the
    /// observers' states and the torque of the last tick. The command path is not included, because the vehicle's
    /// motion affects it only through its bounds.
    pub fn motion_states(&mut self) -> [&mut f32; MOTION_STATES] {
        let [phi_rate, disturbance] = self.torque_observer.states();
        let [wheel_rate, joint_rate, first, second] = self.rate_observer.states();
        [
            phi_rate,
            disturbance,
            wheel_rate,
            joint_rate,
            first,
            second,
            &mut self.torque,
        ]
    }
}
