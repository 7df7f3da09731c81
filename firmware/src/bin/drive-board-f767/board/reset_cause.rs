//! The cause of the last reset.

use embassy_stm32::pac;
use firmware::hardware::ResetCause;

/// Address of the register that holds the causes, RCC_CSR.
pub const REGISTER: u32 = 0x4002_3874;
/// Its bits that tell that the supply came up: PORRSTF and BORRSTF.
pub const SUPPLY_CAME_UP: u32 = 1 << 27 | 1 << 25;

/// Reads why the part started, and clears the flags for the next start. An internal reset pulls the reset
/// pin too, so the pin is the cause only if no other flag is set.
pub fn take() -> ResetCause {
    let flags = pac::RCC.csr().read();
    pac::RCC.csr().modify(|w| w.set_rmvf(true));
    if flags.wdgrstf() {
        ResetCause::Watchdog
    } else if flags.sftrstf() {
        ResetCause::Software
    } else if flags.porrstf() {
        ResetCause::PowerOn
    } else if flags.borrstf() {
        ResetCause::BrownOut
    } else if flags.padrstf() {
        ResetCause::Pin
    } else {
        ResetCause::Other
    }
}
