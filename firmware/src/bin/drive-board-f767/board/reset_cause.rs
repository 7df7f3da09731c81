//! The cause of the last reset.

use embassy_stm32::pac;
use firmware::hardware::{ResetCause, ResetFlags};

/// Address of the register that holds the causes, RCC_CSR.
pub const REGISTER: u32 = 0x4002_3874;
/// Its bits that show that the supply came up: PORRSTF and BORRSTF.
pub const SUPPLY_CAME_UP: u32 = 1 << 27 | 1 << 25;

/// Reads why the part started, and clears the flags for the next start.
pub fn take() -> ResetCause {
    let flags = pac::RCC.csr().read();
    pac::RCC.csr().modify(|w| w.set_rmvf(true));
    ResetCause::of(ResetFlags {
        power_on: flags.porrstf(),
        brown_out: flags.borrstf(),
        watchdog: flags.wdgrstf(),
        software: flags.sftrstf(),
        pin: flags.padrstf(),
    })
}
