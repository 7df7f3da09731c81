//! Boots from a parameter flash whose set is lost: the board takes the built-in set and blocks arming until somebody stores a set.

use firmware::parameters::ParameterStore;
use firmware::protocol::message::{ParameterAnswer, ParameterRequest};
use model::command::Request;
use model::supervise::arming::Mode;
use model::supervise::codes::Blocker;
use model::vehicle::Vehicle;
use virtual_board::board::flash::VirtualFlash;
use virtual_board::board::log;

#[path = "support/questions.rs"]
mod questions;
mod support;
use questions::{ask, number};
use support::{Bench, reference};

/// Boots from a flash whose set is lost, and asserts that the vehicle arms only once a set is stored, whichever set that is.
fn is_blocked_until_a_set_is_stored(seed: u64, flash: VirtualFlash, choose: &[ParameterRequest]) {
    let mut bench = Bench::with(seed, flash.clone());
    bench.run(1500);
    let lines = log::take();
    assert!(
        lines
            .iter()
            .any(|line| line.contains("built-in set, arming is blocked until a set is stored")),
        "{lines:?}"
    );
    bench.request(Request::Arm);
    bench.run(60);
    assert_eq!(bench.mode(), Mode::Disarmed);
    let blockers = bench.status().vehicle.blockers;
    assert_eq!(blockers.iter().collect::<Vec<_>>(), [Blocker::Parameters]);
    // A refused store does not end the blocking.
    let number = number(reference().parameters(), "body", "arm_mass_kg");
    ask(&mut bench, ParameterRequest::Write { number, value: 100.0 });
    assert_eq!(
        ask(&mut bench, ParameterRequest::Store),
        ParameterAnswer::Inconsistent { number }
    );
    bench.request(Request::Arm);
    bench.run(60);
    assert_eq!(bench.mode(), Mode::Disarmed);

    for request in choose {
        ask(&mut bench, *request);
    }
    assert_eq!(ask(&mut bench, ParameterRequest::Store), ParameterAnswer::Stored);
    bench.run(1500);
    bench.request(Request::Arm);
    bench.run(20);
    assert_eq!(
        bench.mode(),
        Mode::Armed,
        "blockers {}",
        bench.status().vehicle.blockers
    );
    drop(bench);
    log::take();
    let _again = Bench::with(seed, flash);
    let lines = log::take();
    assert!(
        lines.iter().any(|line| line.ends_with("parameters: stored set")),
        "{lines:?}"
    );
}

#[test]
fn random_flash_boots_to_the_built_in_set_and_does_not_arm() {
    for seed in 0..4_u64 {
        let flash = VirtualFlash::erased();
        let mut noise = plant::noise::Noise::new(seed, 1);
        let bytes: Vec<u8> = (0..256 * 1024).map(|_| noise.bits() as u8).collect();
        flash.overwrite(&bytes);
        let choose: &[ParameterRequest] = if seed % 2 == 0 {
            &[ParameterRequest::BuiltIn]
        } else {
            &[]
        };
        is_blocked_until_a_set_is_stored(seed, flash, choose);
    }
}

/// A flash to which two sets were stored, and the places of the newer set: the bytes that the second store changed.
fn two_sets() -> (VirtualFlash, Vec<usize>) {
    let set = |kp: f64| {
        let mut parameters = *reference().parameters();
        parameters.control.kp = kp;
        Vehicle::new(parameters.cast::<f32>()).expect("valid")
    };
    let flash = VirtualFlash::holding(&set(0.1)).expect("fits");
    let before = flash.contents();
    let Ok(mut store) = ParameterStore::new(flash.clone()) else {
        panic!("two sectors are enough");
    };
    embassy_futures::block_on(store.store(&set(0.2))).expect("stored");
    let after = flash.contents();
    let changed = (0..before.len()).filter(|at| before[*at] != after[*at]).collect();
    (flash, changed)
}

#[test]
fn a_damaged_newest_set_does_not_boot_the_older_one() {
    let (flash, changed) = two_sets();
    let sound = flash.contents();
    // In the set's header, in its first words and in its middle.
    for place in [0, 40, 200, 400] {
        let mut bytes = sound.clone();
        bytes[changed[place]] ^= 0x10;
        flash.overwrite(&bytes);
        let mut bench = Bench::with(7, flash.clone());
        let lines = log::take();
        assert!(
            lines.iter().any(|line| line.contains("the stored set cannot be read")),
            "{lines:?}"
        );
        let kp = number(reference().parameters(), "control", "kp");
        bench.run(100);
        let answer = ask(&mut bench, ParameterRequest::Read { number: kp });
        let built_in = reference().parameters().control.kp as f32;
        assert!(
            matches!(answer, ParameterAnswer::Value { value, .. } if value == built_in),
            "{answer:?}"
        );
    }
    is_blocked_until_a_set_is_stored(8, flash, &[]);
}
