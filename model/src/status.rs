//! The vehicle's report of one tick.

use crate::control::spar::SparTerms;
use crate::control::speed::SpeedTerms;
use crate::control::steering::SteeringTerms;
use crate::estimate::Estimate;
use crate::sample::MOTORS;
use crate::supervise::arming::Mode;
use crate::supervise::codes::{BlockerSet, FaultSet, LimitSet};

/// The terms of the three control laws, V at the motors; all 0 while disarmed.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Terms {
    /// Terms of the speed law. Both drive motors get their sum.
    pub speed: SpeedTerms,
    /// Terms of the steering law. The right motor gets their sum, the left motor the negated sum.
    pub steering: SteeringTerms,
    /// Terms of the spar law. The ballast motor gets their sum.
    pub spar: SparTerms,
}

/// The status of the vehicle after one tick. [`Status::estimate`] contains every estimate; all other fields are
/// counted, commanded, measured or computed by the laws. The default is the status before the first tick: disarmed,
/// nothing measured.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Status {
    /// Ticks since boot.
    pub tick: u32,
    /// Time of the sample, us since boot.
    pub time_us: u64,
    /// Arming mode.
    pub mode: Mode,
    /// Latched faults.
    pub faults: FaultSet,
    /// Conditions that block arming now.
    pub blockers: BlockerSet,
    /// Limits that bound the response.
    pub limits: LimitSet,
    /// The estimate.
    pub estimate: Estimate,
    /// Governed speed reference, m/s.
    pub speed_reference_m_s: f32,
    /// Governed yaw-rate reference, rad/s.
    pub yaw_rate_reference_rad_s: f32,
    /// Terms of the control laws before any limit.
    pub terms: Terms,
    /// Voltage of each motor after all limits, V.
    pub voltage_v: [f32; MOTORS],
    /// Measured current of each motor, A.
    pub current_a: [f32; MOTORS],
    /// Filtered supply voltage, V.
    pub battery_v: f32,
    /// Number of late ticks since boot.
    pub late_ticks: u32,
    /// Number of refused requests to arm since boot.
    pub refused_arms: u32,
}
