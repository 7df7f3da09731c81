//! The parameter store on a flash that loses power, corrupts words, and refuses what a real NOR flash refuses.

use core::future::Future;
use core::pin::pin;
use core::task::{Context, Poll, Waker};

use model::vehicle::Vehicle;

use super::{BootOutcome, Booted, ParameterStore};
use crate::built_in::PARAMETERS;

mod damage;
mod migration;
mod power_cuts;
mod transaction;

use crate::test_flash::TestFlash;

/// Runs a future that never waits.
fn now<F: Future>(future: F) -> F::Output {
    match pin!(future).poll(&mut Context::from_waker(Waker::noop())) {
        Poll::Ready(output) => output,
        Poll::Pending => panic!("the store waits for nothing"),
    }
}

fn store(flash: TestFlash) -> ParameterStore<TestFlash> {
    let Ok(store) = ParameterStore::new(flash) else {
        panic!("the flash is large enough");
    };
    store
}

fn built_in() -> Vehicle<f32> {
    Vehicle::new(PARAMETERS).expect("valid")
}

/// The built-in vehicle with another gain.
fn vehicle(kp: f32) -> Vehicle<f32> {
    let mut parameters = PARAMETERS;
    parameters.control.kp = kp;
    Vehicle::new(parameters).expect("valid")
}

fn load(flash: TestFlash) -> Booted {
    now(store(flash).load(&built_in()))
}

/// The result of a boot from a flash that holds this gain.
fn booted(kp: f32) -> Booted {
    Booted {
        vehicle: vehicle(kp),
        outcome: BootOutcome::Stored,
    }
}

/// The flash after storing a gain.
fn stored(flash: TestFlash, kp: f32) -> TestFlash {
    let mut store = store(flash);
    now(store.store(&vehicle(kp))).expect("stored");
    store.flash.0
}

/// The flash after gains 0, 0.01, 0.02 and so on were stored in turn.
fn history(stores: u32) -> TestFlash {
    (0..stores).fold(TestFlash::new(), |flash, k| stored(flash, gain(k)))
}

/// The gain of the store number `k` of a history.
fn gain(k: u32) -> f32 {
    0.01 * k as f32
}

#[test]
fn an_empty_flash_has_no_set_and_a_stored_one_comes_back_to_the_bit() {
    assert_eq!(load(TestFlash::new()).outcome, BootOutcome::NothingStored);
    let mut flash = TestFlash::new();
    // Enough stores to fill both pages several times in turn.
    for k in 0..60 {
        flash = stored(flash, gain(k));
        assert_eq!(load(flash.clone()), booted(gain(k)));
    }
}
