//! Flash images with damaged words, flipped bits, lost pages and noise: a boot takes the newest set or says why not.

use std::vec::Vec;

use proptest::prelude::*;

use super::super::{BootOutcome, Booted, Disbelief};
use super::{booted, built_in, gain, history, load, now, store, stored, vehicle};
use crate::image::CHECKSUM;
use crate::test_flash::{FLASH_WORD, PAGE, PAGES, TestFlash};

/// A boot with the built-in set because the stored set cannot be read.
fn unreadable() -> Booted {
    Booted {
        vehicle: built_in(),
        outcome: BootOutcome::NotBelieved(Disbelief::Unreadable),
    }
}

/// Stores a gain on a flash in any state, where the store may have to program a word twice, and asserts that the store reports
/// success if and only if the next boot takes that set.
fn storing_tells_the_truth(mut flash: TestFlash) {
    flash.damage_on_rewrite = true;
    let mut store = store(flash);
    let told = now(store.store(&vehicle(0.9)));
    let found = load(store.flash.0);
    assert_eq!(told.is_ok(), found == booted(0.9), "{told:?}, {:?}", found.outcome);
}

/// One unreadable word anywhere: a boot never mistakes an older set for the newest.
#[test]
fn one_unreadable_word_never_boots_an_older_set() {
    let (mut newest, mut none) = (0, 0);
    // Stores within one page, at the move to the other page, and beyond.
    for stores in [1, 2, 4, 5, 6, 9] {
        let flash = history(stores);
        for word in 0..flash.damaged.len() {
            let mut damaged = flash.clone();
            damaged.damaged[word] = true;
            let found = load(damaged.clone());
            if found == booted(gain(stores - 1)) {
                newest += 1;
            } else {
                assert_eq!(found, unreadable(), "word {word} after {stores} stores");
                none += 1;
            }
            storing_tells_the_truth(damaged);
        }
    }
    assert!(
        newest > 1000 && none > 100,
        "{newest} times the newest, {none} times none"
    );
}

/// A page that was erased or cannot be read may lose the newest set; a boot takes no older set instead.
#[test]
fn a_lost_page_never_boots_an_older_set() {
    for stores in 1..30 {
        for page in 0..PAGES {
            for unreadable_page in [true, false] {
                let mut flash = history(stores);
                if unreadable_page {
                    flash.damaged[page * PAGE / FLASH_WORD..(page + 1) * PAGE / FLASH_WORD].fill(true);
                } else {
                    flash.bytes[page * PAGE..(page + 1) * PAGE].fill(0xFF);
                }
                let found = load(flash.clone());
                let lost = Booted {
                    vehicle: built_in(),
                    outcome: BootOutcome::NothingStored,
                };
                assert!(
                    found == booted(gain(stores - 1)) || found == unreadable() || (found == lost && !unreadable_page),
                    "page {page} after {stores} stores: {:?}",
                    found.outcome
                );
                storing_tells_the_truth(flash);
            }
        }
    }
}

/// If a word of the flash does not take the written bytes, the store does not report the set as stored.
#[test]
fn a_word_that_is_not_fresh_is_not_told_stored() {
    for stores in [0, 1, 4, 5] {
        let flash = history(stores);
        for word in 0..flash.damaged.len() {
            let mut stuck = flash.clone();
            // A bit that was lost in an erased word.
            if stuck.bytes[word * FLASH_WORD..(word + 1) * FLASH_WORD]
                .iter()
                .all(|byte| *byte == 0xFF)
            {
                stuck.bytes[word * FLASH_WORD + 20] = 0xFE;
            }
            storing_tells_the_truth(stuck);
        }
    }
}

/// A word decays at any moment while the store writes the set and its receipts: the store reports a set as stored only if the set
/// is there.
#[test]
fn a_word_that_is_lost_while_another_is_written_is_not_told_stored() {
    // A set in the middle of a page, and a set whose receipts move the store to the other page.
    for stores in [0, 1, 3, 4] {
        let before = history(stores);
        let after = stored(before.clone(), 0.9);
        let words = (0..before.damaged.len()).filter(|word| {
            let range = word * FLASH_WORD..(word + 1) * FLASH_WORD;
            before.bytes[range.clone()] != after.bytes[range]
        });
        let written: Vec<usize> = words.collect();
        assert!(written.len() > 10, "{}", written.len());
        for (place, word) in written.iter().enumerate().step_by(3) {
            for moment in (place..written.len()).step_by(2) {
                let mut flash = before.clone();
                flash.decays = Some((moment, *word));
                storing_tells_the_truth(flash);
            }
        }
    }
}

