//! The board's self-test at boot, with one log line per item. A failed item blocks arming until the next boot.

use model::supervise::codes::{Blocker, BlockerSet};

use super::image::{self, ImageState};
use super::ram;
use crate::board::part;

/// Runs the test. `break_works` is the result of the bridges' own test. Also returns the checksum in the image's
/// seal.
pub fn run(break_works: bool) -> (BlockerSet, u32) {
    let mut blockers = BlockerSet::EMPTY;
    let (image, checksum) = image::check();
    for (blocker, passed) in [
        (Blocker::BreakPath, break_works),
        (Blocker::BoardOptions, part::options_are_right()),
        (Blocker::PartRevision, part::revision_is_right()),
        (Blocker::Image, image != ImageState::Damaged),
        (Blocker::Unsealed, image != ImageState::Unsealed),
        (Blocker::Ram, ram::keeps_what_is_written()),
    ] {
        if passed {
            defmt::info!("self-test: {=str} passed", blocker.name());
        } else {
            blockers.insert(blocker);
            defmt::error!(
                "self-test: {=str}: {=str} {=str}",
                blocker.name(),
                blocker.meaning(),
                blocker.remedy()
            );
        }
    }
    (blockers, checksum)
}
