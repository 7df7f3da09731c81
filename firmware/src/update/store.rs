//! The firmware's part of an update: it stores an image piece by piece, checks it, and orders its installation.

use embedded_storage_async::nor_flash::NorFlash;

use super::journal::{self, InstallOrder, Mark};
use crate::drive_board::{BOARD, FLASH_WORD_BYTES, IMAGE_HOME, IMAGE_START};
use crate::image::{Image, NoImage, image_in};
use crate::image_seal::{SEAL_AT, SEAL_BYTES, image_room};
use crate::protocol::message::{UPDATE_BYTES, UpdateRefusal, UpdateState};

const _: () = assert!(UPDATE_BYTES.is_multiple_of(FLASH_WORD_BYTES));

/// An image in transfer.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct ImageTransfer {
    image: Image,
    /// Number of stored bytes.
    next: u32,
}

/// The place of the arrived image.
#[derive(Debug)]
pub struct UpdateStore<F> {
    place: F,
    /// Checksum of the running image.
    running: u32,
    transfer: Option<ImageTransfer>,
}

impl<F: NorFlash> UpdateStore<F> {
    /// A store that uses the whole of `place`, for a firmware whose image has the checksum `running`.
    pub fn new(place: F, running: u32) -> Self {
        Self {
            place,
            running,
            transfer: None,
        }
    }

    /// The result of the last update, and the checksum of its image.
    pub async fn state(&mut self) -> (UpdateState, u32) {
        match journal::read(&mut self.place).await {
            Some(order) => match self.state_of(&order) {
                UpdateState::None => (UpdateState::None, 0),
                state => (state, order.checksum),
            },
            None => (UpdateState::None, 0),
        }
    }

    /// The result of an order, as seen by the running image.
    fn state_of(&self, order: &InstallOrder) -> UpdateState {
        let (runs, before_runs) = (order.checksum == self.running, order.before == self.running);
        // The boot loader obeys the marks in this order.
        match order {
            // A probe has flashed another image since.
            _ if !runs && !before_runs => UpdateState::None,
            _ if order.confirmed => UpdateState::Confirmed,
            // A probe has flashed the image that was given up, or another image in between.
            _ if order.rolled_back && !before_runs => UpdateState::None,
            _ if order.closed && !order.rolled_back => UpdateState::None,
            _ if order.rolled_back && !order.tried => UpdateState::NotInstalled,
            // Rolled back even if the mark could not be written, because the previous image runs after a trial.
            _ if order.rolled_back || (order.tried && !runs) => UpdateState::RolledBack,
            _ if order.tried => UpdateState::OnTrial,
            _ => UpdateState::Ordered,
        }
    }

    /// Marks that the running image, which is on trial, came up.
    ///
    /// # Errors
    /// [`UpdateRefusal::NotBegun`]: the image that runs is not on trial. [`UpdateRefusal::FlashFailed`]: the next reset rolls
    /// the image back.
    pub async fn confirm(&mut self) -> Result<(), UpdateRefusal> {
        let order = journal::read(&mut self.place).await;
        let on_trial = order.filter(|order| self.state_of(order) == UpdateState::OnTrial);
        let order = on_trial.ok_or(UpdateRefusal::NotBegun)?;
        let added = journal::fill(&mut self.place, Mark::Confirmed, order.subject()).await;
        added.map_err(|_| UpdateRefusal::FlashFailed)
    }

    /// Checks whether this image can be for this board, before anything is erased.
    ///
    /// # Errors
    /// [`UpdateRefusal::WrongBoard`], [`UpdateRefusal::WrongSize`].
    pub fn fits(&self, image: &Image) -> Result<(), UpdateRefusal> {
        if image.board != BOARD {
            return Err(UpdateRefusal::WrongBoard { board: BOARD });
        }
        let max = image_room(self.place.capacity());
        if image.length > max || (image.length as usize) < SEAL_AT + SEAL_BYTES {
            return Err(UpdateRefusal::WrongSize { max });
        }
        Ok(())
    }

    /// Erases the place for an image that fits, and returns the position of its next piece. A transfer of the same image
    /// continues at its last position.
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
        // The journal at the end is erased first, because its marks are about an image that is now erased.
        let sector = F::ERASE_SIZE as u32;
        let sectors = self.place.capacity() as u32 / sector;
        for n in (0..sectors).rev() {
            let erased = self.place.erase(n * sector, (n + 1) * sector).await;
            erased.map_err(|_| UpdateRefusal::FlashFailed)?;
        }
        self.transfer = Some(ImageTransfer { image, next: 0 });
        Ok(0)
    }

    /// Stores the piece of the image that begins at `at`, and returns the position of the next piece.
    ///
    /// # Errors
    /// [`UpdateRefusal::NotBegun`], [`UpdateRefusal::OutOfOrder`], [`UpdateRefusal::FlashFailed`] (the transfer must then
    /// begin again).
    pub async fn write(&mut self, at: u32, piece: &[u8; UPDATE_BYTES]) -> Result<u32, UpdateRefusal> {
        let ImageTransfer { image, next } = self.transfer.ok_or(UpdateRefusal::NotBegun)?;
        if at != next || next >= image.length {
            return Err(UpdateRefusal::OutOfOrder { next });
        }
        let left = ((image.length - at) as usize).min(UPDATE_BYTES);
        let words = left.next_multiple_of(FLASH_WORD_BYTES);
        let bytes = piece.get(..words).ok_or(UpdateRefusal::FlashFailed)?;
        // A programmed word cannot be programmed again, so after a failure the place must be erased first.
        self.transfer = None;
        let written = self.place.write(at, bytes).await;
        written.map_err(|_| UpdateRefusal::FlashFailed)?;
        let next = at + left as u32;
        self.transfer = Some(ImageTransfer { image, next });
        Ok(next)
    }

    /// Compares the stored image with the announced image.
    ///
    /// # Errors
    /// [`UpdateRefusal::NotBegun`], also if pieces are missing; [`UpdateRefusal::WrongChecksum`], after which the
    /// transfer must begin again.
    pub async fn check(&mut self) -> Result<Image, UpdateRefusal> {
        let ImageTransfer { image, next } = self.transfer.ok_or(UpdateRefusal::NotBegun)?;
        if next < image.length {
            return Err(UpdateRefusal::NotBegun);
        }
        let room = image_room(self.place.capacity());
        let refusal = match image_in(&mut self.place, room, &IMAGE_HOME).await {
            Ok(stored) if stored == image => return Ok(image),
            Err(NoImage::WrongPlace) => UpdateRefusal::WrongPlace { start: IMAGE_START },
            Ok(_) | Err(NoImage::NotWhole) => UpdateRefusal::WrongChecksum,
        };
        self.transfer = None;
        Err(refusal)
    }

    /// Orders the installation of a checked image.
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