/// A receipt counts by its own checksum and its key: bytes that only look like a receipt hide no set.
#[test]
fn what_only_looks_like_a_receipt_is_none() {
    let receipt = |sequence: u32, sound: bool| {
        let mut bytes = b"RCPT".to_vec();
        bytes.extend(sequence.to_le_bytes());
        bytes.extend(0x1234_5678_u32.to_le_bytes());
        let checksum = CHECKSUM.checksum(&bytes) ^ u32::from(!sound);
        bytes.extend(checksum.to_le_bytes());
        bytes
    };
    for (key, sound, believed) in [(4, true, true), (4, false, false), (5, false, false), (9, true, false)] {
        let mut store = store(history(2));
        now(store.put(key, &receipt(7, sound)));
        let found = load(store.flash.0);
        // A true receipt of a missing set hides the older set.
        let expected = if believed { unreadable() } else { booted(gain(1)) };
        assert_eq!(found, expected, "key {key}, sound {sound}");
    }
}

/// Damage to a flash that holds a history of sets.
#[derive(Debug, Clone)]
enum Damage {
    Unreadable(usize),
    Flipped(usize),
    Erased(usize),
    Noise(usize, u8),
}

fn damage() -> impl Strategy<Value = Damage> {
    let word = 0..PAGE * PAGES / FLASH_WORD;
    prop_oneof![
        word.clone().prop_map(Damage::Unreadable),
        (0..PAGE * PAGES * 8).prop_map(Damage::Flipped),
        word.clone().prop_map(Damage::Erased),
        (word, any::<u8>()).prop_map(|(word, noise)| Damage::Noise(word, noise)),
    ]
}

fn apply(flash: &mut TestFlash, damage: &Damage) {
    match *damage {
        Damage::Unreadable(word) => flash.damaged[word] = true,
        Damage::Flipped(bit) => flash.bytes[bit / 8] ^= 1 << (bit % 8),
        Damage::Erased(word) => flash.bytes[word * FLASH_WORD..(word + 1) * FLASH_WORD].fill(0xFF),
        Damage::Noise(word, noise) => {
            for (place, byte) in flash.bytes[word * FLASH_WORD..(word + 1) * FLASH_WORD]
                .iter_mut()
                .enumerate()
            {
                *byte = noise.wrapping_mul(place as u8 | 1).wrapping_add(noise >> 3);
            }
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(if cfg!(debug_assertions) { 192 } else { 4000 }))]

    /// Any damage: a boot takes a set that was stored, or the built-in one, and never panics; the next store reports
    /// the truth.
    #[test]
    fn damage_never_boots_what_was_not_stored(
        stores in 0_u32..14,
        damages in proptest::collection::vec(damage(), 1..12),
    ) {
        let mut flash = history(stores);
        for damage in &damages {
            apply(&mut flash, damage);
        }
        let found = load(flash.clone());
        match found.outcome {
            BootOutcome::Stored => {
                let gains: Vec<Booted> = (0..stores).map(|k| booted(gain(k))).collect();
                prop_assert!(gains.contains(&found));
            }
            BootOutcome::NothingStored | BootOutcome::NotBelieved(Disbelief::Unreadable) => {
                prop_assert_eq!(found.vehicle, built_in());
            }
            other => prop_assert!(false, "{:?}", other),
        }
        storing_tells_the_truth(flash);
    }

    /// After one flipped bit, erased word or word of noise a boot takes the newest set or none.
    #[test]
    fn one_damage_never_boots_an_older_set(stores in 1_u32..14, damage in damage()) {
        let mut flash = history(stores);
        apply(&mut flash, &damage);
        let found = load(flash);
        prop_assert!(found == booted(gain(stores - 1)) || found == unreadable(), "{:?}", found.outcome);
    }

    /// From random contents a boot never takes a set and never panics, and the next store works.
    #[test]
    fn random_contents_give_no_set(seed in proptest::collection::vec(any::<u8>(), 64), damaged in any::<u64>()) {
        let mut flash = TestFlash::new();
        for (i, byte) in flash.bytes.iter_mut().enumerate() {
            *byte = seed[i % 64].wrapping_mul((i / 64) as u8 | 1).wrapping_add(seed[(i / 64) % 64]);
        }
        for (i, d) in flash.damaged.iter_mut().enumerate() {
            *d = damaged >> (i % 64) & 1 == 1;
        }
        prop_assert_eq!(load(flash.clone()), unreadable());
        flash.damage_on_rewrite = true;
        prop_assert_eq!(load(stored(flash, 0.25)), booted(0.25));
    }
}
