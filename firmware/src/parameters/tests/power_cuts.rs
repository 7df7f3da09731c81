//! Power that fails while a set is stored.

use super::super::{BootOutcome, Disbelief};
use super::{booted, built_in, gain, history, load, now, store, stored, vehicle};
use crate::test_flash::TestFlash;

/// The flash after a store of `kp` whose power lasts for `power` steps, and whether the store reported success.
fn cut(mut before: TestFlash, kp: f32, power: usize) -> (TestFlash, bool) {
    before.power = power;
    let mut cut_store = store(before);
    let finished = now(cut_store.store(&vehicle(kp))).is_ok();
    let mut flash = cut_store.flash.0;
    flash.revive();
    (flash, finished)
}

#[test]
fn a_power_cut_at_any_step_leaves_the_old_set_or_the_new() {
    let mut cuts = 0;
    let (mut old_kept, mut new_kept) = (0, 0);
    for damage_on_cut in [true, false] {
        // Numbers of stores up to the change of pages, where the store moves, and beyond.
        for stores_before in 1..14 {
            let mut before = history(stores_before);
            before.damage_on_cut = damage_on_cut;
            let (old, new) = (booted(gain(stores_before - 1)), booted(0.7));
            for power in 0.. {
                let (flash, finished) = cut(before.clone(), 0.7, power);
                let found = load(flash.clone());
                assert!(
                    found == old || found == new,
                    "cut after {power} steps: {:?}",
                    found.outcome
                );
                assert!(
                    !finished || found == new,
                    "a set that the board reports as stored is stored"
                );
                old_kept += u32::from(found == old);
                new_kept += u32::from(found == new);
                // The next store works, too.
                assert_eq!(load(stored(flash, 0.33)), booted(0.33), "after a cut at {power}");
                if finished {
                    break;
                }
                cuts += 1;
            }
        }
    }
    assert!(cuts >= 50, "{cuts} cuts");
    assert!(
        old_kept > 20 && new_kept > 20,
        "too few cuts of either kind: {old_kept}, {new_kept}"
    );
}

/// Before the first store there is no old set: a boot must not take the half-stored set.
#[test]
fn a_power_cut_in_the_first_store_leaves_the_built_in_set_or_the_new() {
    let mut untouched = 0;
    for damage_on_cut in [true, false] {
        for power in 0.. {
            let mut before = TestFlash::new();
            before.damage_on_cut = damage_on_cut;
            let (flash, finished) = cut(before, 0.7, power);
            let found = load(flash.clone());
            match found.outcome {
                BootOutcome::Stored => assert_eq!(found, booted(0.7)),
                BootOutcome::NothingStored | BootOutcome::NotBelieved(Disbelief::Unreadable) => {
                    assert!(!finished, "a set that the board reports as stored is stored");
                    assert_eq!(found.vehicle, built_in());
                    untouched += 1;
                }
                other => panic!("{other:?}"),
            }
            assert_eq!(load(stored(flash, 0.33)), booted(0.33), "after a cut at {power}");
            if finished {
                break;
            }
        }
    }
    assert!(untouched > 10, "{untouched}");
}
