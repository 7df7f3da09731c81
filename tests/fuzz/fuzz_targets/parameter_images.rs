//! Any image of the parameters' flash: a boot takes a set that was stored or the built-in one, and the next store
//! reports the truth.
//!
//! The first byte of the input chooses the image: the image after so many stored sets, with the rest of the input as changes of
//! single bytes, or the rest of the input itself.
#![no_main]

use std::sync::OnceLock;

use embassy_futures::block_on;
use firmware::built_in::PARAMETERS;
use firmware::parameters::{BootOutcome, Booted, ParameterStore};
use libfuzzer_sys::fuzz_target;
use model::vehicle::Vehicle;

#[path = "flash.rs"]
mod flash;
use flash::Flash;

/// Sets in the longest history: enough to fill both sectors and to return to the first.
const STORES: usize = 12;

/// The vehicle of one store of a history.
fn vehicle(store: usize) -> Vehicle<f32> {
    let mut parameters = PARAMETERS;
    parameters.control.kp = 0.01 * store as f32;
    Vehicle::new(parameters).expect("valid")
}

fn store(flash: Flash) -> ParameterStore<Flash> {
    ParameterStore::new(flash).expect("large enough")
}

/// The image of the flash before the first store of the history, and after each.
fn histories() -> &'static [Vec<u8>] {
    static HISTORIES: OnceLock<Vec<Vec<u8>>> = OnceLock::new();
    HISTORIES.get_or_init(|| {
        let flash = Flash::erased();
        let mut images = vec![flash.image()];
        for n in 0..STORES {
            block_on(store(flash.clone()).store(&vehicle(n))).expect("stores");
            images.push(flash.image());
        }
        images
    })
}

fuzz_target!(|input: &[u8]| {
    let Some((choice, rest)) = input.split_first() else {
        return;
    };
    let stored = usize::from(*choice) % (STORES + 2);
    let flash = match histories().get(stored) {
        Some(image) => {
            let flash = Flash::holding(image.clone());
            flash.edit(rest);
            flash
        }
        None => {
            let mut image = Flash::erased().image();
            let length = rest.len().min(image.len());
            image[..length].copy_from_slice(&rest[..length]);
            Flash::holding(image)
        }
    };
    let built_in = Vehicle::new(PARAMETERS).expect("valid");
    let mut booting = store(flash.clone());
    let Booted {
        vehicle: found,
        outcome,
    } = block_on(booting.load(&built_in));
    match outcome {
        BootOutcome::NothingStored | BootOutcome::NotBelieved(_) => assert_eq!(found, built_in),
        BootOutcome::Stored if stored <= STORES => assert!((0..stored).any(|n| found == vehicle(n))),
        // A set that the fuzzer has made, checksums included: `Vehicle` has checked its values.
        BootOutcome::Stored | BootOutcome::Migrated { .. } => {}
    }
    let wanted = vehicle(70);
    let told = block_on(booting.store(&wanted));
    let booted = block_on(store(flash).load(&built_in));
    let there = booted.vehicle == wanted && booted.outcome == BootOutcome::Stored;
    assert_eq!(told.is_ok(), there, "{:?}", booted.outcome);
});
