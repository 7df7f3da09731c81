//! Updates on a flash that loses power: whatever is cut, the loader boots a whole image, the old one or the new one.

use embassy_futures::block_on;
use embassy_sync::blocking_mutex::raw::NoopRawMutex;
use embassy_sync::mutex::Mutex;
use std::vec::Vec;

use super::UpdateStore;
use super::loader::{Boot, Places, prepare};
use crate::drive_board::{BOARD, IMAGE_HOME, IMAGE_START};
use crate::flash_region::FlashRegion;
use crate::image::{CHECKSUM, Image, image_in};
use crate::image_seal::{
    BOARD_AT, BUILD_AT, DTCM_START, ERASED, FLASH_START, JOURNAL_BYTES, MARKER, NUMBERS_AT, NUMBERS_BYTES, SEAL_AT,
    SEAL_BYTES, STACK_BYTES, VERSION_AT, image_room,
};
use crate::protocol::message::{UPDATE_BYTES, UpdateRefusal, UpdateState};
use crate::test_flash::{FLASH_WORD, PAGE, TestFlash};

mod marks;
mod unwanted;

/// Pages of a place, and the first pages of the three places. Behind them lies a page of the stores.
const PLACE_PAGES: usize = 2;
const RUNNING: usize = 0;
const ARRIVED: usize = PLACE_PAGES;
const KEPT: usize = 2 * PLACE_PAGES;
const STORES: usize = 3 * PLACE_PAGES;

/// The end of the programs' stack.
const STACK_END: u32 = DTCM_START + STACK_BYTES;

type Shared = Mutex<NoopRawMutex, TestFlash>;
type Region<'a> = FlashRegion<'a, NoopRawMutex, TestFlash>;

fn place(flash: &Shared, first: usize) -> Region<'_> {
    FlashRegion::new(flash, first, PLACE_PAGES)
}

/// A sealed image of this length; `fill` distinguishes one image from another.
fn sealed(fill: u8, length: usize) -> (Image, Vec<u8>) {
    starting([STACK_END, IMAGE_START + 0x441], fill, length)
}

/// A sealed image with these first two vectors.
fn starting(vectors: [u32; 2], fill: u8, length: usize) -> (Image, Vec<u8>) {
    let mut bytes: Vec<u8> = (0..length).map(|at| fill.wrapping_mul(at as u8 ^ 0x5A)).collect();
    for (to, vector) in bytes.chunks_exact_mut(4).zip(vectors) {
        to.copy_from_slice(&vector.to_le_bytes());
    }
    let seal = &mut bytes[SEAL_AT..SEAL_AT + SEAL_BYTES];
    seal.fill(0);
    for (to, part) in seal.chunks_exact_mut(4).zip(MARKER) {
        to.copy_from_slice(&part.to_le_bytes());
    }
    seal[NUMBERS_AT..NUMBERS_AT + NUMBERS_BYTES].fill(ERASED);
    seal[BUILD_AT..BUILD_AT + 4].fill(fill);
    seal[VERSION_AT] = fill;
    seal[BOARD_AT..BOARD_AT + 2].copy_from_slice(&BOARD.to_le_bytes());
    let checksum = CHECKSUM.checksum(&bytes);
    let numbers = [(length as u32).to_le_bytes(), checksum.to_le_bytes()].concat();
    bytes[SEAL_AT + NUMBERS_AT..][..NUMBERS_BYTES].copy_from_slice(&numbers);
    let image = Image {
        board: BOARD,
        length: length as u32,
        checksum,
        build: u32::from_le_bytes([fill; 4]),
        version: [u16::from(fill), 0, 0],
    };
    (image, bytes)
}

fn old() -> (Image, Vec<u8>) {
    sealed(3, 2100)
}

fn new() -> (Image, Vec<u8>) {
    sealed(7, 1900)
}

/// A board that runs the old image, with something in its stores.
fn board() -> TestFlash {
    let mut flash = TestFlash::with_pages(STORES + 1);
    flash.bytes[..old().1.len()].copy_from_slice(&old().1);
    flash.bytes[STORES * PAGE..].fill(0x5A);
    flash
}

