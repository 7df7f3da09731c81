//! What the board's pins drive in the vehicle, and what the vehicle's sensors put on the pins.

use model::analog::Analog;
use rigless::device::Level;
use rigless::soc::stm32h743::peripherals::gpio::Pin;

/// Number of motors, in the order of the firmware's arrays: left, right, ballast.
pub use model::sample::MOTORS;

/// A pin of a port.
pub(super) fn pin(number: u8) -> Pin {
    Pin::new(number).expect("a port has sixteen pins")
}

/// What a timer drives onto an input of a bridge.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum BridgeInput {
    /// A constant level.
    Level(Level),
    /// High from the start of each period, or around the start. All lines of a timer are alike.
    Pulse {
        /// Time for which the line is high in each period, in ns.
        high_ns: u64,
        /// The period in ns.
        period_ns: u64,
    },
}

impl BridgeInput {
    /// Time for which the line is high in a period of `period_ns`, in ns.
    fn high_ns(self, period_ns: u64) -> u64 {
        match self {
            Self::Level(Level::Low) => 0,
            Self::Level(Level::High) => period_ns,
            Self::Pulse { high_ns, .. } => high_ns,
        }
    }

    /// The period in ns of a line that pulses.
    fn period_ns(self) -> Option<u64> {
        match self {
            Self::Level(_) => None,
            Self::Pulse { period_ns, .. } => Some(period_ns),
        }
    }
}

/// State of a motor's bridge. The driver has two inputs: both low open the bridge, both high brake.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum BridgeOutput {
    /// No transistor conducts.
    Open,
    /// The bridge drives and brakes in turn. For the rest of the period the bridge is open. The
    /// firmware never leaves any rest.
    Switching {
        /// Time for which the bridge drives forward in each period, in ns.
        forward_ns: u64,
        /// Time for which the bridge drives in reverse in each period, in ns.
        reverse_ns: u64,
        /// Time for which the bridge brakes in each period, in ns.
        brake_ns: u64,
        /// The period in ns.
        period_ns: u64,
    },
    /// The bridge drives or brakes without switching. The firmware never commands this state.
    Held,
}

impl BridgeOutput {
    /// State that the driver's truth table gives for its two inputs. Their pulses begin together.
    pub(super) fn of(in1: BridgeInput, in2: BridgeInput) -> Self {
        match (in1, in2) {
            (BridgeInput::Level(Level::Low), BridgeInput::Level(Level::Low)) => Self::Open,
            _ => match in1.period_ns().or(in2.period_ns()) {
                Some(period_ns) => {
                    let (high1, high2) = (in1.high_ns(period_ns), in2.high_ns(period_ns));
                    let brake_ns = high1.min(high2);
                    Self::Switching {
                        forward_ns: high1 - brake_ns,
                        reverse_ns: high2 - brake_ns,
                        brake_ns,
                        period_ns,
                    }
                }
                None => Self::Held,
            },
        }
    }

    /// Mean voltage as a fraction of the supply, -1 to 1, or `None` while the motor is disconnected.
    pub fn duty(self) -> Option<f64> {
        match self {
            Self::Switching {
                forward_ns,
                reverse_ns,
                period_ns,
                ..
            } if period_ns > 0 => Some((forward_ns as f64 - reverse_ns as f64) / period_ns as f64),
            _ => None,
        }
    }

    /// Whether the bridge drives and brakes in turn and is never open. For tests.
    pub fn never_open(self) -> bool {
        match self {
            Self::Open => false,
            Self::Switching {
                forward_ns,
                reverse_ns,
                brake_ns,
                period_ns,
            } => forward_ns + reverse_ns + brake_ns == period_ns,
            Self::Held => true,
        }
    }
}

/// What an IMU measures, on its own axes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct ImuSensed {
    /// Whether the IMU is silent: its bus floats.
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

/// What the vehicle's sensors put on the board's pins.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct SensedAtPins {
    /// Encoder positions in counts.
    pub encoder_counts: [i64; MOTORS],
    /// IMUs: arm, spar.
    pub imus: [ImuSensed; 2],
    /// Outputs of the battery's divider and of the other analogue sensors, at the converter's input,
    /// in mV.
    pub analog_mv: Analog<u32>,
    /// Slope of each current sensor's voltage with the whole supply across its motor, in uV per us.
    /// The currents in `analog_mv` are means. The currents ripple around these means with the PWM.
    pub current_slope_uv_per_us: [u32; MOTORS],
    /// The supply is too low for the board, which stays in reset.
    pub unpowered: bool,
    /// A bridge has shut itself down because it is too hot, and reports that at its fault output.
    pub bridge_shut_down: bool,
}
