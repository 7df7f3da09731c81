//! The seam to the hardware, beyond what embedded-hal offers: small traits that a board implements.
//!
//! The IMUs come in as `embedded_hal_async::spi::SpiDevice<u16>`, the link as `embedded_io_async::{Read,
//! Write}`, the parameter flash as `embedded_storage_async::nor_flash::NorFlash`.

use model::analog::Analog;
use model::sample::{Actuation, MOTORS};

/// Hardware quadrature counters.
pub trait EncoderCounters {
    /// The present counts: 16 bits, wrapping, forward positive, in the order of
    /// [`model::sample::Motor`].
    fn counts(&mut self) -> [u16; MOTORS];
}

/// The motor bridges. They come up open and stay open until [`Bridges::apply`] enables them.
pub trait Bridges {
    /// Applies one tick's actuation: sets the duties, or opens every bridge unless the actuation is enabled.
    fn apply(&mut self, actuation: &Actuation);
    /// Whether the hardware break has tripped, or the bridges have opened in any other way without being told to, since
    /// the break was last cleared.
    fn break_tripped(&mut self) -> bool;
    /// Whether the break input's wire asks for a break now: the emergency stop's second contact is open, or a bridge
    /// driver reports a fault.
    fn break_input_active(&mut self) -> bool;
    /// Clears a tripped break, so that the bridges can be enabled again. Has no effect as long as the cause
    /// of the break lasts.
    fn clear_break(&mut self);
}

/// Analogue inputs.
pub trait AnalogInputs {
    /// Why a reading failed.
    type Error: core::fmt::Debug;
    /// Converts every input once, to raw counts.
    fn read(&mut self) -> impl Future<Output = Result<Analog<u16>, Self::Error>>;
}

/// The emergency-stop input.
pub trait EmergencyStop {
    /// Whether the stop is pressed now (an open wire reads as pressed).
    fn is_pressed(&mut self) -> bool;
}

/// The hardware watchdog: resets the part unless the firmware feeds it in time.
pub trait Watchdog {
    /// Starts the watchdog's time anew.
    fn feed(&mut self);
}

/// Restarts the part, into its boot loader.
pub trait Restart {
    /// Restarts the part: every bridge is open from then on until a firmware arms again.
    fn restart(&mut self) -> !;
}

/// The boot loader of a board that has none: nothing could restart into it.
#[derive(Debug, Clone, Copy)]
pub enum NoLoader {}

impl Restart for NoLoader {
    fn restart(&mut self) -> ! {
        match *self {}
    }
}

/// A free-running counter of CPU cycles, for the tick budget.
pub trait CycleCounter {
    /// The counter, wrapping.
    fn cycles(&self) -> u32;
}

/// The lamps that tell the operator the vehicle's state.
pub trait Indicators {
    /// Shows whether the vehicle is armed, and whether a fault is latched.
    fn show(&mut self, armed: bool, faulted: bool);
}

/// Which IMU.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub enum Place {
    /// The IMU on the arm.
    Arm,
    /// The IMU on the spar.
    Spar,
}

impl Place {
    /// The place's name in the log.
    pub fn name(self) -> &'static str {
        match self {
            Self::Arm => "arm",
            Self::Spar => "spar",
        }
    }
}

/// Why the part last started.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[cfg_attr(target_os = "none", derive(defmt::Format))]
pub enum ResetCause {
    /// The power came up.
    PowerOn,
    /// The supply dipped below the brown-out level.
    BrownOut,
    /// The reset pin was pulled.
    Pin,
    /// Software reset the part.
    Software,
    /// Nothing fed the independent watchdog in time.
    Watchdog,
    /// None of the above.
    Other,
}

impl ResetCause {
    /// The cause in words.
    pub fn name(self) -> &'static str {
        match self {
            Self::PowerOn => "power-on",
            Self::BrownOut => "brown-out",
            Self::Pin => "reset pin",
            Self::Software => "software",
            Self::Watchdog => "watchdog",
            Self::Other => "unknown",
        }
    }
}

/// What a board's clocks run from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[cfg_attr(target_os = "none", derive(defmt::Format))]
pub enum ClockSource {
    /// The external clock, within some parts per million.
    External,
    /// The part's own oscillator, within 1 % at room temperature, because the external clock is missing: every time
    /// and rate of the board is wrong by as much.
    Internal,
}

impl ClockSource {
    /// The source in words.
    pub fn name(self) -> &'static str {
        match self {
            Self::External => "the external clock",
            Self::Internal => "its own oscillator",
        }
    }
}