fn pieces(bytes: &[u8]) -> impl Iterator<Item = (u32, [u8; UPDATE_BYTES])> + '_ {
    bytes.chunks(UPDATE_BYTES).enumerate().map(|(n, chunk)| {
        let mut piece = [ERASED; UPDATE_BYTES];
        piece[..chunk.len()].copy_from_slice(chunk);
        ((n * UPDATE_BYTES) as u32, piece)
    })
}

/// Stores and orders an image as the firmware does.
fn transfer(flash: &Shared, image: Image, bytes: &[u8]) -> Result<(), UpdateRefusal> {
    let mut store = UpdateStore::new(place(flash, ARRIVED), old().0.checksum);
    store.fits(&image)?;
    block_on(store.begin(image))?;
    for (at, piece) in pieces(bytes) {
        block_on(store.write(at, &piece))?;
    }
    let image = block_on(store.check())?;
    block_on(store.order(&image))
}

/// The flash of a board with the order to install the new image.
fn ordered() -> TestFlash {
    let flash = Shared::new(board());
    let (image, bytes) = new();
    assert_eq!(transfer(&flash, image, &bytes), Ok(()));
    flash.into_inner()
}

/// One boot, and the flash as the boot leaves it.
fn boot(flash: TestFlash) -> (Boot, TestFlash) {
    let shared = Shared::new(flash);
    let booted = block_on(prepare(&mut Places {
        running: place(&shared, RUNNING),
        arrived: place(&shared, ARRIVED),
        kept: place(&shared, KEPT),
    }));
    let flash = shared.into_inner();
    assert!(
        flash.bytes[STORES * PAGE..].iter().all(|byte| *byte == 0x5A),
        "the boot changes the stores"
    );
    (booted, flash)
}

/// The whole image in a place, if there is one.
fn whole(flash: &TestFlash, first: usize) -> Option<Image> {
    let shared = Shared::new(flash.clone());
    let mut place = place(&shared, first);
    block_on(image_in(&mut place, image_room(PLACE_PAGES * PAGE), &IMAGE_HOME)).ok()
}

fn confirm(flash: TestFlash) -> TestFlash {
    let shared = Shared::new(flash);
    let mut store = UpdateStore::new(place(&shared, ARRIVED), new().0.checksum);
    assert_eq!(block_on(store.state()).0, UpdateState::OnTrial);
    assert_eq!(block_on(store.confirm()), Ok(()));
    assert_eq!(block_on(store.state()), (UpdateState::Confirmed, new().0.checksum));
    shared.into_inner()
}

#[test]
fn an_ordered_image_is_booted_on_trial_and_stays_once_it_is_confirmed() {
    let (booted, flash) = boot(ordered());
    assert_eq!(booted, Boot::Trial);
    assert_eq!(whole(&flash, RUNNING), Some(new().0));
    assert_eq!(whole(&flash, KEPT), Some(old().0));
    let flash = confirm(flash);
    for _ in 0..2 {
        let (booted, flash) = boot(flash.clone());
        assert_eq!(booted, Boot::Image);
        assert_eq!(whole(&flash, RUNNING), Some(new().0));
    }
}

#[test]
fn an_image_that_does_not_confirm_itself_is_rolled_back_once() {
    let (_, flash) = boot(ordered());
    let (booted, flash) = boot(flash);
    assert_eq!(booted, Boot::Image);
    assert_eq!(whole(&flash, RUNNING), Some(old().0));
    let shared = Shared::new(flash);
    let mut store = UpdateStore::new(place(&shared, ARRIVED), old().0.checksum);
    assert_eq!(block_on(store.state()), (UpdateState::RolledBack, new().0.checksum));
    let before = shared.into_inner();
    let (booted, after) = boot(before.clone());
    assert_eq!(booted, Boot::Image);
    assert!(
        after.bytes == before.bytes,
        "a boot after the roll-back writes to the flash"
    );
    // The same image can be tried again.
    let shared = Shared::new(after);
    assert_eq!(transfer(&shared, new().0, &new().1), Ok(()));
    assert_eq!(boot(shared.into_inner()).0, Boot::Trial);
}

