//! Marks of the journal after a power cut: torn marks, and the rest of a journal that was being erased.

use super::*;
use crate::update::journal::{self, Mark};

/// A torn mark does not count, and the journal still takes the next marks.
#[test]
fn a_torn_mark_is_no_mark() {
    let flash = Shared::new(ordered());
    let mut arrived = place(&flash, ARRIVED);
    let (image, _) = new();
    let before = block_on(journal::read(&mut arrived)).expect("it is ordered");
    assert!(before.is_of(&image) && !before.kept && !before.tried);
    let mut torn = flash.into_inner();
    torn.power = 0;
    let flash = Shared::new(torn);
    let mut arrived = place(&flash, ARRIVED);
    let mark = journal::add(
        &mut arrived,
        Mark::Confirmed,
        [image.length, image.checksum, old().0.checksum],
    );
    assert!(block_on(mark).is_err());
    let mut torn = flash.into_inner();
    torn.revive();
    let flash = Shared::new(torn);
    let mut arrived = place(&flash, ARRIVED);
    assert_eq!(block_on(journal::read(&mut arrived)), Some(before));
    let mark = journal::add(
        &mut arrived,
        Mark::Kept,
        [image.length, image.checksum, old().0.checksum],
    );
    assert_eq!(block_on(mark), Ok(()));
    assert!(block_on(journal::read(&mut arrived)).expect("still").kept);
}

/// However many marks are written, they lie behind the longest image.
#[test]
fn marks_lie_behind_the_longest_image() {
    let mut blank = ordered();
    let place_bytes = PLACE_PAGES * PAGE;
    let first = ARRIVED * PAGE;
    blank.bytes[first..first + place_bytes].fill(ERASED);
    let before = blank.bytes.clone();
    let shared = Shared::new(blank);
    assert_eq!(
        block_on(journal::fill(&mut place(&shared, ARRIVED), Mark::Closed, [1, 2, 3])),
        Ok(())
    );
    let after = shared.into_inner().bytes;
    let changed: Vec<usize> = (0..after.len()).filter(|at| after[*at] != before[*at]).collect();
    let journal = first + place_bytes - JOURNAL_BYTES as usize..first + place_bytes;
    assert!(changed.iter().all(|at| journal.contains(at)), "{changed:?}");
    assert!(changed.len() > JOURNAL_BYTES as usize / 2, "{}", changed.len());
    assert!(image_room(place_bytes) as usize <= place_bytes - JOURNAL_BYTES as usize);
}

/// A mark counts only once it reads back: a worn word is left behind, and the next word takes the mark.
#[test]
fn a_mark_in_a_worn_word_is_written_again() {
    let mut flash = ordered();
    let journal = (ARRIVED + PLACE_PAGES) * PAGE - JOURNAL_BYTES as usize;
    // The order is the journal's first word.
    flash.worn.push(journal / FLASH_WORD + 1);
    let shared = Shared::new(flash);
    let mut arrived = place(&shared, ARRIVED);
    let subject = block_on(journal::read(&mut arrived)).expect("it is ordered").subject();
    assert_eq!(block_on(journal::add(&mut arrived, Mark::Kept, subject)), Ok(()));
    assert!(block_on(journal::read(&mut arrived)).expect("still").kept);
}

/// The loader keeps the image, and nothing that lies behind it.
#[test]
fn only_the_image_is_kept() {
    let mut flash = ordered();
    let (_, image) = old();
    flash.bytes[image.len()..PAGE].fill(0x33);
    let flash = boot(flash).1;
    let kept = &flash.bytes[KEPT * PAGE..(KEPT + PLACE_PAGES) * PAGE];
    assert_eq!(kept[..image.len()], image[..]);
    assert!(kept[image.len()..].iter().all(|byte| *byte == ERASED));
}

/// The host announces the next image, and power fails while the store erases the journal. Whatever words are left, a confirmed image
/// stays, and so does an image to which the loader had rolled back.
#[test]
fn a_journal_that_is_half_erased_changes_nothing() {
    let tried = boot(ordered()).1;
    for (settled, (runs, _)) in [(confirm(tried.clone()), new()), (boot(tried).1, old())] {
        for seed in 0..1000 {
            for arrived_is_whole in [true, false] {
                let mut flash = settled.clone();
                flash.bytes[ARRIVED * PAGE + 5] ^= u8::from(!arrived_is_whole);
                flash.power = 0;
                flash.seed = seed;
                let shared = Shared::new(flash);
                let mut store = UpdateStore::new(place(&shared, ARRIVED), runs.checksum);
                assert!(block_on(store.begin(sealed(9, 2000).0)).is_err());
                let mut flash = shared.into_inner();
                flash.revive();
                for _ in 0..2 {
                    let (booted, after) = boot(flash);
                    let whole = whole(&after, RUNNING);
                    assert_eq!((booted, whole), (Boot::Image, Some(runs)), "seed {seed}");
                    flash = after;
                }
            }
        }
    }
}
