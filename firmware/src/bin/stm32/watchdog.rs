//! The part's independent watchdog.

use embassy_stm32::Peri;
use embassy_stm32::wdg::IndependentWatchdog;
use firmware::drive_board::WATCHDOG_US;
use firmware::hardware::Watchdog;

use crate::board::BoardWatchdog;

/// The independent watchdog, on its own oscillator, not started yet, or started by the boot loader with a time that no
/// start-up needs. Until the tasks run, the bridges are open, and the slow parts of the start-up (the converter's
/// calibration takes 10 ms) must not end in one reset after another.
pub struct WatchdogAtRest(Peri<'static, BoardWatchdog>);

impl WatchdogAtRest {
    /// The watchdog as the start has left it.
    pub fn new(peripheral: Peri<'static, BoardWatchdog>) -> Self {
        Self(peripheral)
    }

    /// Starts the watchdog; nothing stops it again. While a debugger halts the core, the watchdog stands
    /// still and the bridges are open.
    pub fn start(self) -> RunningWatchdog {
        let mut watchdog = IndependentWatchdog::new(self.0, WATCHDOG_US);
        watchdog.unleash();
        // One that runs already takes its new time when it is fed.
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
