use std::cell::RefCell;
use std::rc::Rc;
use std::vec::Vec;

use embedded_storage_async::nor_flash::{ErrorType, NorFlash, NorFlashError, NorFlashErrorKind, ReadNorFlash};
use model::supervise::arming::Mode;

use super::FaultStore;
use crate::fault_list::{FAULTS_KEPT, FaultEntry};

/// Holds every place, and is full after some dozen faults.
const PAGE: usize = 4096;
const WORD: usize = 32;

#[derive(Debug)]
struct Cut;

impl NorFlashError for Cut {
    fn kind(&self) -> NorFlashErrorKind {
        NorFlashErrorKind::Other
    }
}

/// Two pages of flash whose power is cut after some operations; clones are the same flash.
#[derive(Debug, Clone)]
struct Flash {
    bytes: Rc<RefCell<Vec<u8>>>,
    /// Words and erases until the power is cut.
    left: Rc<RefCell<u32>>,
}

impl Flash {
    fn erased() -> Self {
        Self {
            bytes: Rc::new(RefCell::new(std::vec![0xFF; 2 * PAGE])),
            left: Rc::new(RefCell::new(u32::MAX)),
        }
    }

    fn spend(&self) -> Result<(), Cut> {
        let mut left = self.left.borrow_mut();
        *left = left.checked_sub(1).ok_or(Cut)?;
        Ok(())
    }
}

impl ErrorType for Flash {
    type Error = Cut;
}

impl ReadNorFlash for Flash {
    const READ_SIZE: usize = 1;

    async fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), Cut> {
        let from = offset as usize;
        bytes.copy_from_slice(&self.bytes.borrow()[from..from + bytes.len()]);
        Ok(())
    }

    fn capacity(&self) -> usize {
        2 * PAGE
    }
}

impl NorFlash for Flash {
    const WRITE_SIZE: usize = WORD;
    const ERASE_SIZE: usize = PAGE;

    async fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), Cut> {
        for (n, word) in bytes.chunks(WORD).enumerate() {
            self.spend()?;
            let from = offset as usize + n * WORD;
            self.bytes.borrow_mut()[from..from + WORD].copy_from_slice(word);
        }
        Ok(())
    }

    async fn erase(&mut self, from: u32, to: u32) -> Result<(), Cut> {
        self.spend()?;
        self.bytes.borrow_mut()[from as usize..to as usize].fill(0xFF);
        Ok(())
    }
}

fn entry(number: u32) -> FaultEntry {
    FaultEntry {
        number,
        boot: u32::MAX - number,
        time_us: u64::MAX - u64::from(number),
        mode: Mode::Stopping,
        fault: (number % 17) as u8,
    }
}

fn load(flash: &Flash) -> Vec<FaultEntry> {
    let mut store = FaultStore::new(flash.clone()).expect("large enough");
    embassy_futures::block_on(store.load()).to_vec()
}

#[test]
fn the_last_faults_come_back_in_order() {
    let flash = Flash::erased();
    assert_eq!(load(&flash), []);
    for count in 1..200 {
        let mut store = FaultStore::new(flash.clone()).expect("large enough");
        embassy_futures::block_on(store.store(&entry(count - 1))).expect("stores");
        let kept = (count as usize).min(FAULTS_KEPT) as u32;
        let expected: Vec<FaultEntry> = (count - kept..count).map(entry).collect();
        assert_eq!(load(&flash), expected, "after {count}");
    }
}

#[test]
fn a_power_cut_at_any_step_loses_one_fault_at_most() {
    // Far enough to move from page to page.
    for before in [0, 5, 29, 30, 31, 32, 33, 60, 100] {
        let full = Flash::erased();
        for number in 0..before {
            let mut store = FaultStore::new(full.clone()).expect("large enough");
            embassy_futures::block_on(store.store(&entry(number))).expect("stores");
        }
        let old = load(&full);
        let mut cut_after = 0;
        loop {
            let flash = Flash {
                bytes: Rc::new(RefCell::new(full.bytes.borrow().clone())),
                left: Rc::new(RefCell::new(cut_after)),
            };
            let mut store = FaultStore::new(flash.clone()).expect("large enough");
            let stored = embassy_futures::block_on(store.store(&entry(before))).is_ok();
            *flash.left.borrow_mut() = u32::MAX;
            let new = load(&flash);
            let lost = old.iter().filter(|entry| !new.contains(entry)).count();
            assert!(lost <= 1, "{before} before, cut after {cut_after}: {lost} lost");
            assert!(new.iter().all(|entry| old.contains(entry) || entry.number == before));
            // The store goes on after the cut.
            let mut store = FaultStore::new(flash.clone()).expect("large enough");
            embassy_futures::block_on(store.store(&entry(before + 1))).expect("stores");
            assert_eq!(load(&flash).last(), Some(&entry(before + 1)));
            if stored {
                assert_eq!(new.last(), Some(&entry(before)));
                break;
            }
            cut_after += 1;
        }
    }
}

#[test]
fn a_flash_full_of_anything_takes_the_next_fault() {
    for seed in 1..50_u32 {
        let flash = Flash::erased();
        let mut state = seed;
        for byte in flash.bytes.borrow_mut().iter_mut() {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            *byte = (state >> 24) as u8;
        }
        load(&flash);
        let mut store = FaultStore::new(flash.clone()).expect("large enough");
        embassy_futures::block_on(store.store(&entry(7))).expect("stores");
        assert_eq!(load(&flash).last(), Some(&entry(7)), "{seed}");
    }
}
