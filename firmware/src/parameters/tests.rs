//! The store on a flash that loses power, corrupts words, and refuses what a real NOR flash refuses.

use core::future::Future;
use core::pin::pin;
use core::task::{Context, Poll, Waker};
use std::vec;
use std::vec::Vec;

use embedded_storage_async::nor_flash::{ErrorType, NorFlash, NorFlashError, NorFlashErrorKind, ReadNorFlash};
use model::vehicle::Vehicle;
use proptest::prelude::*;

use super::store::{HEADER, SET_MAX, decode, encode};
use super::{NoSet, ParameterStore};
use crate::built_in::PARAMETERS;

/// Runs a future that never waits.
fn now<F: Future>(future: F) -> F::Output {
    match pin!(future).poll(&mut Context::from_waker(Waker::noop())) {
        Poll::Ready(output) => output,
        Poll::Pending => panic!("the store waits for nothing"),
    }
}

const WORD: usize = crate::drive_board::FLASH_WORD_BYTES;
const PAGE: usize = 4096;
const PAGES: usize = 2;

#[derive(Debug, Clone, Copy, PartialEq)]
enum Trouble {
    /// The power is gone.
    Cut,
    /// Error correction cannot restore the word.
    Unreadable,
}

impl NorFlashError for Trouble {
    fn kind(&self) -> NorFlashErrorKind {
        NorFlashErrorKind::Other
    }
}

/// A NOR flash with 32-byte words, each programmed once between erasures, as the drive board's.
#[derive(Debug, Clone)]
struct TestFlash {
    bytes: Vec<u8>,
    /// Whether error correction can no longer restore each word.
    damaged: Vec<bool>,
    /// Number of words that may still be programmed, or pages erased, before the power goes. After that the
    /// flash does nothing.
    power: usize,
    dead: bool,
    /// Whether the word that a power cut hits ends damaged (as on the part) or half written.
    damage_on_cut: bool,
}

impl TestFlash {
    fn new() -> Self {
        Self {
            bytes: vec![0xFF; PAGE * PAGES],
            damaged: vec![false; PAGE * PAGES / WORD],
            power: usize::MAX,
            dead: false,
            damage_on_cut: true,
        }
    }

    /// Whether the next operation still has power; uses up its share.
    fn powered(&mut self) -> bool {
        let powered = self.power > 0;
        self.power = self.power.saturating_sub(1);
        powered
    }

    /// Brings the power back.
    fn revive(&mut self) {
        self.power = usize::MAX;
        self.dead = false;
    }
}

impl ErrorType for TestFlash {
    type Error = Trouble;
}

impl ReadNorFlash for TestFlash {
    const READ_SIZE: usize = 1;

    async fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), Trouble> {
        if self.dead {
            return Err(Trouble::Cut);
        }
        let from = offset as usize;
        let words = from / WORD..(from + bytes.len()).div_ceil(WORD);
        if self.damaged[words].iter().any(|damaged| *damaged) {
            return Err(Trouble::Unreadable);
        }
        bytes.copy_from_slice(&self.bytes[from..from + bytes.len()]);
        Ok(())
    }

    fn capacity(&self) -> usize {
        self.bytes.len()
    }
}

impl NorFlash for TestFlash {
    const WRITE_SIZE: usize = WORD;
    const ERASE_SIZE: usize = PAGE;

    async fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), Trouble> {
        assert!(
            (offset as usize).is_multiple_of(WORD) && bytes.len().is_multiple_of(WORD),
            "aligned to words"
        );
        if self.dead {
            return Err(Trouble::Cut);
        }
        for (i, word) in bytes.chunks(WORD).enumerate() {
            let at = offset as usize + i * WORD;
            let cut = !self.powered();
            let fresh = self.bytes[at..at + WORD].iter().all(|b| *b == 0xFF);
            assert!(
                cut || fresh,
                "a word is programmed once between erasures: {at:#x} holds {:02x?} and should get {word:02x?}",
                &self.bytes[at..at + WORD]
            );
            if cut {
                self.dead = true;
                self.damaged[at / WORD] |= self.damage_on_cut;
                self.bytes[at..at + WORD / 2].copy_from_slice(&word[..WORD / 2]);
                return Err(Trouble::Cut);
            }
            self.bytes[at..at + WORD].copy_from_slice(word);
        }
        Ok(())
    }

    async fn erase(&mut self, from: u32, to: u32) -> Result<(), Trouble> {
        if self.dead {
            return Err(Trouble::Cut);
        }
        for page in (from as usize / PAGE)..(to as usize / PAGE) {
            let range = page * PAGE..(page + 1) * PAGE;
            if !self.powered() {
                self.dead = true;
                // Half of the page is erased.
                self.bytes[range.start..range.start + PAGE / 2].fill(0xFF);
                return Err(Trouble::Cut);
            }
            self.bytes[range.clone()].fill(0xFF);
            self.damaged[range.start / WORD..range.end / WORD].fill(false);
        }
        Ok(())
    }
}

