//! Any image of the fault history's flash: the store returns the faults in order, each once, and keeps the next fault.
//!
//! The first two bytes of the input choose how many faults were stored; the rest are changes of single bytes.
#![no_main]

use embassy_futures::block_on;
use firmware::fault_history::FaultStore;
use firmware::fault_list::{FAULTS_KEPT, FaultEntry};
use libfuzzer_sys::fuzz_target;
use model::supervise::arming::Mode;

#[path = "flash.rs"]
mod flash;
use flash::{Flash, PAGE, PAGES, WORD};

fn entry(number: u32) -> FaultEntry {
    FaultEntry {
        number,
        boot: !number,
        time_us: u64::from(number) << 20,
        mode: Mode::Armed,
        fault: (number % 24) as u8,
    }
}

fn store(flash: Flash) -> FaultStore<Flash> {
    FaultStore::new(flash).expect("large enough")
}

fuzz_target!(|input: &[u8]| {
    let Some((count, edits)) = input.split_first_chunk::<2>() else {
        return;
    };
    let count = u32::from(u16::from_le_bytes(*count)) % (3 * PAGES * PAGE / WORD) as u32;
    let flash = Flash::erased();
    let mut history = store(flash.clone());
    for number in 0..count {
        block_on(history.store(&entry(number))).expect("stores");
    }
    flash.edit(edits);
    let mut booted = store(flash.clone());
    let found = block_on(booted.load());
    assert!(found.windows(2).all(|pair| pair[0].number < pair[1].number));
    assert!(
        found
            .iter()
            .all(|found| *found == entry(found.number) && found.number < count)
    );
    // A changed word loses its own fault and no other.
    assert!(found.len() + edits.len() / 3 >= (count as usize).min(FAULTS_KEPT));
    // A flash without a word that takes the fault may refuse the fault; a fault that the store reports as stored is there.
    if block_on(booted.store(&entry(count))).is_ok() {
        let again = block_on(store(flash).load());
        assert_eq!(again.last(), Some(&entry(count)));
    }
});
