//! The boot loader's work: it inspects the three places, decides ([`super::plan`]) and copies until an
//! image can be booted.

use embedded_storage_async::nor_flash::NorFlash;

use super::journal::{self, InstallOrder, Mark};
use super::plan::{Found, LoaderStep, next};
use crate::drive_board::{FLASH_WORD_BYTES, IMAGE_HOME};
use crate::image::{Image, image_in};
use crate::image_seal::{ERASED, image_room};

/// The three places of an image.
#[derive(Debug)]
pub struct Places<F> {
    /// The place from which the board runs.
    pub running: F,
    /// The place in which the firmware stores an image from the link, with the journal behind the
    /// image.
    pub arrived: F,
    /// The place of the kept image, which ran before.
    pub kept: F,
}

/// The boot loader's result: what to boot.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Boot {
    /// The installed image.
    Image,
    /// A new image: until it confirms itself the next reset rolls it back.
    Trial,
    /// There is no intact image.
    Nothing,
}

/// Bytes that are copied at once.
const COPIED_PIECE: usize = 256;
const _: () = assert!(COPIED_PIECE.is_multiple_of(FLASH_WORD_BYTES));
/// Largest number of steps of one boot: twice the number that an update with failures at every place
/// needs.
const STEPS_MAX: u32 = 16;

/// Performs the steps that follow from the marks and the three places, and returns what to boot.
pub async fn prepare<F: NorFlash>(places: &mut Places<F>) -> Boot {
    let mut found = Found {
        running: whole(&mut places.running).await,
        order: journal::read(&mut places.arrived).await,
        ..Found::default()
    };
    // The usual boot: no update is pending, and the two other places need not be read.
    let settled = found.order.is_none_or(|order| order.confirmed || order.closed);
    if found.running.is_some() && settled {
        return Boot::Image;
    }
    found.arrived = whole(&mut places.arrived).await;
    found.kept = whole(&mut places.kept).await;
    for _ in 0..STEPS_MAX {
        match next(&found) {
            LoaderStep::Boot => return Boot::Image,
            LoaderStep::Stop => return Boot::Nothing,
            LoaderStep::Try => {
                if mark(places, &found, Mark::Tried).await {
                    return Boot::Trial;
                }
                // A trial without a mark would be repeated for ever.
                give_up(places, &mut found).await;
            }
            LoaderStep::Keep => {
                found.kept = copy(&mut places.running, &mut places.kept, found.running).await;
                if found.kept.is_none() {
                    give_up(places, &mut found).await;
                }
            }
            LoaderStep::MarkKept => {
                if mark(places, &found, Mark::Kept).await {
                    set(&mut found, |order| order.kept = true);
                } else {
                    give_up(places, &mut found).await;
                }
            }
            LoaderStep::Install => {
                found.running = copy(&mut places.arrived, &mut places.running, found.arrived).await;
                if found.running.is_none() {
                    // The flash does not keep the image. If the erasure was refused, the flash still
                    // contains the previous image; otherwise the loader can only try the kept image.
                    found.running = whole(&mut places.running).await;
                    give_up(places, &mut found).await;
                    set(&mut found, |order| order.confirmed = false);
                }
            }
            LoaderStep::GiveUp => give_up(places, &mut found).await,
            LoaderStep::Close => {
                if let Some(order) = found.order {
                    // Without the mark the next boot makes the same decision again.
                    let _ = journal::fill(&mut places.arrived, Mark::Closed, order.subject()).await;
                }
                return Boot::Image;
            }
            LoaderStep::Restore => {
                found.running = copy(&mut places.kept, &mut places.running, found.kept).await;
                if found.running.is_none() {
                    return Boot::Nothing;
                }
            }
        }
    }
    Boot::Nothing
}

async fn whole<F: NorFlash>(place: &mut F) -> Option<Image> {
    let room = image_room(place.capacity());
    image_in(place, room, &IMAGE_HOME).await.ok()
}

fn set(found: &mut Found, change: impl FnOnce(&mut InstallOrder)) {
    if let Some(order) = &mut found.order {
        change(order);
    }
}

/// Gives up the ordered image. If the mark cannot be written, the next boot makes the same decision
/// again.
async fn give_up<F: NorFlash>(places: &mut Places<F>, found: &mut Found) {
    mark(places, found, Mark::RolledBack).await;
    set(found, |order| order.rolled_back = true);
}

/// Adds a mark about the ordered image. Returns whether the mark was written.
async fn mark<F: NorFlash>(places: &mut Places<F>, found: &Found, mark: Mark) -> bool {
    let Some(order) = found.order else { return false };
    let added = journal::add(&mut places.arrived, mark, order.subject()).await;
    added.is_ok()
}

/// Copies an image to another place. Returns the copy if it equals the image.
async fn copy<F: NorFlash>(from: &mut F, to: &mut F, image: Option<Image>) -> Option<Image> {
    let image = image?;
    to.erase(0, to.capacity() as u32).await.ok()?;
    let mut piece = [ERASED; COPIED_PIECE];
    for at in (0..image.length).step_by(COPIED_PIECE) {
        let left = ((image.length - at) as usize).min(COPIED_PIECE);
        piece.fill(ERASED);
        from.read(at, piece.get_mut(..left)?).await.ok()?;
        let words = left.next_multiple_of(FLASH_WORD_BYTES);
        to.write(at, piece.get(..words)?).await.ok()?;
    }
    whole(to).await.filter(|copied| *copied == image)
}
