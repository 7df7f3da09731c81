//! The seal of a firmware's image: its length and checksum, written into the image after linking.
//!
//! The board's build links a seal whose numbers are still missing. `seal-image` (in `hil-sim/hil-elf/`, which includes
//! this file too) finds the seal by its marker in what the ELF puts into the flash, and writes the numbers. The boot loader
//! and the firmware itself compute them anew at each boot. The seal also identifies the firmware, for programs that
//! have only its image.
//!
//! The checksum is CRC-32C (ISCSI) over every byte from the start to the end of the image, gaps as the erased flash has
//! them (`ERASED`), and the numbers themselves as if they were missing.

/// The first sixteen bytes of a seal, which occur nowhere else in an image.
pub const MARKER: [u32; 4] = [0x9B1D_55E3, 0x4C0A_F7A1, 0xD26E_813B, 0x37F4_2C90];
/// Bytes from the start of an image to its seal: behind the vectors of every part.
pub const SEAL_AT: usize = 0x400;
/// Bytes of a seal.
pub const SEAL_BYTES: usize = 64;
/// Bytes from the start of a seal to its numbers: the length of the image in bytes, and the checksum.
pub const NUMBERS_AT: usize = 16;
/// Bytes of the numbers.
pub const NUMBERS_BYTES: usize = 8;
/// Bytes from the start of a seal to the build's hash, which the linker writes: 32 bits.
pub const BUILD_AT: usize = 24;
/// Bytes from the start of a seal to the firmware's version, which the linker writes: major, minor, patch, 16 bits
/// each.
pub const VERSION_AT: usize = 28;
/// Bytes from the start of a seal to the number of the board that the firmware is for, which the linker writes: 16
/// bits.
pub const BOARD_AT: usize = 34;
/// Value of a missing number.
pub const MISSING: u32 = u32::MAX;
/// A byte of the erased flash.
pub const ERASED: u8 = 0xFF;
/// Address of the flash in the parts' memory.
pub const FLASH_START: u32 = 0x0800_0000;
/// Address of the DTCM, the memory without wait states, in every part. The stack has its bottom.
pub const DTCM_START: u32 = 0x2000_0000;
/// Size of the DTCM of every part, bytes.
pub const DTCM_BYTES: u32 = 128 * 1024;
/// Size of the stack of every program, bytes.
pub const STACK_BYTES: u32 = 32 * 1024;
/// Longest image of any board, bytes: a bank of the flash.
pub const IMAGE_MAX: u32 = 1024 * 1024;
/// Bytes at the end of an image's place that no image may use. In the place of the arrived image these bytes contain
/// the marks about that image. There are far more words than the marks of one update need, so torn marks do not fill
/// them.
pub const JOURNAL_BYTES: u32 = 32 * 32;

/// Longest image that fits a place of `place_bytes` bytes, for the linker, the firmware and the boot loader.
pub const fn image_room(place_bytes: usize) -> u32 {
    (place_bytes as u32).saturating_sub(JOURNAL_BYTES)
}