/// Power is cut at every word and every page of the installation and of the roll-back, and once more in the next boot. The boots
/// after that recover.
#[test]
fn power_cuts_while_an_image_is_installed_or_rolled_back() {
    let tried = boot(ordered()).1;
    for (start, end) in [(ordered(), new().0), (tried, old().0)] {
        let mut cuts = 0;
        loop {
            let mut flash = start.clone();
            flash.power = cuts;
            let mut flash = boot(flash).1;
            if flash.power > 0 {
                break;
            }
            flash.revive();
            // A second cut, in the boot that continues after the first.
            flash.power = cuts / 2;
            let mut flash = boot(flash).1;
            flash.revive();
            assert!(
                [RUNNING, ARRIVED, KEPT]
                    .into_iter()
                    .any(|at| whole(&flash, at).is_some()),
                "after {cuts}"
            );
            let (booted, flash) = boot(flash);
            let running = whole(&flash, RUNNING);
            assert_ne!(booted, Boot::Nothing, "after {cuts}");
            assert!(running == Some(old().0) || running == Some(new().0), "after {cuts}");
            // A trial that was cut may already be over. A roll-back never ends in the new image.
            let settled = running == Some(end) || running == Some(old().0);
            assert!(settled, "after {cuts}");
            cuts += 1;
        }
        assert!(cuts > 60, "{cuts}");
    }
}

/// After a cut of the installation the next boot completes the installation.
#[test]
fn an_installation_that_is_cut_goes_on() {
    let mut installed = 0;
    for cuts in 0..1000 {
        let mut flash = ordered();
        flash.power = cuts;
        let (booted, mut flash) = boot(flash);
        if booted == Boot::Trial {
            assert!(cuts > 60);
            break;
        }
        flash.revive();
        let (booted, flash) = boot(flash);
        assert_eq!(booted, Boot::Trial, "after {cuts}");
        assert_eq!(whole(&flash, RUNNING), Some(new().0));
        installed += 1;
    }
    assert!(installed > 60, "{installed}");
}

#[test]
fn power_cuts_while_an_image_is_stored_leave_the_old_one() {
    for cuts in 0..1000 {
        let mut flash = board();
        flash.power = cuts;
        let shared = Shared::new(flash);
        let done = transfer(&shared, new().0, &new().1);
        let mut flash = shared.into_inner();
        flash.revive();
        if done.is_ok() {
            assert!(cuts > 60, "{cuts}");
            return;
        }
        let (booted, flash) = boot(flash);
        assert_eq!(
            (booted, whole(&flash, RUNNING)),
            (Boot::Image, Some(old().0)),
            "after {cuts}"
        );
    }
    panic!("no transfer came to its end");
}

/// Whatever the journal contains (nothing, zeros, noise, unreadable words), the loader boots a whole image.
#[test]
fn a_corrupt_journal_never_bricks() {
    let journal = (ARRIVED + PLACE_PAGES) * PAGE - JOURNAL_BYTES as usize..(ARRIVED + PLACE_PAGES) * PAGE;
    let tried = boot(ordered()).1;
    // During the installation of the new image only the kept image is whole.
    let mut half = tried.clone();
    half.bytes[..PAGE].fill(0);
    for start in [ordered(), tried, half] {
        for kind in 0..5 {
            let mut flash = start.clone();
            match kind {
                0 => flash.bytes[journal.clone()].fill(0),
                1 => flash.bytes[journal.clone()].fill(ERASED),
                2 => {
                    let mut state = 1_u32;
                    for byte in &mut flash.bytes[journal.clone()] {
                        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                        *byte = (state >> 24) as u8;
                    }
                }
                3 => flash.damaged[journal.start / FLASH_WORD..journal.end / FLASH_WORD].fill(true),
                _ => flash.damaged[journal.start / FLASH_WORD] = true,
            }
            let (booted, flash) = boot(flash);
            assert_ne!(booted, Boot::Nothing, "{kind}");
            assert!(whole(&flash, RUNNING).is_some(), "{kind}");
        }
    }
}

