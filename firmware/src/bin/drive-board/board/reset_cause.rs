//! The cause of the last reset.

use embassy_stm32::pac;
use firmware::hardware::{ResetCause, ResetFlags};

/// Address of the register that holds the causes, RCC_RSR.
pub const REGISTER: u32 = 0x5802_44D0;
/// Its bits that show that the supply came up: PORRSTF and BORRSTF.
pub const SUPPLY_CAME_UP: u32 = 1 << 23 | 1 << 21;

/// Reads why the part started, and clears the flags for the next start.
pub fn take() -> ResetCause {
    let flags = pac::RCC.rsr().read();
    pac::RCC.rsr().modify(|w| w.set_rmvf(true));
    ResetCause::of(ResetFlags {
        power_on: flags.porrstf(),
        brown_out: flags.borrstf(),
        watchdog: flags.iwdg1rstf(),
        software: flags.sftrstf(),
        pin: flags.pinrstf(),
    })
}
