//! An image in one of its places, and the check of its seal.

use crc::{CRC_32_ISCSI, Crc};
use embedded_storage_async::nor_flash::ReadNorFlash;
use serde::{Deserialize, Serialize};

use crate::image_seal::{
    BOARD_AT, BUILD_AT, ERASED, MARKER, NUMBERS_AT, NUMBERS_BYTES, SEAL_AT, SEAL_BYTES, VERSION_AT,
};

/// CRC-32C: the checksum of images, of stored sets and faults, and the hash of parameters' names.
pub const CHECKSUM: Crc<u32> = Crc::<u32>::new(&CRC_32_ISCSI);

/// A sealed image, as its seal describes it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Image {
    /// The board that it is for.
    pub board: u16,
    /// Bytes in the flash.
    pub length: u32,
    /// CRC-32C (ISCSI) of those bytes, computed with the seal's numbers as if they were missing.
    pub checksum: u32,
    /// Hash of the sources and the vehicle file of the build.
    pub build: u32,
    /// Version of the firmware: major, minor, patch.
    pub version: [u16; 3],
}

/// Bytes that are read at once; the seal lies within one such piece.
const CHECKED_PIECE: usize = 256;

/// The marker with every bit inverted, so that the marker itself occurs only in an image's seal.
const TURNED_MARKER: [u32; 4] = [!MARKER[0], !MARKER[1], !MARKER[2], !MARKER[3]];

const _: () = assert!(
    SEAL_AT.is_multiple_of(CHECKED_PIECE) && SEAL_BYTES <= CHECKED_PIECE && NUMBERS_AT + NUMBERS_BYTES <= SEAL_BYTES
);

impl Image {
    /// The image that a seal describes; `None` without its marker.
    fn of(seal: &[u8]) -> Option<Self> {
        let word = |at: usize| Some(u32::from_le_bytes(seal.get(at..at + 4)?.try_into().ok()?));
        let half = |at: usize| Some(u16::from_le_bytes(seal.get(at..at + 2)?.try_into().ok()?));
        for (n, turned) in TURNED_MARKER.into_iter().enumerate() {
            if !word(4 * n)? != turned {
                return None;
            }
        }
        Some(Self {
            board: half(BOARD_AT)?,
            length: word(NUMBERS_AT)?,
            checksum: word(NUMBERS_AT + 4)?,
            build: word(BUILD_AT)?,
            version: [half(VERSION_AT)?, half(VERSION_AT + 2)?, half(VERSION_AT + 4)?],
        })
    }
}

/// Common properties of all images that a board can run.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ImageHome {
    /// Number of the board.
    pub board: u16,
    /// Address of a running image in the part's memory.
    pub start: u32,
    /// Memory in which the stack may lie: start and bytes of each RAM.
    pub stacks: [[u32; 2]; 2],
}

/// Why a place holds no image for this board.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum NoImage {
    /// The place has no seal for this board, an unreadable byte, or a wrong checksum.
    NotWhole,
    /// The image is intact but linked to run from another address, so the part could not start it.
    WrongPlace,
}

/// Whether a part can start an image of `length` bytes with these first two vectors: the end of a
/// stack in the RAM, and the address of a Thumb instruction within the image.
fn starts(vectors: [u8; 8], length: u32, home: &ImageHome) -> bool {
    let [s0, s1, s2, s3, r0, r1, r2, r3] = vectors;
    let (stack, reset) = (
        u32::from_le_bytes([s0, s1, s2, s3]),
        u32::from_le_bytes([r0, r1, r2, r3]),
    );
    let in_ram = |[start, bytes]: [u32; 2]| stack.checked_sub(start).is_some_and(|used| 0 < used && used <= bytes);
    let own = reset.checked_sub(home.start).is_some_and(|at| at < length);
    stack.is_multiple_of(8) && home.stacks.into_iter().any(in_ram) && reset & 1 == 1 && own
}

/// Reads the image at the start of `place`, which has room for `room` bytes. The function checks
/// that every byte is readable, that the image is for this board, that its checksum is right, and
/// that the part can start it.
///
/// # Errors
/// [`NoImage`].
pub async fn image_in<F: ReadNorFlash>(place: &mut F, room: u32, home: &ImageHome) -> Result<Image, NoImage> {
    let image = whole_image(place, room, home.board).await.ok_or(NoImage::NotWhole)?;
    let mut vectors = [0; 8];
    let read = place.read(0, &mut vectors).await;
    read.map_err(|_| NoImage::NotWhole)?;
    if starts(vectors, image.length, home) {
        Ok(image)
    } else {
        Err(NoImage::WrongPlace)
    }
}

async fn whole_image<F: ReadNorFlash>(place: &mut F, room: u32, board: u16) -> Option<Image> {
    let mut piece = [0; CHECKED_PIECE];
    place.read(SEAL_AT as u32, &mut piece).await.ok()?;
    let image = Image::of(&piece)?;
    if image.board != board || image.length > room || (image.length as usize) < SEAL_AT + SEAL_BYTES {
        return None;
    }
    let mut digest = CHECKSUM.digest();
    for at in (0..image.length).step_by(CHECKED_PIECE) {
        let left = ((image.length - at) as usize).min(CHECKED_PIECE);
        let bytes = piece.get_mut(..left)?;
        place.read(at, bytes).await.ok()?;
        if at as usize == SEAL_AT {
            bytes.get_mut(NUMBERS_AT..NUMBERS_AT + NUMBERS_BYTES)?.fill(ERASED);
        }
        digest.update(bytes);
    }
    (digest.finalize() == image.checksum).then_some(image)
}
