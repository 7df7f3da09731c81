//! An image that the board refuses for what it is itself: on trial, with a failed self-test, with a failing flash, or without
//! room.

use std::ops::Range;

use firmware::drive_board::{ARRIVED_SECTORS, BOARD, FLASH_SECTOR_BYTES};
use firmware::hardware::ResetCause;
use firmware::image_seal::JOURNAL_BYTES;
use firmware::protocol::message::{UPDATE_BYTES, UpdateAnswer, UpdateRefusal, UpdateRequest, UpdateState};
use firmware::update::CONFIRM_AFTER;
use firmware::update::journal::{self, Mark};
use model::supervise::codes::Blocker;
use virtual_board::board::flash::VirtualFlash;
use virtual_board::board::{RUNNING_IMAGE, UpdatePart};

#[path = "support/elves.rs"]
mod elves;
mod support;
#[path = "support/updates.rs"]
mod updates;
#[path = "support/wires.rs"]
mod wires;
use elves::elf;
use support::Bench;
use updates::{ask, image, piece, refused, send};
use wires::ready;

/// A board that has started again with this for its task of the updates.
fn restarted(seed: u64, update: UpdatePart) -> Bench {
    let mut bench = ready(seed);
    bench.board.set_update(update);
    bench.board.reset(ResetCause::Pin).expect("boots again");
    bench.run(1000);
    bench
}

/// A place whose journal says that the running firmware is booted for the first time.
fn on_trial(order: u32) -> VirtualFlash {
    let mut place = VirtualFlash::for_an_image();
    for mark in [Mark::Ordered, Mark::Kept, Mark::Tried] {
        let subject = [2000, RUNNING_IMAGE, order];
        embassy_futures::block_on(journal::add(&mut place, mark, subject)).expect("marked");
    }
    place
}

fn state_of(bench: &mut Bench) -> UpdateState {
    match ask(bench, UpdateRequest::State) {
        UpdateAnswer::State { state, .. } => state,
        other => panic!("{other:?}"),
    }
}

/// The journal's bytes.
fn journal_bytes() -> Range<usize> {
    let end = ARRIVED_SECTORS * FLASH_SECTOR_BYTES;
    end - JOURNAL_BYTES as usize..end
}

#[test]
fn a_firmware_on_trial_takes_no_image_until_it_has_confirmed_itself() {
    let (announced, bytes) = image(&elf(BOARD, 2000));
    for journal_fails in [false, true] {
        let place = on_trial(7);
        if journal_fails {
            place.set_failing(journal_bytes());
        }
        let mut bench = restarted(
            68,
            UpdatePart {
                place: Some(place),
                self_test_passed: true,
            },
        );
        assert_eq!(state_of(&mut bench), UpdateState::OnTrial);
        for request in [
            UpdateRequest::Begin(announced),
            piece(&bytes, 0),
            UpdateRequest::Install,
        ] {
            assert_eq!(ask(&mut bench, request), refused(UpdateRefusal::OnTrial));
        }
        bench.run(CONFIRM_AFTER.as_millis());
        let (state, answer) = if journal_fails {
            (UpdateState::OnTrial, refused(UpdateRefusal::OnTrial))
        } else {
            (UpdateState::Confirmed, UpdateAnswer::Ready { next: 0 })
        };
        assert_eq!(state_of(&mut bench), state);
        assert_eq!(ask(&mut bench, UpdateRequest::Begin(announced)), answer);
    }
}

#[test]
fn a_board_whose_self_test_failed_takes_no_image_and_confirms_none() {
    let (announced, bytes) = image(&elf(BOARD, 2000));
    for (place, state) in [
        (VirtualFlash::for_an_image(), UpdateState::None),
        (on_trial(7), UpdateState::OnTrial),
    ] {
        let mut bench = restarted(
            69,
            UpdatePart {
                place: Some(place.clone()),
                self_test_passed: false,
            },
        );
        bench.run(CONFIRM_AFTER.as_millis());
        assert_eq!(state_of(&mut bench), state);
        let refusal = match state {
            UpdateState::OnTrial => UpdateRefusal::OnTrial,
            _ => UpdateRefusal::SelfTest,
        };
        let before = place.contents();
        for request in [
            UpdateRequest::Begin(announced),
            piece(&bytes, 0),
            UpdateRequest::Install,
        ] {
            assert_eq!(ask(&mut bench, request), refused(refusal));
        }
        assert!(place.contents() == before, "written");
    }
}

/// Wherever the flash fails, the host is told, the vehicle can be armed, and a flash that works again takes the image.
#[test]
fn a_flash_that_fails_is_told_wherever_it_fails() {
    let (announced, bytes) = image(&elf(BOARD, 2000));
    let place = VirtualFlash::for_an_image();
    let update = UpdatePart {
        place: Some(place.clone()),
        self_test_passed: true,
    };
    let mut bench = restarted(70, update);
    let failed = refused(UpdateRefusal::FlashFailed);
    let may_arm = |bench: &mut Bench| {
        bench.run(20);
        assert!(!bench.status().vehicle.blockers.contains(Blocker::Update));
    };
    // Each sector, while the place is erased.
    for sector in 0..ARRIVED_SECTORS {
        place.set_failing(sector * FLASH_SECTOR_BYTES..(sector + 1) * FLASH_SECTOR_BYTES);
        assert_eq!(ask(&mut bench, UpdateRequest::Begin(announced)), failed, "{sector}");
        may_arm(&mut bench);
    }
    // Each piece; a word that may have been programmed is not programmed again.
    for at in (0..bytes.len()).step_by(UPDATE_BYTES) {
        place.set_failing(0..0);
        let begun = ask(&mut bench, UpdateRequest::Begin(announced));
        assert_eq!(begun, UpdateAnswer::Ready { next: 0 });
        send(&mut bench, &bytes[..at], 0);
        place.set_failing(at..at + 1);
        assert_eq!(ask(&mut bench, piece(&bytes, at)), failed, "{at}");
        may_arm(&mut bench);
        assert_eq!(ask(&mut bench, piece(&bytes, at)), refused(UpdateRefusal::NotBegun));
    }
    place.set_failing(0..0);
    assert_eq!(
        ask(&mut bench, UpdateRequest::Begin(announced)),
        UpdateAnswer::Ready { next: 0 }
    );
    send(&mut bench, &bytes, 0);
    assert_eq!(ask(&mut bench, UpdateRequest::Install), UpdateAnswer::OnlyStored);
}

#[test]
fn a_board_without_room_says_so() {
    let (announced, bytes) = image(&elf(BOARD, 2000));
    let update = UpdatePart {
        place: None,
        self_test_passed: true,
    };
    let mut bench = restarted(71, update);
    for request in [
        UpdateRequest::State,
        UpdateRequest::Begin(announced),
        piece(&bytes, 0),
        UpdateRequest::Install,
    ] {
        assert_eq!(ask(&mut bench, request), refused(UpdateRefusal::NoRoom));
    }
    assert!(!bench.status().vehicle.blockers.contains(Blocker::Update));
}
