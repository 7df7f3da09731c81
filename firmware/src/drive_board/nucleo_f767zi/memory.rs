//! The layout of the part's memory. The firmware, the build (which passes it to the linker) and the
//! simulated boards read it. Apart from these numbers `memory.x` is the same for every board.

/// The board's number in the seal of an image.
pub const BOARD: u16 = 767;
/// Bytes of one sector of the flash, the unit of an erase. The flash also has five smaller sectors at the
/// start of each bank, which together have the size of one sector.
pub const FLASH_SECTOR_BYTES: usize = 128 * 1024;
/// This board has no boot loader: the firmware begins where the flash begins.
pub const LOADER_SECTORS: usize = 0;
/// Sectors of the flash that the firmware runs from: bank 1. The option bit `nDBANK` is 0 (two banks), which the self-test
/// requires.
pub const IMAGE_SECTORS: usize = 8;
/// RAM of the firmware: SRAM1 and SRAM2, which follow each other.
pub const RAM_START: u32 = 0x2002_0000;
/// Size of that RAM, bytes.
pub const RAM_BYTES: u32 = 384 * 1024;
/// This board has no place for an image that arrives over the link.
pub const ARRIVED_SECTOR: Option<usize> = None;
