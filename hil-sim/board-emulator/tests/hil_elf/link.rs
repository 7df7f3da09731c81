//! Noise and broken frames on the wire: nothing moves, the board keeps answering, every bad frame is counted.

use board_emulator::board::BridgeOutput;
use firmware::protocol::frame::FRAME_MAX;
use firmware::protocol::message::Order;
use model::command::Request;
use model::supervise::arming::Mode;

use crate::support::{Operator, noise, ready};

/// Checks that the board is disarmed, has not reset and still sends good frames.
fn assert_unharmed(board: &mut Operator) {
    let (bridges, resets) = board
        .emulation
        .at(|stopped| (stopped.bridges(), stopped.resets()))
        .expect("it runs");
    assert_eq!(bridges, [BridgeOutput::Open; 3]);
    assert_eq!(resets, []);
    assert_eq!(board.status().vehicle.mode, Mode::Disarmed);
    assert_eq!(
        board.status().vehicle.refused_arms,
        0,
        "the board took noise for a request"
    );
    assert_eq!(board.client.unreadable_frames, 0, "frames of the board are unreadable");
}

#[test]
fn a_hundred_thousand_bytes_of_noise_move_nothing() {
    let mut board = ready();
    board.run(20);
    let before = board.status().link.unreadable_frames();
    // The line carries 92 bytes per millisecond.
    let bytes = noise(100_000, 0x1234_5678_9ABC_DEF1);
    let zeros = bytes.iter().filter(|byte| **byte == 0).count() as u32;
    board.emulation.send(&bytes).expect("the wire stands");
    board.run(1200);
    assert_eq!(
        board
            .emulation
            .at(|stopped| stopped.board().wire().pending())
            .expect("it runs"),
        0
    );
    assert_unharmed(&mut board);
    let counted = board.status().link.unreadable_frames() - before;
    println!("{counted} bad frames counted of {zeros} delimiters");
    // Every delimiter ends a frame, but two in a row end none. An overlong frame is counted once.
    assert!(counted <= zeros + 100_000 / FRAME_MAX as u32, "{counted}");
    assert!(counted * 10 >= zeros * 9, "{counted} of {zeros}");

    board.emulation.send(&[0]).expect("the wire stands");
    let asked = board.order(Order::Request(Request::ClearFaults)).expect("identified");
    board.run(50);
    assert!(
        board.client.answer_to(asked).is_some(),
        "the board does not answer any more"
    );
}

#[test]
fn garbage_truncated_and_overlong_frames_are_counted() {
    let mut board = ready();
    board.run(20);
    let before = board.status().link.unreadable_frames();
    let now_us = board.emulation.now() / 1000;
    let (_, arm) = board
        .client
        .order(now_us, Order::Request(Request::Arm))
        .expect("identified");

    // Truncated: the byte before the delimiter is missing.
    let mut bytes = arm[..arm.len() - 2].to_vec();
    bytes.push(0);
    // Overlong, with its delimiter.
    bytes.extend([1; FRAME_MAX + 100]);
    bytes.push(0);
    // One flipped bit, in every byte in turn.
    for n in 0..arm.len() - 1 {
        let mut flipped = arm.clone();
        flipped[n] ^= 0x10;
        bytes.extend(flipped);
    }
    board.emulation.send(&bytes).expect("the wire stands");
    board.run(100);
    assert_unharmed(&mut board);
    let counted = board.status().link.unreadable_frames() - before;
    // A flipped bit may turn a byte into a delimiter or a delimiter into data; no flip leaves a good frame.
    let flips = arm.len() as u32 - 1;
    assert!(
        (2 + flips..=2 + 2 * flips).contains(&counted),
        "{counted} for {flips} flips"
    );
}
