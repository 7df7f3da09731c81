//! Orders that are not carried out: a probe has flashed another image since, or the flash refuses.

use super::*;

/// An image that a probe has flashed since is booted: no order of the image before is carried out on it, and none is rolled
/// back.
#[test]
fn an_image_from_a_probe_is_booted() {
    let (image, bytes) = sealed(9, 2000);
    for start in [ordered(), boot(ordered()).1] {
        let mut flash = start;
        flash.bytes[..bytes.len()].copy_from_slice(&bytes);
        let (booted, flash) = boot(flash);
        assert_eq!((booted, whole(&flash, RUNNING)), (Boot::Image, Some(image)));
        // And it is not what is on trial: there is nothing for it to confirm.
        let shared = Shared::new(flash);
        let mut store = UpdateStore::new(place(&shared, ARRIVED), image.checksum);
        assert_eq!(block_on(store.state()), (UpdateState::None, 0));
    }
}

/// Sectors that refuse to be erased, the ones that the board runs from or the ones that keep the image before: the image that
/// ran is booted on, and whoever asks is told that the new one never was.
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
