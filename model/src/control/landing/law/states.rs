//! What the law remembers, for whoever linearises it.

use super::LandingLaw;

/// Number of the states of [`LandingLaw::motion_states`].
pub const MOTION_STATES: usize = 7;

impl LandingLaw {
    /// What the law remembers of the vehicle's motion, nondimensional, for whoever linearises the law: the observers' states, and
    /// the torque of the last tick. The command is none of it: no motion of the vehicle's moves it, but for its bounds.
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
