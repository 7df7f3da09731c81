//! Specifics of this part: the name of a timer's mode, and the self-test's checks of silicon revision and option
//! bytes.

use embassy_stm32::pac;
use embassy_stm32::pac::timer::vals::OcmGp;
use firmware::drive_board::memory::{ARRIVED_SECTOR, IMAGE_SECTORS, KEPT_SECTOR, LOADER_SECTORS};
use firmware::drive_board::{ARRIVED_SECTORS, HISTORY_SECTORS, PARAMETER_SECTORS, SECTORS_PER_BANK};

/// High while the counter is below the compare value: the bridges' mode.
pub const PWM_MODE: OcmGp = OcmGp::PWM_MODE1;

/// Brown-out level 3 of the option bytes: the part is held in reset below 2.7 V. The factory's level 0 lets the core
/// run down to 1.7 V, below what its clock and the bridges' drivers need.
const BROWN_OUT_LEVEL: u8 = 3;
/// Revision V. On Y and W errors of clock and memory do not reach the bridges' timers (ES0392 2.2.2), reads of the AXI SRAM can
/// be wrong (2.2.10), and the converter does not divide its clock by two; of X the sources disagree (docs/part-errata.md).
const FIRST_REVISION: u16 = 0x2003;

/// Whether the silicon revision meets the firmware's needs.
pub fn revision_is_right() -> bool {
    let revision = pac::DBGMCU.idc().read().rev_id();
    defmt::info!("self-test: silicon revision {=u16:#06x}", revision);
    revision >= FIRST_REVISION
}

/// Whether the option bytes select the brown-out level, do not swap the banks, and protect no sector that firmware or
/// boot loader write.
pub fn options_are_right() -> bool {
    let options = pac::FLASH.optsr_cur().read();
    let writable = [0, 1].map(|bank| pac::FLASH.bank(bank).wpsn_curr().read().wrpsn());
    defmt::info!(
        "self-test: brown-out level {=u8}, banks swapped {=bool}, writable sectors {=u8:#010b} and {=u8:#010b}",
        options.bor_lev(),
        pac::FLASH.optcr().read().swap_bank(),
        writable[0],
        writable[1]
    );
    options.bor_lev() == BROWN_OUT_LEVEL
        && !pac::FLASH.optcr().read().swap_bank()
        && !options.swap_bank_opt()
        && [WRITTEN_SECTORS_1, WRITTEN_SECTORS_2]
            .into_iter()
            .zip(writable)
            .all(|(written, writable)| writable & written == written)
}

/// The sectors of bank 1 that the boot loader writes, one bit per sector: the running image's sectors.
const WRITTEN_SECTORS_1: u8 = sectors(LOADER_SECTORS, IMAGE_SECTORS);
/// The sectors of bank 2 that firmware and boot loader write, one bit per sector: those of the two images, of the
/// fault history, and of the parameters, which are the last.
const WRITTEN_SECTORS_2: u8 = {
    let Some(arrived) = ARRIVED_SECTOR else {
        panic!("an image that arrives has a place")
    };
    let stored = PARAMETER_SECTORS + HISTORY_SECTORS;
    sectors(arrived - SECTORS_PER_BANK, ARRIVED_SECTORS)
        | sectors(KEPT_SECTOR - SECTORS_PER_BANK, IMAGE_SECTORS)
        | sectors(SECTORS_PER_BANK - stored, stored)
};

/// One bit for each of `count` sectors of a bank from the sector `first` on.
const fn sectors(first: usize, count: usize) -> u8 {
    assert!(first + count <= SECTORS_PER_BANK && SECTORS_PER_BANK == 8);
    (((1_u16 << count) - 1) << first) as u8
}
