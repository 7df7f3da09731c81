//! Checks the firmware's image in the flash: every word must be readable, and the checksum must be that of the build.

use core::mem::offset_of;

use embassy_futures::block_on;
use embedded_storage_async::nor_flash::{ErrorType, ReadNorFlash};
use firmware::built_in::BUILD_HASH;
use firmware::drive_board::{BOARD, FLASH_SECTOR_BYTES, FLASH_WORD_BYTES, IMAGE_HOME, IMAGE_START, memory};
use firmware::image::image_in;
use firmware::image_seal::{
    BOARD_AT, BUILD_AT, MARKER, MISSING, NUMBERS_AT, SEAL_AT, SEAL_BYTES, VERSION_AT, image_room,
};
use firmware::link::VERSION;

use super::storage::{StorageError, read};

/// The seal. Marker and numbers lie within one word of the flash.
#[repr(C, align(32))]
struct Seal {
    marker: [u32; 4],
    length: u32,
    checksum: u32,
    build: u32,
    version: [u16; 3],
    board: u16,
}

const _: () = assert!(offset_of!(Seal, length) == NUMBERS_AT && align_of::<Seal>() == FLASH_WORD_BYTES);
const _: () = assert!(offset_of!(Seal, build) == BUILD_AT && offset_of!(Seal, version) == VERSION_AT);
const _: () = assert!(offset_of!(Seal, board) == BOARD_AT && size_of::<Seal>() == SEAL_BYTES);

/// Linked without its numbers, which `seal-image` writes into the ELF. The program therefore always reads the seal from
/// the flash.
#[used]
#[unsafe(link_section = ".seal")]
static SEAL: Seal = Seal {
    marker: MARKER,
    length: MISSING,
    checksum: MISSING,
    build: BUILD_HASH,
    version: VERSION,
    board: BOARD,
};

/// Largest size of an image in bytes.
const ROOM: u32 = image_room(memory::IMAGE_SECTORS * FLASH_SECTOR_BYTES);

/// The state of the image in the flash.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ImageState {
    /// The firmware that was built.
    Whole,
    /// A firmware without the numbers of its seal.
    Unsealed,
    /// A word is unreadable, or the firmware differs from the firmware that was built.
    Damaged,
}

/// Reads the image, constants and the initial values of variables included: an unreadable word would cause a fault when
/// the firmware reaches it, perhaps while driving. Also returns the checksum that the seal states.
pub fn check() -> (ImageState, u32) {
    let mut checksum = MISSING;
    let state = try_check(&mut checksum).unwrap_or(ImageState::Damaged);
    (state, checksum)
}

fn try_check(told: &mut u32) -> Result<ImageState, StorageError> {
    // The place at which programs that have only the image look for the seal.
    let seal = &raw const SEAL as usize;
    if seal != IMAGE_START as usize + SEAL_AT {
        return Ok(ImageState::Damaged);
    }
    let mut word = [0; FLASH_WORD_BYTES];
    read(seal, &mut word)?;
    let number = |at: usize| {
        let bytes = word.get(at..at + 4).and_then(|bytes| bytes.try_into().ok());
        bytes.map_or(MISSING, u32::from_le_bytes)
    };
    let (length, checksum) = (number(offset_of!(Seal, length)), number(offset_of!(Seal, checksum)));
    *told = checksum;
    if length == MISSING {
        return Ok(ImageState::Unsealed);
    }
    defmt::info!(
        "self-test: image of {=u32} bytes, checksum {=u32:08x}",
        length,
        checksum
    );
    let whole = block_on(image_in(&mut RunningPlace, ROOM, &IMAGE_HOME)).is_ok();
    Ok(if whole { ImageState::Whole } else { ImageState::Damaged })
}

/// The place of the running image in the flash, read word by word.
struct RunningPlace;

impl ErrorType for RunningPlace {
    type Error = StorageError;
}

impl ReadNorFlash for RunningPlace {
    const READ_SIZE: usize = 1;

    async fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), StorageError> {
        let mut address = IMAGE_START as usize + offset as usize;
        for piece in bytes.chunks_mut(FLASH_WORD_BYTES) {
            read(address, piece)?;
            address += piece.len();
        }
        Ok(())
    }

    fn capacity(&self) -> usize {
        ROOM as usize
    }
}
