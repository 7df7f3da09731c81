//! The messages between host and board about an update.

use serde::{Deserialize, Serialize};

use crate::image::Image;
use crate::image_seal::ERASED;

/// Bytes of an image that one [`UpdateRequest::Write`] carries.
pub const UPDATE_BYTES: usize = UPDATE_WORDS * UPDATE_WORD_BYTES;
/// Words of the flash in one message.
const UPDATE_WORDS: usize = 7;
/// Bytes of such a word: the largest of any board.
const UPDATE_WORD_BYTES: usize = 32;

/// A host's request about an update.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[allow(clippy::large_enum_variant)] // None is kept in numbers.
pub enum UpdateRequest {
    /// Erase the place for this image. The board answers with [`UpdateAnswer::Ready`]. An interrupted transfer of the
    /// same image in this boot continues at its last position.
    Begin(Image),
    /// Store a piece of the image.
    Write {
        /// Bytes of the image before this piece.
        at: u32,
        /// The piece, filled with `0xFF` (erased flash) behind the end of the image.
        bytes: [[u8; UPDATE_WORD_BYTES]; UPDATE_WORDS],
    },
    /// Check the stored image and restart into it.
    Install,
    /// Return the result of the last update.
    State,
}

impl UpdateRequest {
    /// The request to store the piece of an image that begins at `at`; `None` beyond the image's end.
    pub fn piece(image: &[u8], at: u32) -> Option<Self> {
        let rest = image.get(at as usize..).filter(|rest| !rest.is_empty())?;
        let mut bytes = [[ERASED; UPDATE_WORD_BYTES]; UPDATE_WORDS];
        for (to, from) in bytes.as_flattened_mut().iter_mut().zip(rest) {
            *to = *from;
        }
        Some(Self::Write { at, bytes })
    }
}

/// The board's answer to an [`UpdateRequest`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum UpdateAnswer {
    /// The place is ready; the bytes before `next` are stored.
    Ready {
        /// Position of the next piece.
        next: u32,
    },
    /// The image is stored, checked and ordered: the board restarts into its boot loader, which installs it.
    Restarting,
    /// The image is stored and checked, and nothing was installed: this board has no boot loader.
    OnlyStored,
    /// Answer to [`UpdateRequest::State`].
    State {
        /// The result of the last update.
        state: UpdateState,
        /// Checksum of the update's image; 0 without an update.
        checksum: u32,
    },
    /// The board refuses to continue the update.
    Refused(UpdateRefusal),
}

/// The result of the last update.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum UpdateState {
    /// There was no update, or it was never ordered.
    None,
    /// The update was ordered, and the boot loader has not yet installed it.
    Ordered,
    /// The new firmware runs and has not confirmed itself: the next reset rolls it back.
    OnTrial,
    /// The new firmware came up and confirmed itself.
    Confirmed,
    /// The new firmware did not confirm itself before the next reset and was rolled back; the previous firmware runs.
    RolledBack,
    /// The new firmware could not be installed and was never started, because the flash failed or the stored image
    /// has changed. The previous firmware runs.
    NotInstalled,
}

/// Why the board refuses to continue an update.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum UpdateRefusal {
    /// The vehicle is armed or makes a controlled stop, or the control task does not run.
    NotDisarmed,
    /// The battery, or the part's own supply, is outside its range.
    LowSupply,
    /// The image is for another board.
    WrongBoard {
        /// The board that answers.
        board: u16,
    },
    /// The image does not fit its place in the flash.
    WrongSize {
        /// Longest image, bytes.
        max: u32,
    },
    /// The stored data are not the image that the host announced, or have no seal.
    WrongChecksum,
    /// A piece that does not follow the stored bytes; the host must continue at `next`.
    OutOfOrder {
        /// Position of the next piece.
        next: u32,
    },
    /// No transfer has begun in this boot, or pieces are missing.
    NotBegun,
    /// The firmware that runs has not confirmed itself yet.
    OnTrial,
    /// The board's self-test has failed. A new firmware's self-test would fail, too, so the firmware would not
    /// confirm itself.
    SelfTest,
    /// The flash failed.
    FlashFailed,
    /// The board has no place for an image.
    NoRoom,
    /// The image is intact and for this board, but linked to run from another address: it was built for another
    /// layout of the flash.
    WrongPlace {
        /// Address of the board's image.
        start: u32,
    },
}
