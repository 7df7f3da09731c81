//! What the board's pins tell the vehicle and what the vehicle's sensors put on them.

use model::analog::Analog;
/// Number of motors, in the order of the firmware's arrays: left, right, ballast.
pub use model::sample::MOTORS;

/// State of a motor's bridge.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum BridgeOutput {
    /// No transistor conducts.
    Open,
    /// The two diagonals conduct in turn, with dead time between them.
    Switching {
        /// Time for which the forward diagonal conducts in each period, in ns.
        forward_ns: u64,
        /// Time for which the reverse diagonal conducts in each period, in ns.
        reverse_ns: u64,
        /// The period in ns.
        period_ns: u64,
    },
    /// A diagonal conducts without switching. The firmware never commands this.
    Held,
}

impl BridgeOutput {
    /// Mean voltage as a fraction of the supply, -1 to 1, or `None` while the motor is disconnected.
    pub fn duty(self) -> Option<f64> {
        match self {
            Self::Switching {
                forward_ns,
                reverse_ns,
                period_ns,
            } if period_ns > 0 => Some((forward_ns as f64 - reverse_ns as f64) / period_ns as f64),
            _ => None,
        }
    }
}

/// What an IMU measures, on its own axes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct ImuSensed {
    /// The IMU does not answer: its bus floats.
    pub silent: bool,
    /// Angular rate in thousandths of a degree per second.
    pub rate_mdeg_s: [i32; 3],
    /// Specific force in millionths of g.
    pub specific_force_ug: [i32; 3],
}

impl ImuSensed {
    /// An IMU that does not answer.
    pub const SILENT: Self = Self {
        silent: true,
        rate_mdeg_s: [0; 3],
        specific_force_ug: [0; 3],
    };
}

/// What the vehicle puts on the board's sensor pins.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct SensedAtPins {
    /// Encoder positions in counts.
    pub encoder_counts: [i64; MOTORS],
    /// IMUs: arm, spar.
    pub imus: [ImuSensed; 2],
    /// Outputs of the battery's divider and of the other sensors before the converter, in mV.
    pub analog_mv: Analog<u32>,
    /// The supply is too low for the board, which is held in reset.
    pub unpowered: bool,
}
