//! What a part is like before the firmware starts.

use rigless::device::RegisterFile;
use rigless::soc::stm32h743::generated::{dbgmcu, flash};
use rigless::soc::stm32h743::peripherals::flash::{Flash, OptionBytes};

/// Uncorrectable errors of the flash, as the firmware finds them.
///
/// The emulated flash has no error correction, and its reads reach no model. What the firmware does before each guarded
/// read shows instead: it clears the bank's error flag. The flag then rises for some of the reads, counted from the
/// start of the part. The bus fault that the part raises as well is not modelled.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FlashDamage {
    /// The bank: 0 holds the firmware, 1 parameters and fault history.
    pub bank: usize,
    /// Guarded reads before the first damaged one.
    pub after: u64,
    /// Damaged reads in a row.
    pub reads: u64,
}

/// What a part is like before the firmware starts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PartSetup {
    /// The external clock runs.
    pub external_clock: bool,
    /// Brown-out level of the option bytes, 0 to 3.
    pub brown_out_level: u8,
    /// Sectors of bank 2 that are not write-protected, a bit each.
    pub writable_sectors: u8,
    /// Silicon revision.
    pub revision: u16,
    /// Damaged words of the flash, if any.
    pub flash_damage: Option<FlashDamage>,
}

impl Default for PartSetup {
    /// The part as the board needs it.
    fn default() -> Self {
        Self {
            external_clock: true,
            brown_out_level: 3,
            writable_sectors: u8::MAX,
            revision: 0x2003,
            flash_damage: None,
        }
    }
}

/// Lowest bit of the brown-out level in the option bytes.
const BROWN_OUT_SHIFT: u32 = 2;
/// Lowest bit of the revision in the identity code.
const REVISION_SHIFT: u32 = 16;

impl PartSetup {
    /// Programs the option bytes.
    pub(super) fn program(&self, flash: &mut Flash, registers: &mut RegisterFile) {
        let factory = OptionBytes::FACTORY;
        let level = u64::from(self.brown_out_level) << BROWN_OUT_SHIFT;
        let options = OptionBytes {
            optsr: factory.optsr & !(3 << BROWN_OUT_SHIFT) | level,
            wpsn: [factory.wpsn[0], u64::from(self.writable_sectors)],
            ..factory
        };
        flash.keep_options(options, registers);
    }

    /// Marks the silicon.
    pub(super) fn mark(&self, registers: &mut RegisterFile) {
        let code = registers.get(dbgmcu::Register::Idc) & 0xFFFF;
        registers.set(dbgmcu::Register::Idc, code | u64::from(self.revision) << REVISION_SHIFT);
    }
}

/// Flag of an uncorrectable error in a bank's status register.
pub(super) const UNCORRECTABLE: u32 = 1 << 26;

/// Status register of a bank of the flash.
pub(super) fn status(bank: usize) -> flash::Register {
    [flash::Register::Sr1, flash::Register::Sr2][bank]
}
