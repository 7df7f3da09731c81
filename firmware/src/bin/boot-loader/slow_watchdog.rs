//! The independent watchdog with its longest time, 26 to 33 s with its oscillator: six times the slowest erasure (4 s by the data
//! sheet), and ample for an image that starts. The firmware shortens it when its tasks run.

use embassy_stm32::pac::IWDG1;

/// The watchdog counts every 256th period of its oscillator.
const SLOWEST_DIVIDER: u32 = 6;
/// The most that it counts.
const LONGEST_COUNT: u16 = 0xFFF;
/// Key that starts it.
const START: u32 = 0xCCCC;
/// Key that opens its registers.
const OPEN: u32 = 0x5555;
/// Key that gives it its whole time again.
const RELOAD: u32 = 0xAAAA;

/// Starts the watchdog; nothing but a reset stops it again.
pub fn start() {
    for key in [START, OPEN] {
        IWDG1.kr().write(|w| w.0 = key);
    }
    IWDG1.pr().write(|w| w.0 = SLOWEST_DIVIDER);
    IWDG1.rlr().write(|w| w.set_rl(LONGEST_COUNT));
    feed();
}

/// Gives the watchdog its whole time again.
pub fn feed() {
    IWDG1.kr().write(|w| w.0 = RELOAD);
}
