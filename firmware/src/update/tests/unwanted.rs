//! Orders that the boot loader must not carry out: a probe has flashed another image since, or the flash refuses.

use super::*;

/// The loader boots an image that a probe has flashed since: it neither carries out an order of the previous image nor rolls back.
#[test]
fn an_image_from_a_probe_is_booted() {
    let (image, bytes) = sealed(9, 2000);
    for start in [ordered(), boot(ordered()).1] {
        let mut flash = start;
        flash.bytes[..bytes.len()].copy_from_slice(&bytes);
        let (booted, flash) = boot(flash);
        assert_eq!((booted, whole(&flash, RUNNING)), (Boot::Image, Some(image)));
        // The flashed image is not on trial and has nothing to confirm.
        let shared = Shared::new(flash);
        let mut store = UpdateStore::new(place(&shared, ARRIVED), image.checksum);
        assert_eq!(block_on(store.state()), (UpdateState::None, 0));
    }
}

/// The flash refuses to erase the sectors of the running image or those that keep the previous image. The loader still boots the
/// image that ran, and the board answers that the new image was not installed.
#[test]
fn an_image_that_the_flash_refuses_leaves_the_one_that_runs() {
    for refusing in [RUNNING, KEPT] {
        let mut flash = ordered();
        flash.protected = refusing * PAGE..(refusing + PLACE_PAGES) * PAGE;
        for _ in 0..3 {
            let (booted, after) = boot(flash);
            assert_eq!((booted, whole(&after, RUNNING)), (Boot::Image, Some(old().0)));
            flash = after;
        }
        let shared = Shared::new(flash);
        let mut store = UpdateStore::new(place(&shared, ARRIVED), old().0.checksum);
        assert_eq!(block_on(store.state()), (UpdateState::NotInstalled, new().0.checksum));
    }
}

/// A probe flashes an image that the loader had given up, or that was on trial before the probe flashed another: the loader boots
/// this image, whatever it had decided about it before.
#[test]
fn an_image_that_was_given_up_is_booted_when_a_probe_flashes_it() {
    let flashed = |mut flash: TestFlash, (image, bytes): (Image, Vec<u8>)| {
        flash.bytes[..bytes.len()].copy_from_slice(&bytes);
        for _ in 0..2 {
            let (booted, after) = boot(flash);
            assert_eq!((booted, whole(&after, RUNNING)), (Boot::Image, Some(image)));
            flash = after;
        }
        let shared = Shared::new(flash);
        let mut store = UpdateStore::new(place(&shared, ARRIVED), image.checksum);
        assert_eq!(block_on(store.state()), (UpdateState::None, 0));
        shared.into_inner()
    };
    let tried = boot(ordered()).1;
    flashed(boot(tried.clone()).1, new());
    let mut refused = ordered();
    refused.bytes[ARRIVED * PAGE + 5] ^= 1;
    flashed(boot(refused).1, new());
    let another = sealed(9, 2000);
    flashed(flashed(tried, another.clone()), new());
    // The loader does not carry out an order, either, when a probe flashes the image that gave it again.
    flashed(flashed(ordered(), another), old());
}

/// The flash takes no further mark: the loader boots the previous image again, and that image knows that it is not on trial.
#[test]
fn the_image_before_is_never_on_trial() {
    let mut flash = boot(ordered()).1;
    let end = (ARRIVED + PLACE_PAGES) * PAGE;
    let journal = (end - JOURNAL_BYTES as usize) / FLASH_WORD..end / FLASH_WORD;
    flash.worn = journal.collect();
    for _ in 0..2 {
        let (booted, after) = boot(flash);
        assert_eq!((booted, whole(&after, RUNNING)), (Boot::Image, Some(old().0)));
        let shared = Shared::new(after);
        let mut store = UpdateStore::new(place(&shared, ARRIVED), old().0.checksum);
        assert_eq!(block_on(store.state()), (UpdateState::RolledBack, new().0.checksum));
        assert_eq!(block_on(store.confirm()), Err(UpdateRefusal::NotBegun));
        flash = shared.into_inner();
    }
}

/// The board does not order, and the loader does not boot, a whole image for this board that is linked for another place or whose
/// vectors are invalid.
#[test]
fn an_image_that_the_part_could_not_start_is_refused() {
    let code = IMAGE_START + 0x441;
    for vectors in [
        [STACK_END, FLASH_START + 0x441],
        [STACK_END, IMAGE_START - 1],
        [STACK_END, IMAGE_START + 2001],
        [STACK_END, code - 1],
        [0, code],
        [STACK_END - 4, code],
        [0x2000_0000, code],
        [0x2002_0008, code],
        [u32::MAX, code],
    ] {
        let (image, bytes) = starting(vectors, 9, 2000);
        let flash = Shared::new(board());
        let refused = UpdateRefusal::WrongPlace { start: IMAGE_START };
        assert_eq!(transfer(&flash, image, &bytes), Err(refused), "{vectors:x?}");
        let (booted, mut flash) = boot(flash.into_inner());
        assert_eq!((booted, whole(&flash, RUNNING)), (Boot::Image, Some(old().0)));
        flash.bytes[..bytes.len()].copy_from_slice(&bytes);
        assert_eq!(boot(flash).0, Boot::Nothing, "{vectors:x?}");
    }
}
