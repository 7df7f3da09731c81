//! Marks that a power cut has torn.

use super::*;
use crate::update::journal::{self, Mark};

/// Torn marks are no marks, and do not keep the next ones from being written.
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
