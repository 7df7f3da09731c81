//! The fault history on a flash that loses power, corrupts words, and refuses what a real NOR flash refuses.

use std::vec::Vec;

use embassy_futures::block_on;
use model::supervise::arming::Mode;
use proptest::prelude::*;

use super::FaultStore;
use super::store::WORD;
use crate::fault_list::{FAULTS_KEPT, FaultEntry};
use crate::test_flash::{PAGE, PAGES, TestFlash};

/// Faults that a sector holds.
const SECTOR: u32 = (PAGE / WORD) as u32;

fn entry(number: u32) -> FaultEntry {
    FaultEntry {
        number,
        boot: u32::MAX - number,
        time_us: u64::MAX - u64::from(number),
        mode: Mode::Stopping,
        fault: (number % 17) as u8,
    }
}

fn store(flash: TestFlash) -> FaultStore<TestFlash> {
    FaultStore::new(flash).expect("large enough")
}

fn load(flash: &TestFlash) -> Vec<FaultEntry> {
    block_on(store(flash.clone()).load()).to_vec()
}

/// The flash after a boot that stored one fault.
fn stored(flash: TestFlash, number: u32) -> TestFlash {
    let mut store = store(flash);
    block_on(store.store(&entry(number))).expect("stores");
    store.flash
}

/// A flash to which `count` faults were stored in one boot.
fn history(count: u32) -> TestFlash {
    let mut store = store(TestFlash::new());
    for number in 0..count {
        block_on(store.store(&entry(number))).expect("stores");
    }
    store.flash
}

/// The faults that the store keeps of `count`: the last ones.
fn last_of(count: u32) -> Vec<FaultEntry> {
    (count.saturating_sub(FAULTS_KEPT as u32)..count).map(entry).collect()
}

#[test]
fn the_last_faults_come_back_in_order() {
    let mut flash = TestFlash::new();
    assert_eq!(load(&flash), []);
    // Through both sectors and back to the first one.
    for count in 1..3 * SECTOR {
        flash = stored(flash, count - 1);
        assert_eq!(load(&flash), last_of(count), "after {count}");
    }
}

#[test]
fn a_power_cut_at_any_step_loses_no_fault_but_the_one_being_written() {
    let mut cuts = 0;
    for damage_on_cut in [true, false] {
        // At the start, within a sector, from sector to sector, and from the last sector to the first.
        for before in [0, 1, 40, SECTOR - 1, SECTOR, SECTOR + 1, 2 * SECTOR, 3 * SECTOR] {
            for power in 0.. {
                let mut flash = history(before);
                flash.damage_on_cut = damage_on_cut;
                flash.power = power;
                let mut cut = store(flash);
                let finished = block_on(cut.store(&entry(before))).is_ok();
                let mut flash = cut.flash;
                flash.revive();
                let found = load(&flash);
                let kept = if finished { before + 1 } else { before };
                assert_eq!(found, last_of(kept), "{before} before, cut after {power} steps");
                // The store goes on after the cut.
                let again = load(&stored(flash, before + 1));
                assert_eq!(again.last(), Some(&entry(before + 1)));
                assert!(
                    found
                        .iter()
                        .rev()
                        .take(FAULTS_KEPT - 1)
                        .all(|kept| again.contains(kept))
                );
                if finished {
                    break;
                }
                cuts += 1;
            }
        }
    }
    assert!(cuts >= 20, "{cuts} cuts");
}

#[test]
fn a_word_that_does_not_take_a_fault_is_left_behind() {
    for before in [0, 7, SECTOR - 2] {
        let mut flash = history(before);
        // One word that cannot be read, and one that reads as erased and takes no write.
        flash.damaged[before as usize] = true;
        flash.worn.push(before as usize + 1);
        let found = load(&stored(flash, before));
        assert_eq!(found, last_of(before + 1));
    }
}

#[test]
fn a_flash_that_fails_altogether_says_so_and_ends() {
    let mut flash = history(3);
    flash.power = 0;
    let mut store = store(flash);
    for _ in 0..3 {
        assert!(block_on(store.store(&entry(3))).is_err());
    }
}

#[test]
fn a_flash_that_is_too_small_is_given_back() {
    let mut flash = TestFlash::new();
    flash.bytes.truncate(PAGE);
    assert!(FaultStore::new(flash).is_err());
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    /// From random contents and unreadable words the store loads no fault and never panics, and it keeps the next faults.
    #[test]
    fn a_flash_full_of_anything_takes_the_next_fault(
        seed in proptest::collection::vec(any::<u8>(), 64),
        damaged in any::<u64>(),
    ) {
        let mut flash = TestFlash::new();
        for (i, byte) in flash.bytes.iter_mut().enumerate() {
            *byte = seed[i % 64].wrapping_mul((i / 64) as u8 | 1).wrapping_add(seed[(i / 64) % 64]);
        }
        for (i, d) in flash.damaged.iter_mut().enumerate() {
            *d = damaged >> (i % 64) & 1 == 1;
        }
        prop_assert_eq!(load(&flash), []);
        flash = stored(stored(flash, 0), 1);
        prop_assert_eq!(load(&flash), [entry(0), entry(1)]);
    }

    /// Unreadable words and flipped bits destroy the faults that they hit, and no others.
    #[test]
    fn damage_takes_what_it_hits(
        count in 1_u32..3 * SECTOR,
        unreadable in proptest::collection::vec(0..PAGE * PAGES / WORD, 0..6),
        flipped in proptest::collection::vec(0..PAGE * PAGES * 8, 0..6),
    ) {
        let mut flash = history(count);
        let hit: Vec<u32> = unreadable.iter().copied().chain(flipped.iter().map(|bit| bit / 8 / WORD))
            .map(|word| word as u32 % (2 * SECTOR)).collect();
        for word in &unreadable {
            flash.damaged[*word] = true;
        }
        let mut flipped = flipped;
        flipped.sort_unstable();
        flipped.dedup();
        for bit in &flipped {
            flash.bytes[bit / 8] ^= 1 << (bit % 8);
        }
        let found = load(&flash);
        for entry in last_of(count) {
            if !hit.contains(&(entry.number % (2 * SECTOR))) {
                prop_assert!(found.contains(&entry), "{}", entry.number);
            }
        }
        prop_assert!(found.iter().all(|found| *found == entry(found.number) && found.number < count));
        prop_assert!(found.windows(2).all(|pair| pair[0].number < pair[1].number));
        flash.damage_on_rewrite = true;
        let again = load(&stored(flash, count));
        prop_assert_eq!(again.last(), Some(&entry(count)));
    }
}
