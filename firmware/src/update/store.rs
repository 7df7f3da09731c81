//! The firmware's side of the flash: an image is stored piece by piece, checked, and ordered.

use embedded_storage_async::nor_flash::NorFlash;

use super::journal::{self, Mark};
use super::loader::room;
use crate::drive_board::{BOARD, FLASH_WORD_BYTES};
use crate::image::{Image, image_in};
use crate::image_seal::{SEAL_AT, SEAL_BYTES};
use crate::protocol::message::{UPDATE_BYTES, UpdateRefusal, UpdateState};

const _: () = assert!(UPDATE_BYTES.is_multiple_of(FLASH_WORD_BYTES));

/// An image that is coming.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct ImageTransfer {
    image: Image,
    /// Bytes that are stored.
    next: u32,
}

/// The place of the arrived image.
#[derive(Debug)]
pub struct UpdateStore<F> {
    place: F,
    /// Checksum of the image that runs.
    running: u32,
    transfer: Option<ImageTransfer>,
}

impl<F: NorFlash> UpdateStore<F> {
    /// A store that takes the whole of `place`, of a firmware whose image has the checksum `running`.
    pub fn new(place: F, running: u32) -> Self {
        Self {
            place,
            running,
            transfer: None,
        }
    }

    /// What became of the last update, and the checksum of its image.
    pub async fn state(&mut self) -> (UpdateState, u32) {
        let Some(order) = journal::read(&mut self.place).await else {
            return (UpdateState::None, 0);
        };
        if order.checksum != self.running && order.before != self.running {
            // A probe has flashed another image since.
            return (UpdateState::None, 0);
        }
        // The boot loader obeys the marks in this order.
        let state = if order.confirmed {
            UpdateState::Confirmed
        } else if order.rolled_back && order.tried {
            UpdateState::RolledBack
        } else if order.rolled_back {
            UpdateState::NotInstalled
        } else if order.tried {
            UpdateState::OnTrial
        } else {
            UpdateState::Ordered
        };
        (state, order.checksum)
    }

    /// Notes that the image on trial came up.
    ///
    /// # Errors
    /// [`UpdateRefusal::FlashFailed`]: the next reset rolls the image back.
    pub async fn confirm(&mut self) -> Result<(), UpdateRefusal> {
        let order = journal::read(&mut self.place).await.ok_or(UpdateRefusal::NotBegun)?;
        let added = journal::add(&mut self.place, Mark::Confirmed, order.subject()).await;
        added.map_err(|_| UpdateRefusal::FlashFailed)
    }

    /// Whether this image can be for this board, before anything is erased for it.
    ///
    /// # Errors
    /// [`UpdateRefusal::WrongBoard`], [`UpdateRefusal::WrongSize`].
    pub fn fits(&self, image: &Image) -> Result<(), UpdateRefusal> {
        if image.board != BOARD {
            return Err(UpdateRefusal::WrongBoard { board: BOARD });
        }
        let max = room(self.place.capacity());
        if image.length > max || (image.length as usize) < SEAL_AT + SEAL_BYTES {
            return Err(UpdateRefusal::WrongSize { max });
        }
        Ok(())
    }

    /// Makes room for an image that fits; returns where its next piece belongs. The same image goes on where it stood.
    ///
    /// # Errors
    /// [`UpdateRefusal::FlashFailed`].
    pub async fn begin(&mut self, image: Image) -> Result<u32, UpdateRefusal> {
        if let Some(transfer) = self.transfer
            && transfer.image == image
        {
            return Ok(transfer.next);
        }
        self.transfer = None;
        // The journal first, which stands at the end: what it says is about an image that goes now.
        let sector = F::ERASE_SIZE as u32;
        let sectors = self.place.capacity() as u32 / sector;
        for n in (0..sectors).rev() {
            let erased = self.place.erase(n * sector, (n + 1) * sector).await;
            erased.map_err(|_| UpdateRefusal::FlashFailed)?;
        }
        self.transfer = Some(ImageTransfer { image, next: 0 });
        Ok(0)
    }

    /// Stores the piece of the image that begins at `at`; returns where the next one belongs.
    ///
    /// # Errors
    /// [`UpdateRefusal::NotBegun`], [`UpdateRefusal::OutOfOrder`], [`UpdateRefusal::FlashFailed`] (the transfer begins
    /// anew then).
    pub async fn write(&mut self, at: u32, piece: &[u8; UPDATE_BYTES]) -> Result<u32, UpdateRefusal> {
        let ImageTransfer { image, next } = self.transfer.ok_or(UpdateRefusal::NotBegun)?;
        if at != next || next >= image.length {
            return Err(UpdateRefusal::OutOfOrder { next });
        }
        let left = ((image.length - at) as usize).min(UPDATE_BYTES);
        let words = left.next_multiple_of(FLASH_WORD_BYTES);
        let bytes = piece.get(..words).ok_or(UpdateRefusal::FlashFailed)?;
        // A word that was programmed once cannot be programmed again: after a failure the place is erased first.
        self.transfer = None;
        let written = self.place.write(at, bytes).await;
        written.map_err(|_| UpdateRefusal::FlashFailed)?;
        let next = at + left as u32;
        self.transfer = Some(ImageTransfer { image, next });
        Ok(next)
    }

    /// Checks what is stored against what was announced.
    ///
    /// # Errors
    /// [`UpdateRefusal::NotBegun`], also if pieces are missing; [`UpdateRefusal::WrongChecksum`], and the transfer begins
    /// anew.
    pub async fn check(&mut self) -> Result<Image, UpdateRefusal> {
        let ImageTransfer { image, next } = self.transfer.ok_or(UpdateRefusal::NotBegun)?;
        if next < image.length {
            return Err(UpdateRefusal::NotBegun);
        }
        let room = room(self.place.capacity());
        if image_in(&mut self.place, room, BOARD).await == Some(image) {
            return Ok(image);
        }
        self.transfer = None;
        Err(UpdateRefusal::WrongChecksum)
    }

    /// Orders the installation of an image that was checked.
    ///
    /// # Errors
    /// [`UpdateRefusal::FlashFailed`]: nothing is ordered.
    pub async fn order(&mut self, image: &Image) -> Result<(), UpdateRefusal> {
        let subject = [image.length, image.checksum, self.running];
        let added = journal::add(&mut self.place, Mark::Ordered, subject).await;
        self.transfer = None;
        added.map_err(|_| UpdateRefusal::FlashFailed)
    }
}