fn store(flash: TestFlash) -> ParameterStore<TestFlash> {
    let Ok(store) = ParameterStore::new(flash) else {
        panic!("the flash is large enough");
    };
    store
}

fn into_flash(store: ParameterStore<TestFlash>) -> TestFlash {
    store.map.destroy().0.0
}

fn vehicle(kp: f32) -> Vehicle<f32> {
    let mut parameters = PARAMETERS;
    parameters.control.kp = kp;
    Vehicle::new(parameters).expect("valid")
}

fn load(flash: TestFlash) -> Result<Vehicle<f32>, NoSet> {
    now(store(flash).load(&PARAMETERS))
}

fn stored(flash: TestFlash, kp: f32) -> TestFlash {
    let mut store = store(flash);
    now(store.store(&vehicle(kp))).expect("has power");
    into_flash(store)
}

#[test]
fn an_empty_flash_has_no_set_and_a_stored_one_comes_back_to_the_bit() {
    assert_eq!(load(TestFlash::new()), Err(NoSet::Absent));
    let mut flash = TestFlash::new();
    // Enough stores to fill both pages several times in turn.
    for round in 0..60 {
        let kp = 0.01 * round as f32;
        flash = stored(flash, kp);
        assert_eq!(load(flash.clone()), Ok(vehicle(kp)));
    }
}

#[test]
fn a_power_cut_at_any_step_leaves_the_old_set_or_the_new() {
    let mut cuts = 0;
    let (mut old_kept, mut new_kept) = (0, 0);
    for damage_on_cut in [true, false] {
        // Fill levels up to the change of pages, where the store moves, and beyond.
        for stores_before in 1..24 {
            let mut before = TestFlash::new();
            before.damage_on_cut = damage_on_cut;
            for k in 0..stores_before {
                before = stored(before, 0.01 * k as f32);
            }
            let old = vehicle(0.01 * (stores_before - 1) as f32);
            let new = vehicle(0.7);
            for power in 0.. {
                let mut flash = before.clone();
                flash.power = power;
                let mut cut_store = store(flash);
                let finished = now(cut_store.store(&new)).is_ok();
                let mut flash = into_flash(cut_store);
                flash.revive();
                let found = load(flash.clone()).expect("a set is always there");
                assert!(found == old || found == new, "cut after {power} steps");
                old_kept += u32::from(found == old);
                new_kept += u32::from(found == new);
                // The next store works, too.
                let again = stored(flash, 0.33);
                assert_eq!(load(again), Ok(vehicle(0.33)), "after a cut at {power}");
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
        "both sides of the cut are seen: {old_kept}, {new_kept}"
    );
}

#[test]
fn another_schema_is_not_believed() {
    let mut other = PARAMETERS;
    other.spar = None;
    let mut bytes = [0; SET_MAX];
    let length = encode(&other, &mut bytes).expect("fits");
    assert!(decode(&bytes[..length], &other).is_some());
    assert_eq!(decode(&bytes[..length], &PARAMETERS), None);
}

#[test]
fn a_value_out_of_range_is_refused_where_it_is_set_and_where_it_is_stored() {
    let mut parameters = PARAMETERS;
    let before = parameters.value(0).expect("first");
    for bad in [f32::NAN, f32::INFINITY, -1.0, 1e9] {
        assert!(parameters.set(0, bad).is_err());
    }
    assert_eq!(parameters.value(0), Some(before));
    let mut bytes = [0; SET_MAX];
    let length = encode(&parameters, &mut bytes).expect("fits");
    bytes[HEADER..HEADER + 4].copy_from_slice(&f32::NAN.to_le_bytes());
    assert_eq!(decode(&bytes[..length], &PARAMETERS), None);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    /// Random contents of the flash never give a set and never panic, and the next store works.
    #[test]
    fn random_contents_give_no_set(seed in proptest::collection::vec(any::<u8>(), 64), damaged in any::<u64>()) {
        let mut flash = TestFlash::new();
        for (i, byte) in flash.bytes.iter_mut().enumerate() {
            *byte = seed[i % 64].wrapping_mul((i / 64) as u8 | 1).wrapping_add(seed[(i / 64) % 64]);
        }
        for (i, d) in flash.damaged.iter_mut().enumerate() {
            *d = damaged >> (i % 64) & 1 == 1;
        }
        prop_assert!(load(flash.clone()).is_err());
        prop_assert_eq!(load(stored(flash, 0.25)), Ok(vehicle(0.25)));
    }

    /// A flipped bit never turns a stored set into another one.
    #[test]
    fn a_flipped_bit_is_never_believed(bit in 0_usize..(PAGE * 8)) {
        let mut flash = stored(TestFlash::new(), 0.5);
        flash.bytes[bit / 8] ^= 1 << (bit % 8);
        if let Ok(found) = load(flash) {
            prop_assert_eq!(found, vehicle(0.5));
        }
    }
}
