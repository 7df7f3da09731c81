//! A run is the same every time, bit for bit.

use std::hash::{DefaultHasher, Hash, Hasher};

use board_emulator::elf::flight;
use board_emulator::run::Emulation;
use board_emulator::time::MS;

use crate::support::{Operator, firmware, powered, ready};

/// Hash of a run's records, log and statuses, and the number of instructions of the run.
fn digest(mut board: Operator) -> (u64, u64) {
    let record = flight::address(firmware()).expect("the record is the host's");
    board
        .emulation
        .at(move |stopped| stopped.probe(record, flight::WORDS as u64))
        .expect("it runs");
    board.arm();
    board.command = Some((0.5, 0.2));
    board.run(300);
    let mut hasher = DefaultHasher::new();
    let (probe, instructions, log) = board
        .emulation
        .at(|stopped| (stopped.take_probe(), stopped.instructions(), stopped.log_bytes(0).ok()))
        .expect("it runs");
    (probe, log).hash(&mut hasher);
    format!("{:?}", board.statuses).hash(&mut hasher);
    (hasher.finish(), instructions)
}

#[test]
fn two_runs_have_one_hash() {
    let run = || {
        let mut emulation: Emulation = powered();
        emulation.run_until(700 * MS).expect("it runs");
        digest(Operator::new(emulation))
    };
    let (first, second) = (run(), run());
    println!("{:016x}, {} instructions", first.0, first.1);
    assert_eq!(first, second);
    let (continued, instructions) = digest(ready());
    assert_eq!(first.0, continued, "a run that continued from a snapshot differs");
    // The snapshot ends one block of the translated code and begins another: the emulator's count may differ by the
    // instruction at that place, but the firmware's behaviour may not differ.
    assert!(first.1.abs_diff(instructions) <= 1, "{} and {instructions}", first.1);
}
