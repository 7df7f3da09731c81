//! The independent watchdog with its longest time, 26 to 33 s with its oscillator: six times the
//! slowest erasure (4 s by the data sheet), and ample for the start of an image. The firmware
//! shortens the time when its tasks run.

use embassy_stm32::pac::IWDG1;

/// The watchdog counts every 256th period of its oscillator.
const SLOWEST_DIVIDER: u32 = 6;
/// Largest count.
const LONGEST_COUNT: u16 = 0xFFF;
/// Key that starts the watchdog.
const START: u32 = 0xCCCC;
/// Key that opens the watchdog's registers.
const OPEN: u32 = 0x5555;
/// Key that restarts the watchdog's time.
const RELOAD: u32 = 0xAAAA;

/// Starts the watchdog; only a reset stops it again.
pub fn start() {
    for key in [START, OPEN] {
        IWDG1.kr().write(|w| w.0 = key);
    }
    IWDG1.pr().write(|w| w.0 = SLOWEST_DIVIDER);
    IWDG1.rlr().write(|w| w.set_rl(LONGEST_COUNT));
    feed();
}

/// Restarts the watchdog's time.
pub fn feed() {
    IWDG1.kr().write(|w| w.0 = RELOAD);
}
