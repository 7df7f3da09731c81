//! The layout of the part's memory. The firmware, the build (which passes it to the linker) and the
//! simulated boards read it. Apart from these numbers `memory.x` is the same for every board.

use crate::image_seal::{DTCM_BYTES, DTCM_START, STACK_BYTES};

/// The board's number in the seal of an image.
pub const BOARD: u16 = 743;
/// Bytes of one sector of the flash, the unit of an erase.
pub const FLASH_SECTOR_BYTES: usize = 128 * 1024;
/// Number of sectors of the boot loader, in front of the firmware.
pub const LOADER_SECTORS: usize = 1;
/// Sectors of the flash that the firmware runs from, in bank 1 behind the boot loader.
pub const IMAGE_SECTORS: usize = 2;
/// RAM of the firmware: the AXI SRAM, which DMA1 and DMA2 can access (they cannot access the DTCM).
pub const RAM_START: u32 = 0x2400_0000;
/// Size of that RAM, bytes.
pub const RAM_BYTES: u32 = 512 * 1024;
/// Sectors from the start of the flash to the image that arrives over the link: the first of bank 2.
pub const ARRIVED_SECTOR: Option<usize> = Some(8);
/// Sectors from the start of the flash to the image that ran before. Behind it lies the fault history.
pub const KEPT_SECTOR: usize = 8 + IMAGE_SECTORS;
/// RAM of the boot loader: the DTCM behind the stack. The firmware keeps nothing there over a reset.
pub const LOADER_RAM_START: u32 = DTCM_START + STACK_BYTES;
/// Size of that RAM, bytes.
pub const LOADER_RAM_BYTES: u32 = DTCM_BYTES - STACK_BYTES;
