//! Decisions about the arrived image, stored as marks in the last bytes of the image's place.
//!
//! A mark is one word of the flash that is programmed once and identifies its image. A mark counts only if it is
//! readable and complete. A word that was torn by a power cut is no mark, and the next mark uses the following word.

use embedded_storage_async::nor_flash::NorFlash;

use crate::drive_board::FLASH_WORD_BYTES;
use crate::image::Image;
use crate::image_seal::{ERASED, JOURNAL_BYTES};

/// Number of marks for which the journal has room.
const JOURNAL_WORDS: u32 = JOURNAL_BYTES / FLASH_WORD_BYTES as u32;
/// The first word of a mark, except the lowest bits, which contain the mark's kind.
const ENTRY_MARK: u32 = 0x7A3E_51C0;

/// A decision about the arrived image, or a step that was done with it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u32)]
pub enum Mark {
    /// The firmware has checked it and orders its installation.
    Ordered = 1,
    /// The image that ran before is kept.
    Kept = 2,
    /// The arrived image is installed and is booted for the first time.
    Tried = 3,
    /// The image came up.
    Confirmed = 4,
    /// The image is given up, and the kept image is to run.
    RolledBack = 5,
    /// The order is finished: any intact image in the running place is booted, even the same image if a probe
    /// flashes it.
    Closed = 6,
}

/// The marks about one image.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[allow(clippy::struct_excessive_bools)] // Each is a mark of its own; any may stand without the others.
pub struct InstallOrder {
    /// Length of the image, bytes.
    pub length: u32,
    /// Its checksum.
    pub checksum: u32,
    /// Checksum of the image that gave the order. If another image runs, a probe has flashed it, and the order is
    /// void.
    pub before: u32,
    /// The image that ran before is kept.
    pub kept: bool,
    /// It has been booted.
    pub tried: bool,
    /// The image came up.
    pub confirmed: bool,
    /// It is given up.
    pub rolled_back: bool,
    /// Nothing is left to do about it.
    pub closed: bool,
}

impl InstallOrder {
    /// The image that the marks are about.
    pub fn subject(&self) -> Subject {
        [self.length, self.checksum, self.before]
    }

    /// Whether the marks are about this image.
    pub fn is_of(&self, image: &Image) -> bool {
        self.length == image.length && self.checksum == image.checksum
    }

    /// Whether another image runs than the one that gave the order and the one that was ordered.
    pub fn is_void(&self, running: &Image) -> bool {
        !self.is_of(running) && running.checksum != self.before
    }
}

/// The mark was not written: the journal is full, or the flash failed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct NotMarked;

/// What a mark is about: length and checksum of the image, checksum of the image before.
pub type Subject = [u32; 3];

fn encode(mark: Mark, [length, checksum, before]: Subject) -> [u8; FLASH_WORD_BYTES] {
    let mut word = [0; FLASH_WORD_BYTES];
    let parts = [ENTRY_MARK | mark as u32, length, checksum, before];
    // Each part is stored once as it is and once inverted, so an incomplete word is no mark.
    let parts = parts.into_iter().chain(parts.map(|part| !part));
    for (to, part) in word.chunks_exact_mut(4).zip(parts) {
        to.copy_from_slice(&part.to_le_bytes());
    }
    word
}

fn start<F: NorFlash>(arrived: &F) -> u32 {
    (arrived.capacity() as u32).saturating_sub(JOURNAL_BYTES)
}

fn places<F: NorFlash>(arrived: &F) -> impl Iterator<Item = u32> + use<F> {
    let start = start(arrived);
    (0..JOURNAL_WORDS).map(move |n| start + n * FLASH_WORD_BYTES as u32)
}

/// Reads the journal at the end of the arrived image's place; `None` if nothing is ordered.
pub async fn read<F: NorFlash>(arrived: &mut F) -> Option<InstallOrder> {
    let mut order: Option<InstallOrder> = None;
    let mut word = [0; FLASH_WORD_BYTES];
    for at in places(arrived) {
        if arrived.read(at, &mut word).await.is_err() {
            continue;
        }
        let part = |n: usize| {
            let bytes = word.get(4 * n..4 * n + 4).and_then(|bytes| bytes.try_into().ok());
            bytes.map_or(0, u32::from_le_bytes)
        };
        let [length, checksum, before] = [part(1), part(2), part(3)];
        let is = |mark: Mark| word == encode(mark, [length, checksum, before]);
        if is(Mark::Ordered) && order.is_none() {
            order = Some(InstallOrder {
                length,
                checksum,
                before,
                kept: false,
                tried: false,
                confirmed: false,
                rolled_back: false,
                closed: false,
            });
        }
        if let Some(order) = &mut order
            && order.subject() == [length, checksum, before]
        {
            order.kept |= is(Mark::Kept);
            order.tried |= is(Mark::Tried);
            order.confirmed |= is(Mark::Confirmed);
            order.rolled_back |= is(Mark::RolledBack);
            order.closed |= is(Mark::Closed);
        }
    }
    order
}

/// Adds a mark, and reads it back.
///
/// # Errors
/// [`NotMarked`]; the earlier marks are unchanged.
pub async fn add<F: NorFlash>(arrived: &mut F, mark: Mark, subject: Subject) -> Result<(), NotMarked> {
    add_times(arrived, mark, subject, 1).await
}

/// Writes the last mark about an image into every remaining word. An interrupted erasure may leave any words, and at
/// least one of these marks should survive longer than the earlier marks.
///
/// # Errors
/// [`NotMarked`] if no word could be written.
pub async fn fill<F: NorFlash>(arrived: &mut F, last: Mark, subject: Subject) -> Result<(), NotMarked> {
    add_times(arrived, last, subject, JOURNAL_WORDS).await
}

/// Writes a mark at most `most` times; one written mark is sufficient.
async fn add_times<F: NorFlash>(arrived: &mut F, mark: Mark, subject: Subject, most: u32) -> Result<(), NotMarked> {
    let wanted = encode(mark, subject);
    let mut stands = 0;
    let mut word = [0; FLASH_WORD_BYTES];
    for at in places(arrived) {
        // A torn word is not written again, because its check bits belong to other contents.
        let blank = arrived.read(at, &mut word).await.is_ok() && word.iter().all(|byte| *byte == ERASED);
        if !blank {
            continue;
        }
        let written = arrived.write(at, &wanted).await.is_ok();
        if written && arrived.read(at, &mut word).await.is_ok() && word == wanted {
            stands += 1;
        }
        if stands == most {
            break;
        }
    }
    if stands > 0 { Ok(()) } else { Err(NotMarked) }
}
