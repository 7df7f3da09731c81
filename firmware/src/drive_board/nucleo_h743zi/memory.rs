//! What lies where in the part's memory: read by the firmware, by the build, which gives it to the linker, and by the boards
//! that stand in for this one. Apart from these numbers `memory.x` is the same for every board.

/// The board's number in the seal of an image.
pub const BOARD: u16 = 743;
/// One sector of the flash, bytes: what an erase clears.
pub const FLASH_SECTOR_BYTES: usize = 128 * 1024;
/// Sectors in front of the firmware's: the boot loader's.
pub const LOADER_SECTORS: usize = 1;
/// Sectors of the flash that the firmware runs from, in bank 1 behind the boot loader.
pub const IMAGE_SECTORS: usize = 2;
/// RAM of the firmware: the AXI SRAM, which DMA1 and DMA2 reach (they cannot reach the DTCM).
pub const RAM_START: u32 = 0x2400_0000;
/// Its bytes.
pub const RAM_BYTES: u32 = 512 * 1024;
/// Sectors from the start of the flash to the image that arrives over the link: the first of bank 2.
pub const ARRIVED_SECTOR: Option<usize> = Some(8);
/// Sectors from the start of the flash to the image that ran before. Behind it lies the fault history.
pub const KEPT_SECTOR: usize = 8 + IMAGE_SECTORS;
/// RAM of the boot loader: the DTCM behind the stack, in which the firmware keeps nothing over a reset.
pub const LOADER_RAM_START: u32 = 0x2000_8000;
/// Its bytes.
pub const LOADER_RAM_BYTES: u32 = 96 * 1024;
