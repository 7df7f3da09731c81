//! The external clock, which the debugger drives.

use embassy_stm32::pac;
use embassy_stm32::rcc::{Hse, HseMode};
use embassy_stm32::time::Hertz;

/// Largest number of reads of the external clock's ready flag before the internal oscillator replaces this clock. At the
/// 64 MHz or 16 MHz after a reset the reads take between 10 and 200 ms; a present clock is ready within 2 ms.
const READY_READS: u32 = 100_000;

/// Switches the external clock's input on, and off again if no clock starts. The HAL waits for the external clock
/// without a limit; the clock that this function returns is also available to the HAL.
pub fn start() -> Option<Hse> {
    // The board has no crystal: the debugger drives OSC_IN.
    pac::RCC.cr().modify(|w| w.set_hsebyp(true));
    pac::RCC.cr().modify(|w| w.set_hseon(true));
    if (0..READY_READS).any(|_| pac::RCC.cr().read().hserdy()) {
        return Some(Hse {
            freq: Hertz(8_000_000),
            mode: HseMode::Bypass,
        });
    }
    pac::RCC.cr().modify(|w| w.set_hseon(false));
    pac::RCC.cr().modify(|w| w.set_hsebyp(false));
    None
}
