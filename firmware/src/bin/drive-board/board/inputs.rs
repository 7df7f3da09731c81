//! The small parts: emergency stop, watchdog, cycle counter, lamps, cause of the last reset.

use cortex_m::peripheral::{DCB, DWT};
use embassy_stm32::Peri;
use embassy_stm32::gpio::{Input, Level, Output};
use embassy_stm32::pac;
use embassy_stm32::peripherals::IWDG1;
use embassy_stm32::wdg::IndependentWatchdog;
use firmware::drive_board::WATCHDOG_US;
use firmware::hardware::{CycleCounter, EmergencyStop, Indicators, ResetCause, Watchdog};

/// The stop's first contact, normally closed to ground, with a pull-up: an open wire is a press.
pub struct StopContact(pub Input<'static>);

impl EmergencyStop for StopContact {
    fn is_pressed(&mut self) -> bool {
        self.0.is_high()
    }
}

/// The board's button, which the board pulls down and the button pulls up.
pub struct UserButton(Input<'static>);

impl UserButton {
    /// The button on its pin.
    pub fn new(pin: Input<'static>) -> Self {
        Self(pin)
    }

    /// Whether it is down now.
    pub fn is_pressed(&self) -> bool {
        self.0.is_high()
    }
}

/// The independent watchdog, on its own oscillator, not started yet: until the tasks run, the bridges are
/// open, and slow parts of the bring-up (the converter's calibration takes 10 ms) must not end in a
/// reset that leads to another.
pub struct WatchdogAtRest(Peri<'static, IWDG1>);

impl WatchdogAtRest {
    /// The watchdog, untouched.
    pub(super) fn new(peripheral: Peri<'static, IWDG1>) -> Self {
        Self(peripheral)
    }

    /// Starts it; nothing stops it again. It stands still while a debugger halts the core, as do the
    /// bridges' outputs.
    pub fn start(self) -> RunningWatchdog {
        let mut watchdog = IndependentWatchdog::new(self.0, WATCHDOG_US);
        watchdog.unleash();
        RunningWatchdog(watchdog)
    }
}

/// The independent watchdog, started.
pub struct RunningWatchdog(IndependentWatchdog<'static, IWDG1>);

impl Watchdog for RunningWatchdog {
    fn feed(&mut self) {
        self.0.pet();
    }
}

/// The core's own cycle counter.
pub struct CoreCycles(());

impl CoreCycles {
    /// Starts the counter.
    pub fn start(dcb: &mut DCB, dwt: &mut DWT) -> Self {
        dcb.enable_trace();
        DWT::unlock();
        dwt.enable_cycle_counter();
        Self(())
    }
}

impl CycleCounter for CoreCycles {
    fn cycles(&self) -> u32 {
        DWT::cycle_count()
    }
}

/// The board's lamps.
pub struct Lamps {
    /// Green: armed.
    pub armed: Output<'static>,
    /// Red: faulted.
    pub faulted: Output<'static>,
}

impl Indicators for Lamps {
    fn show(&mut self, armed: bool, faulted: bool) {
        self.armed.set_level(Level::from(armed));
        self.faulted.set_level(Level::from(faulted));
    }
}

/// Reads why the part started, and clears it for the next time. An internal reset pulls the reset pin
/// too, so the pin counts only where nothing else does.
pub fn take_reset_cause() -> ResetCause {
    let flags = pac::RCC.rsr().read();
    pac::RCC.rsr().modify(|w| w.set_rmvf(true));
    if flags.iwdg1rstf() {
        ResetCause::Watchdog
    } else if flags.sftrstf() {
        ResetCause::Software
    } else if flags.porrstf() {
        ResetCause::PowerOn
    } else if flags.borrstf() {
        ResetCause::BrownOut
    } else if flags.pinrstf() {
        ResetCause::Pin
    } else {
        ResetCause::Other
    }
}