#[test]
fn an_image_whose_copy_in_the_flash_has_changed_is_not_installed() {
    for at in [0, SEAL_AT + BOARD_AT, new().1.len() - 1] {
        let mut flash = ordered();
        flash.bytes[ARRIVED * PAGE + at] ^= 1;
        let (booted, flash) = boot(flash);
        assert_eq!(booted, Boot::Image);
        assert_eq!(whole(&flash, RUNNING), Some(old().0));
    }
}

#[test]
fn an_unsealed_image_is_never_booted() {
    let mut flash = board();
    flash.bytes[SEAL_AT + NUMBERS_AT..][..NUMBERS_BYTES].fill(ERASED);
    assert_eq!(boot(flash).0, Boot::Nothing);
    // The kept image replaces a damaged image.
    let mut flash = confirm(boot(ordered()).1);
    flash.bytes[5] ^= 1;
    flash.bytes[ARRIVED * PAGE + 5] ^= 1;
    let (booted, flash) = boot(flash);
    assert_eq!((booted, whole(&flash, RUNNING)), (Boot::Image, Some(old().0)));
}

#[test]
fn what_does_not_fit_is_refused_before_anything_is_erased() {
    let flash = Shared::new(ordered());
    let (image, bytes) = new();
    let max = image_room(PLACE_PAGES * PAGE);
    let foreign = Image {
        board: BOARD + 1,
        ..image
    };
    assert_eq!(
        transfer(&flash, foreign, &bytes),
        Err(UpdateRefusal::WrongBoard { board: BOARD })
    );
    for length in [max + 1, 0, (SEAL_AT + SEAL_BYTES) as u32 - 1, u32::MAX] {
        let other = Image { length, ..image };
        assert_eq!(transfer(&flash, other, &bytes), Err(UpdateRefusal::WrongSize { max }));
    }
    assert!(flash.into_inner().bytes == ordered().bytes);
}

#[test]
fn what_is_not_the_announced_image_is_not_ordered() {
    let (image, bytes) = new();
    let mut damaged = bytes.clone();
    damaged[1000] ^= 1;
    let announced_wrong = Image {
        checksum: !image.checksum,
        ..image
    };
    let other_build = Image { build: 1, ..image };
    for (announced, sent) in [(image, &damaged), (announced_wrong, &bytes), (other_build, &bytes)] {
        let flash = Shared::new(board());
        assert_eq!(transfer(&flash, announced, sent), Err(UpdateRefusal::WrongChecksum));
        let (booted, flash) = boot(flash.into_inner());
        assert_eq!((booted, whole(&flash, RUNNING)), (Boot::Image, Some(old().0)));
    }
}

#[test]
fn pieces_come_in_order_and_a_transfer_goes_on_where_it_stood() {
    let flash = Shared::new(board());
    let (image, bytes) = new();
    let mut store = UpdateStore::new(place(&flash, ARRIVED), old().0.checksum);
    let sent: Vec<_> = pieces(&bytes).collect();
    assert_eq!(block_on(store.write(0, &sent[0].1)), Err(UpdateRefusal::NotBegun));
    assert_eq!(block_on(store.begin(image)), Ok(0));
    let next = UPDATE_BYTES as u32;
    assert_eq!(
        block_on(store.write(next, &sent[1].1)),
        Err(UpdateRefusal::OutOfOrder { next: 0 })
    );
    assert_eq!(block_on(store.write(0, &sent[0].1)), Ok(next));
    assert_eq!(
        block_on(store.write(0, &sent[0].1)),
        Err(UpdateRefusal::OutOfOrder { next })
    );
    assert_eq!(
        block_on(store.check()),
        Err(UpdateRefusal::NotBegun),
        "pieces are missing"
    );
    assert_eq!(
        block_on(store.begin(image)),
        Ok(next),
        "the transfer of the same image does not resume"
    );
    let other = old().0;
    assert_eq!(
        block_on(store.begin(other)),
        Ok(0),
        "the transfer of another image does not begin anew"
    );
}
