//! What the operator wants.

/// What the operator asks of the arming state machine; each request counts once.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[repr(u8)]
pub enum Request {
    /// Nothing.
    #[default]
    None = 0,
    /// Arm, if nothing blocks it.
    Arm = 1,
    /// Open the bridges at once.
    Disarm = 2,
    /// Clear latched faults (while disarmed).
    ClearFaults = 3,
}

/// What the operator wants, as known when the tick begins.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[repr(C)]
pub struct Command {
    /// Speed of the axle, m/s, forward positive.
    pub speed_m_s: f32,
    /// Yaw rate, rad/s, anticlockwise (to the left) positive; exactly 0 holds the heading.
    pub yaw_rate_rad_s: f32,
    /// Age of speed and yaw rate, us; `u32::MAX` while none has come.
    pub age_us: u32,
    /// A request to the arming state machine; given in one tick only.
    pub request: Request,
    /// Parameters are being changed: arming is blocked.
    pub parameters_pending: bool,
}

impl Command {
    /// No command yet.
    pub const NONE: Self = Self {
        speed_m_s: 0.0,
        yaw_rate_rad_s: 0.0,
        age_us: u32::MAX,
        request: Request::None,
        parameters_pending: false,
    };

    /// Whether speed and yaw rate are numbers: what is not a number is no command.
    pub fn is_finite(&self) -> bool {
        self.speed_m_s.is_finite() && self.yaw_rate_rad_s.is_finite()
    }

    /// Whether the command asks for no motion.
    pub fn is_neutral(&self) -> bool {
        self.speed_m_s == 0.0 && self.yaw_rate_rad_s == 0.0
    }
}
