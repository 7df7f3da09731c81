//! The cause of the last reset.

use embassy_stm32::pac;
use firmware::hardware::ResetCause;

/// Address of the register that holds the causes, RCC_RSR.
pub const REGISTER: u32 = 0x5802_44D0;
/// Its bits that tell that the supply came up: PORRSTF and BORRSTF.
pub const SUPPLY_CAME_UP: u32 = 1 << 23 | 1 << 21;

/// Reads why the part started, and clears the flags for the next start. An internal reset pulls the reset
/// pin too, so the pin is the cause only if no other flag is set.
pub fn take() -> ResetCause {
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
