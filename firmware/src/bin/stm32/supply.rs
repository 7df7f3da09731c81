//! The detector of the part's own supply.

use embassy_stm32::pac;

/// Level 6 of the detector: nominally 2.85 V (STM32H7) or 2.8 V (STM32F7). A falling supply trips
/// the detector up to 0.1 V lower.
const LEVEL: u8 = 6;

/// Switches the detector on.
pub fn watch() {
    pac::PWR.cr1().modify(|w| {
        w.set_pls(LEVEL);
        w.set_pvde(true);
    });
}

/// Whether the supply is below the detector's level and about to fail.
pub fn is_low() -> bool {
    pac::PWR.csr1().read().pvdo()
}
