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
    /// Whether the hardware break has tripped, or the bridges have opened in any other way without the firmware's
    /// order, since the break was last cleared.
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
    /// Converts every input once, to raw counts, in step with the bridges' PWM where the board has one. Dropping the
    /// future ends the reading and does not affect the next reading.
    fn read(&mut self) -> impl Future<Output = Result<Analog<u16>, Self::Error>>;
}

/// The emergency-stop input.
pub trait EmergencyStop {
    /// Whether the stop is pressed now (an open wire reads as pressed).
    fn is_pressed(&mut self) -> bool;
}

/// The hardware watchdog: resets the part unless the firmware feeds it in time.
pub trait Watchdog {
    /// Restarts the watchdog's time.
    fn feed(&mut self);
}

/// Restarts the part, into its boot loader.
pub trait Restart {
    /// Restarts the part. Every bridge is then open until a firmware arms again.
    fn restart(&mut self) -> !;
}

/// The restart of a board without a boot loader: nothing to restart into.
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

/// The lamps that show the operator the vehicle's state.
pub trait Indicators {
    /// Shows whether the vehicle is armed, and whether a fault is latched.
    fn show(&mut self, armed: bool, faulted: bool);
}

/// The place of an IMU.
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

/// The part's reset flags since they were last cleared, from its reset register.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[allow(clippy::struct_excessive_bools)] // Each is a flag of the part's register; several are set at once.
pub struct ResetFlags {
    /// The supply came up from zero.
    pub power_on: bool,
    /// The supply came up through the brown-out level.
    pub brown_out: bool,
    /// The independent watchdog's time ran out.
    pub watchdog: bool,
    /// Software requested the reset.
    pub software: bool,
    /// The reset pin was low.
    pub pin: bool,
}

impl ResetCause {
    /// The cause that `flags` show. If the flags show several causes, the supply has priority, because the RAM lost
    /// its contents whatever happened before. A supply that comes up from zero also passes the brown-out level. Every
    /// internal reset pulls the pin, so the pin is the cause only if no other flag is set.
    pub fn of(flags: ResetFlags) -> Self {
        if flags.power_on {
            Self::PowerOn
        } else if flags.brown_out {
            Self::BrownOut
        } else if flags.watchdog {
            Self::Watchdog
        } else if flags.software {
            Self::Software
        } else if flags.pin {
            Self::Pin
        } else {
            Self::Other
        }
    }

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

/// The source of a board's clocks.
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_reset_has_its_deepest_cause() {
        let pin = ResetFlags {
            pin: true,
            ..ResetFlags::default()
        };
        let software = ResetFlags { software: true, ..pin };
        let watchdog = ResetFlags {
            watchdog: true,
            ..software
        };
        let brown_out = ResetFlags {
            brown_out: true,
            ..watchdog
        };
        let power_on = ResetFlags {
            power_on: true,
            ..brown_out
        };
        assert_eq!(
            [ResetFlags::default(), pin, software, watchdog, brown_out, power_on].map(ResetCause::of),
            [
                ResetCause::Other,
                ResetCause::Pin,
                ResetCause::Software,
                ResetCause::Watchdog,
                ResetCause::BrownOut,
                ResetCause::PowerOn,
            ]
        );
    }
}
