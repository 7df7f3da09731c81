//! What is peculiar to this part: the name of a timer's mode, and what the self-test asks: its silicon revision, and
//! its option bytes.

use embassy_stm32::pac;
use embassy_stm32::pac::timer::vals::OcmGp;
use firmware::drive_board::{HISTORY_SECTORS, PARAMETER_SECTORS, SECTORS_PER_BANK};

/// High while the counter is below the compare value: the bridges' mode.
pub const PWM_MODE: OcmGp = OcmGp::PWM_MODE1;

/// Brown-out level 3 of the option bytes: the part is held in reset below 2.7 V. The factory's level 0 lets the core
/// run down to 1.7 V, below what its clock and the bridges' drivers need.
const BROWN_OUT_LEVEL: u8 = 3;
/// Revision X, the first one whose clock and memory errors reach the bridges' timer and whose converter divides its
/// clock by two (ES0392, "Timer system breaks do not work" of the revisions before).
const FIRST_REVISION: u16 = 0x2001;

/// Whether the silicon has what the firmware needs.
pub fn revision_is_right() -> bool {
    let revision = pac::DBGMCU.idc().read().rev_id();
    defmt::info!("self-test: silicon revision {=u16:#06x}", revision);
    revision >= FIRST_REVISION
}

/// Whether the option bytes hold the brown-out level, leave the banks in order, and protect no sector that the firmware
/// writes.
pub fn options_are_right() -> bool {
    let options = pac::FLASH.optsr_cur().read();
    let writable = pac::FLASH.bank(1).wpsn_curr().read().wrpsn();
    defmt::info!(
        "self-test: brown-out level {=u8}, banks swapped {=bool}, writable sectors of bank 2 {=u8:#010b}",
        options.bor_lev(),
        pac::FLASH.optcr().read().swap_bank(),
        writable
    );
    options.bor_lev() == BROWN_OUT_LEVEL
        && !pac::FLASH.optcr().read().swap_bank()
        && !options.swap_bank_opt()
        && writable & WRITTEN_SECTORS == WRITTEN_SECTORS
}

/// The sectors of bank 2 that hold parameters and fault history, a bit each: the last ones.
const WRITTEN_SECTORS: u8 = {
    let written = PARAMETER_SECTORS + HISTORY_SECTORS;
    assert!(written <= SECTORS_PER_BANK && SECTORS_PER_BANK == 8);
    u8::MAX << (SECTORS_PER_BANK - written)
};
