//! What a motor's watch reads in one tick, and the bounds that both its parts share.

/// The readings of a motor in one tick.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MotorReading {
    /// The encoder's count, which wraps.
    pub count: i32,
    /// Voltage applied since the last tick, V; `None` while the bridge is open.
    pub applied_v: Option<f32>,
    /// Least and largest share of `applied_v` that the bridge may have applied; `None` while the supply's reading is
    /// believed, so that the share is 1.
    pub applied_shares: Option<[f32; 2]>,
    /// The measured current, A, halfway between the last tick and this tick.
    pub current_a: f32,
    /// The filtered rate of the output, rad/s.
    pub rate_rad_s: f32,
}

/// Ticks for which the encoder must contradict: longer than the watch takes to detect a dead current sensor.
/// Contradictions add up, because a loop that is closed through a dead encoder may swing to and fro.
pub(super) const RESIDUAL_TICKS: u16 = 250;
/// Share of the current that the voltage should drive, below which a lead may be open.
pub(super) const OPEN_CURRENT_SHARE: f32 = 0.1;
