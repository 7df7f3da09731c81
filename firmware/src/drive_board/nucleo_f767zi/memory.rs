//! What lies where in the part's memory: read by the firmware, by the build, which gives it to the linker, and by the boards
//! that stand in for this one. Apart from these numbers `memory.x` is the same for every board.

/// The board's number in the seal of an image.
pub const BOARD: u16 = 767;
/// One sector of the flash, bytes: what an erase clears. The flash has smaller ones too, five at the start
/// of each bank, which take the room of one.
pub const FLASH_SECTOR_BYTES: usize = 128 * 1024;
/// This board has no boot loader: the firmware begins where the flash begins.
pub const LOADER_SECTORS: usize = 0;
/// Sectors of the flash that the firmware runs from: bank 1. The option bit `nDBANK` is 0 (two banks), which the self-test
/// requires.
pub const IMAGE_SECTORS: usize = 8;
/// RAM of the firmware: SRAM1 and SRAM2, which follow each other.
pub const RAM_START: u32 = 0x2002_0000;
/// Its bytes.
pub const RAM_BYTES: u32 = 384 * 1024;
/// This board has no place for an image that arrives over the link.
pub const ARRIVED_SECTOR: Option<usize> = None;
