//! The inputs and the terms of every speed law.

/// Input of the speed loop, SI.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SpeedInput {
    /// Wanted speed of the axle, m/s; exactly 0 holds the place.
    pub target_m_s: f32,
    /// Arm angle from the vertical, rad.
    pub phi_rad: f32,
    /// Sine and cosine of the arm's angle, which the estimator has already computed.
    pub phi_sin_cos: (f32, f32),
    /// Mean wheel rate theta', rad/s.
    pub theta_rate_rad_s: f32,
    /// Arm rate phi', rad/s.
    pub phi_rate_rad_s: f32,
    /// Sine and cosine of the slope, which the estimator has already computed.
    pub slope_sin_cos: (f32, f32),
    /// Rate of the slope's sine due to the vehicle's own turn, 1/s.
    pub slope_turn_per_s: f32,
    /// Whether the vehicle is commanded to turn.
    pub turns: bool,
    /// Distance driven, m.
    pub distance_m: f32,
    /// Speed over the ground while the wheels slide, m/s.
    pub sliding_over_m_s: Option<f32>,
    /// Largest voltage in either direction, V.
    pub voltage_max_v: f32,
}

/// The terms of the speed law, V at each drive motor; their sum is the voltage before its limit. A term that a law
/// does not have is 0.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct SpeedTerms {
    /// Holds the speed on the level against back-EMF and damping: the reference speed (Eq. 3.25) or the present
    /// speed (landing law).
    pub feed_forward_v: f32,
    /// Carries the arm's weight, and so the slope.
    pub weight_v: f32,
    /// Eq. 3.25: the speed error, fed back positively.
    pub speed_feedback_v: f32,
    /// The arm's rate, fed back.
    pub swing_rate_v: f32,
    /// The arm's angle less the commanded one, fed back.
    pub swing_damping_v: f32,
    /// Friction: fed forward (Eq. 3.25), or as the torque observer estimates it (landing law).
    pub friction_v: f32,
    /// Eq. 3.25: guard against running away behind an obstacle.
    pub guard_v: f32,
    /// Eq. 3.25: slow trim, the integral of the speed error.
    pub trim_v: f32,
    /// Landing law: the change of the torque by grip, current limit and the arm's barrier.
    pub governed_v: f32,
    /// The quantities that the law aims at.
    pub aim: SpeedAim,
}

/// The quantities that the speed law aims at in one tick.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct SpeedAim {
    /// Landing law: the speed that is left once the arm has come home, m/s; else 0.
    pub landing_speed_m_s: f32,
    /// Commanded acceleration of the axle, m/s^2.
    pub acceleration_m_s2: f32,
    /// Commanded arm angle, rad.
    pub phi_rad: f32,
}

impl SpeedTerms {
    /// The sum of the voltages: the voltage before its limit, V.
    pub fn sum_v(&self) -> f32 {
        self.voltages_v().iter().sum()
    }

    /// The voltages, V, in the order of the fields.
    pub fn voltages_v(&self) -> [f32; 9] {
        [
            self.feed_forward_v,
            self.weight_v,
            self.speed_feedback_v,
            self.swing_rate_v,
            self.swing_damping_v,
            self.friction_v,
            self.guard_v,
            self.trim_v,
            self.governed_v,
        ]
    }
}
