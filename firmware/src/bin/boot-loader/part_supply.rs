//! The part's own supply. After a power-on the part is in Run*, with a core voltage that is not yet known to be valid, until its
//! regulator is configured (RM0433, "System supply startup"); nothing is erased or programmed there.

use embassy_stm32::pac::PWR;

/// Configures the regulator as the NUCLEO-H743ZI is wired (LDO, no bypass), as the firmware does after it, and waits until the
/// core's voltage is valid. The bits are written once after a power-on: later writes change nothing. The watchdog ends the wait
/// for a voltage that never is valid.
pub fn settle() {
    PWR.cr3().modify(|w| {
        w.set_scuen(true);
        w.set_ldoen(true);
        w.set_bypass(false);
    });
    while !PWR.csr1().read().actvosrdy() {}
}
