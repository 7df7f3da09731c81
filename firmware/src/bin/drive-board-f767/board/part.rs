//! Specifics of this part: the name of a timer's mode, and the self-test's checks of identity and option bytes.

use embassy_stm32::pac;
use embassy_stm32::pac::timer::vals::Ocm;

use super::flash;

/// High while the counter is below the compare value: the bridges' mode.
pub const PWM_MODE: Ocm = Ocm::PWM_MODE1;

/// Brown-out level 3 of the option bytes: the part is held in reset below 2.7 V. The factory's setting (off) lets the
/// core run down to 1.7 V, below what its clock and the bridges' drivers need. This part counts the levels down.
const BROWN_OUT_LEVEL: u8 = 0;
/// Identity of the STM32F76x and STM32F77x.
const DEVICE: u16 = 0x451;
/// Bits of the option register that mean "not protected", one per pair of sectors: all bits.
const NOT_PROTECTED: u32 = 0x0FFF_0000;

/// Whether this is the part for which the firmware was built. No revision is known to lack what the firmware needs.
pub fn revision_is_right() -> bool {
    let identity = pac::DBGMCU.idcode().read();
    defmt::info!(
        "self-test: device {=u16:#05x}, silicon revision {=u16:#06x}",
        identity.dev_id(),
        identity.rev_id()
    );
    identity.dev_id() == DEVICE
}

/// Whether the option bytes select the brown-out level, split the flash into two banks, start from the first bank, and
/// protect no sector.
pub fn options_are_right() -> bool {
    let options = pac::FLASH.optcr().read();
    defmt::info!(
        "self-test: brown-out level field {=u8}, two banks {=bool}, start from either bank {=bool}, unprotected {=u32:#010x}",
        options.bor_lev(),
        flash::has_two_banks(),
        !options.n_dboot(),
        options.0 & NOT_PROTECTED
    );
    options.bor_lev() == BROWN_OUT_LEVEL
        && flash::has_two_banks()
        && options.n_dboot()
        && options.0 & NOT_PROTECTED == NOT_PROTECTED
}
