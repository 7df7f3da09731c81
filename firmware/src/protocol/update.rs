//! What host and board say to each other about an update.

use serde::{Deserialize, Serialize};

use crate::image::Image;
use crate::image_seal::ERASED;

/// Bytes of an image that one [`UpdateRequest::Write`] carries.
pub const UPDATE_BYTES: usize = UPDATE_WORDS * UPDATE_WORD_BYTES;
/// Words of the flash in one message.
const UPDATE_WORDS: usize = 7;
/// Bytes of such a word: the largest of any board.
const UPDATE_WORD_BYTES: usize = 32;

/// What a host asks of the update.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[allow(clippy::large_enum_variant)] // None is kept in numbers.
pub enum UpdateRequest {
    /// Make room for this image. Answered by [`UpdateAnswer::Ready`]. The image that a transfer of this boot was about
    /// goes on where that transfer stood.
    Begin(Image),
    /// Store a piece of the image.
    Write {
        /// Bytes of the image before this piece.
        at: u32,
        /// The piece; behind the end of the image as the erased flash, `0xFF`.
        bytes: [[u8; UPDATE_WORD_BYTES]; UPDATE_WORDS],
    },
    /// Check what is stored, and restart into it.
    Install,
    /// Return what became of the last update.
    State,
}

impl UpdateRequest {
    /// The request to store the piece of an image that begins at `at`; `None` behind the image's end.
    pub fn piece(image: &[u8], at: u32) -> Option<Self> {
        let rest = image.get(at as usize..).filter(|rest| !rest.is_empty())?;
        let mut bytes = [[ERASED; UPDATE_WORD_BYTES]; UPDATE_WORDS];
        for (to, from) in bytes.as_flattened_mut().iter_mut().zip(rest) {
            *to = *from;
        }
        Some(Self::Write { at, bytes })
    }
}

/// What the board answers to an [`UpdateRequest`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum UpdateAnswer {
    /// There is room; the bytes before `next` are stored.
    Ready {
        /// Where the next piece belongs.
        next: u32,
    },
    /// The image is stored, checked and ordered: the board restarts into its boot loader, which installs it.
    Restarting,
    /// The image is stored and checked, and nothing was installed: this board has no boot loader.
    OnlyStored,
    /// Answer to [`UpdateRequest::State`].
    State {
        /// What became of the last update.
        state: UpdateState,
        /// Checksum of its image; 0 if there was none.
        checksum: u32,
    },
    /// The update goes no further.
    Refused(UpdateRefusal),
}

/// What became of the last update.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum UpdateState {
    /// There was none, or it was never ordered.
    None,
    /// It was ordered, and the boot loader has not installed it yet.
    Ordered,
    /// It runs and has not confirmed itself: the next reset rolls it back.
    OnTrial,
    /// It came up and confirmed itself.
    Confirmed,
    /// It was started and did not confirm itself before the next reset: it was rolled back, and the firmware before it runs.
    RolledBack,
    /// It could not be installed and was never started: the flash failed, or the stored image has changed. The firmware before
    /// it runs.
    NotInstalled,
}

/// Why an update goes no further.
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
    /// What is stored is not the image that the host announced, or has no seal.
    WrongChecksum,
    /// A piece that does not follow what is stored; the host goes on at `next`.
    OutOfOrder {
        /// Where the next piece belongs.
        next: u32,
    },
    /// Nothing has begun in this boot, or not every piece has come.
    NotBegun,
    /// The firmware that runs has not confirmed itself yet.
    OnTrial,
    /// The board's self-test has found something wrong: a new firmware would find it too, and not confirm itself.
    SelfTest,
    /// The flash failed.
    FlashFailed,
    /// The board has no place for an image.
    NoRoom,
    /// The image is whole and for this board, and linked to run from elsewhere: it was built for another division of the flash.
    WrongPlace {
        /// Where the board's image begins.
        start: u32,
    },
}
