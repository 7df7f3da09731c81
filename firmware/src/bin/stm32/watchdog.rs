//! The part's independent watchdog.

use embassy_stm32::Peri;
use embassy_stm32::wdg::IndependentWatchdog;
use firmware::drive_board::WATCHDOG_US;
use firmware::hardware::Watchdog;

use crate::board::BoardWatchdog;

/// The independent watchdog with its own oscillator, not yet started, or started by the boot loader with a time that
/// exceeds any start-up. Until the tasks run, the bridges are open, and the slow parts of the start-up (the
/// converter's calibration takes 10 ms) must not lead to repeated resets.
pub struct WatchdogAtRest(Peri<'static, BoardWatchdog>);

impl WatchdogAtRest {
    /// The watchdog in its state after the start.
    pub fn new(peripheral: Peri<'static, BoardWatchdog>) -> Self {
        Self(peripheral)
    }

    /// Starts the watchdog; nothing stops it again. While a debugger halts the core, the watchdog is stopped and the
    /// bridges are open.
    pub fn start(self) -> RunningWatchdog {
        let mut watchdog = IndependentWatchdog::new(self.0, WATCHDOG_US);
        watchdog.unleash();
        // A watchdog that already runs adopts its new time when it is fed.
        watchdog.pet();
        RunningWatchdog(watchdog)
    }
}

/// The independent watchdog, running.
pub struct RunningWatchdog(IndependentWatchdog<'static, BoardWatchdog>);

impl Watchdog for RunningWatchdog {
    fn feed(&mut self) {
        self.0.pet();
    }
}
