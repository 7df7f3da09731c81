//! The cause of the last reset.

use embassy_stm32::pac;
use firmware::hardware::ResetCause;

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
