//! State of a part before the firmware starts.

use firmware::image_seal::FLASH_START;
use rigless::device::RegisterFile;
use rigless::soc::stm32h743::generated::{dbgmcu, flash};
use rigless::soc::stm32h743::peripherals::flash::{Flash, OptionBytes};

/// Memory that has gone bad. Addresses are the part's, instants are ns of virtual time.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum MemoryFault {
    /// Words of the flash with more wrong bits than the error correction can restore.
    Unreadable {
        /// Address of the first byte.
        first: u64,
        /// Number of bytes, at least one.
        bytes: u64,
        /// The instant from which the bytes cannot be read.
        since: u64,
        /// The instant from which the bytes can be read again.
        until: u64,
    },
    /// Bits of a RAM word that read as ones, whatever was written.
    Stuck {
        /// Address of the 32-bit word.
        address: u64,
        /// The stuck bits.
        bits: u32,
    },
}

impl MemoryFault {
    /// Bytes of the flash that can never be read.
    pub const fn unreadable(first: u64, bytes: u64) -> Self {
        Self::Unreadable {
            first,
            bytes,
            since: 0,
            until: u64::MAX,
        }
    }

    /// Address of the first bad byte, and number of bad bytes.
    pub(super) const fn words(self) -> (u64, u64) {
        match self {
            Self::Unreadable { first, bytes, .. } => (first, bytes),
            Self::Stuck { address, .. } => (address, 4),
        }
    }
}

/// A break of a bridges' timer.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct BridgeBreak {
    /// The timer: TIM1 for 0, TIM8 for 1.
    pub timer: usize,
    /// Its break: BRK for 0, BRK2 for 1.
    pub nth: usize,
}

/// What a part is like before the firmware starts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PartSetup {
    /// Whether the external clock runs.
    pub external_clock: bool,
    /// Brown-out level of the option bytes, 0 to 3.
    pub brown_out_level: u8,
    /// Sectors of each bank that are not write-protected, a bit each.
    pub writable_sectors: [u8; 2],
    /// A break that does nothing when software asks for it, if there is one.
    pub deaf_break: Option<BridgeBreak>,
    /// The option bytes swap the banks. The emulated part reports the swap but does not perform it.
    pub banks_swapped: bool,
    /// Address from which the core reads its vectors after a reset: the boot loader's, or the
    /// firmware's for a start without the boot loader. The option bytes store the upper half of the
    /// address.
    pub boot_address: u32,
    /// Silicon revision.
    pub revision: u16,
    /// Memory that has gone bad, if any.
    pub memory_fault: Option<MemoryFault>,
}

impl Default for PartSetup {
    /// The part as the board needs it.
    fn default() -> Self {
        Self {
            external_clock: true,
            brown_out_level: 3,
            writable_sectors: [u8::MAX; 2],
            deaf_break: None,
            banks_swapped: false,
            boot_address: FLASH_START,
            revision: 0x2003,
            memory_fault: None,
        }
    }
}

/// Lowest bit of the brown-out level in the option bytes.
const BROWN_OUT_SHIFT: u32 = 2;
/// The bit of the option bytes that swaps the banks.
const SWAP_SHIFT: u32 = 31;
/// The half of the option bytes' boot word that gives the boot address while the pin BOOT0 is low.
const BOOT_PIN_LOW: u64 = 0xFFFF;
/// Lowest bit of the revision in the identity code.
const REVISION_SHIFT: u32 = 16;

impl PartSetup {
    /// Programs the option bytes.
    pub(super) fn program(&self, flash: &mut Flash, registers: &mut RegisterFile) {
        let factory = OptionBytes::FACTORY;
        let level = u64::from(self.brown_out_level) << BROWN_OUT_SHIFT;
        let options = OptionBytes {
            optsr: factory.optsr & !(3 << BROWN_OUT_SHIFT) | level | u64::from(self.banks_swapped) << SWAP_SHIFT,
            boot: factory.boot & !BOOT_PIN_LOW | u64::from(self.boot_address >> 16),
            wpsn: self.writable_sectors.map(u64::from),
            ..factory
        };
        flash.keep_options(options, registers);
    }

    /// Writes the silicon revision to the identity code.
    pub(super) fn mark(&self, registers: &mut RegisterFile) {
        let code = registers.get(dbgmcu::Register::Idc) & 0xFFFF;
        registers.set(dbgmcu::Register::Idc, code | u64::from(self.revision) << REVISION_SHIFT);
    }
}

/// Status register of a bank of the flash.
pub(super) fn status(bank: usize) -> flash::Register {
    [flash::Register::Sr1, flash::Register::Sr2][bank]
}
