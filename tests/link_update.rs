//! An image over the link to the virtual board, which stores and checks the image as the drive board does.

use std::sync::Arc;
use std::sync::atomic::AtomicU32;

use clap::Parser;
use firmware::drive_board::{ARRIVED_SECTORS, BOARD, FLASH_SECTOR_BYTES, IMAGE_START};
use firmware::image::Image;
use firmware::image_seal::{ERASED, FLASH_START, NUMBERS_AT, SEAL_AT, image_room};
use firmware::protocol::message::{UPDATE_BYTES, UpdateAnswer, UpdateRefusal, UpdateRequest, UpdateState};
use hil_sim::cli::link::console::Console;
use hil_sim::cli::link::session::Link;
use hil_sim::cli::link::{self, Arguments};
use model::command::Request;
use model::supervise::arming::Mode;
use model::supervise::codes::Blocker;
use report::error::CommandError;

#[path = "support/elves.rs"]
mod elves;
mod support;
#[path = "support/updates.rs"]
mod updates;
#[path = "support/wires.rs"]
mod wires;
use elves::{elf, linked};
use support::Bench;
use updates::{ask, image, piece, refused, send};
use wires::{BoardWire, ready};

/// The command line of `hil-sim link`.
#[derive(Parser)]
struct Tool {
    #[command(flatten)]
    link: Arguments,
}

/// What `link update` ends with, of a file of these bytes.
fn update(bench: Bench, name: &str, file: &[u8]) -> (Result<(), CommandError>, String) {
    let path = std::env::temp_dir().join(format!("link-update-{}-{name}", std::process::id()));
    std::fs::write(&path, file).expect("a file");
    let shown = path.to_string_lossy();
    let tool = Tool::try_parse_from(["link", "--port", "none", "update", &shown]).expect("understood");
    let mut console = Console(Vec::new());
    let begin = |_: &str| Ok(Link::new(BoardWire::new(bench), 4711, Arc::new(AtomicU32::new(0))));
    let ended = link::run_on(&tool.link, begin, &mut console);
    std::fs::remove_file(&path).expect("it was there");
    (ended, String::from_utf8(console.0).expect("text"))
}

/// The virtual board has no boot loader: the command ends with an error that says that the firmware is not installed.
#[test]
fn the_virtual_board_stores_an_image_and_tells_that_it_is_not_installed() {
    let (ended, shown) = update(ready(60), "whole", &elf(BOARD, 9000));
    assert!(shown.contains("firmware 1.0.0, build 00000007, 9000 bytes"), "{shown}");
    let error = ended.expect_err("not installed");
    assert_eq!(error.exit_code(), 1);
    assert!(error.to_string().contains("not installed"), "{error}");
}

#[test]
fn the_tool_refuses_what_is_no_sealed_firmware() {
    let good = elf(BOARD, 9000);
    let mut changed = good.clone();
    *changed.last_mut().expect("bytes") ^= 1;
    let mut unsealed = good.clone();
    unsealed[84 + SEAL_AT + NUMBERS_AT..][..8].fill(ERASED);
    for (file, why) in [
        (&good[..60], "no ELF of the board"),
        (&changed[..], "the image is not the one that was sealed"),
        (&unsealed[..], "the image is not sealed"),
    ] {
        let (ended, _) = update(ready(61), "bad", file);
        let error = ended.expect_err("refused");
        assert_eq!(error.exit_code(), 2, "{error}");
        assert!(error.to_string().ends_with(why), "{error}");
    }
}

/// An image for the start of the flash, where the boot loader stands: the tool recognises it by the ELF, and the board
/// by the image's first instruction, whatever the ELF says.
#[test]
fn an_image_that_is_linked_for_another_place_is_refused() {
    let (ended, _) = update(ready(68), "old", &linked(BOARD, 9000, FLASH_START, FLASH_START));
    let error = ended.expect_err("refused");
    assert_eq!(error.exit_code(), 2, "{error}");
    assert!(error.to_string().contains("behind its boot loader"), "{error}");
    let (ended, _) = update(ready(69), "elsewhere", &linked(BOARD, 9000, IMAGE_START, FLASH_START));
    let error = ended.expect_err("refused");
    assert_eq!(error.exit_code(), 1, "{error}");
    assert!(error.to_string().contains("0x08020000"), "{error}");
}

#[test]
fn an_image_for_another_board_or_of_a_wrong_size_is_refused() {
    let max = image_room(ARRIVED_SECTORS * FLASH_SECTOR_BYTES);
    let (good, _) = image(&elf(BOARD, 9000));
    let mut bench = ready(62);
    for (announced, refusal) in [
        (Image { board: 767, ..good }, UpdateRefusal::WrongBoard { board: BOARD }),
        (
            Image {
                length: max + 1,
                ..good
            },
            UpdateRefusal::WrongSize { max },
        ),
        (Image { length: 100, ..good }, UpdateRefusal::WrongSize { max }),
    ] {
        assert_eq!(ask(&mut bench, UpdateRequest::Begin(announced)), refused(refusal));
    }
    // A thread runs one board at a time.
    drop(bench);
    let (ended, _) = update(ready(63), "foreign", &elf(767, 9000));
    let error = ended.expect_err("refused").to_string();
    assert!(error.contains("for another board than this, 743"), "{error}");
}

#[test]
fn nothing_is_stored_while_armed_and_nothing_is_armed_while_storing() {
    let (announced, bytes) = image(&elf(BOARD, 2000));
    let mut bench = Bench::armed(64);
    for request in [
        UpdateRequest::Begin(announced),
        piece(&bytes, 0),
        UpdateRequest::Install,
    ] {
        assert_eq!(ask(&mut bench, request), refused(UpdateRefusal::NotDisarmed));
        assert_eq!(bench.mode(), Mode::Armed);
    }
    bench.request(Request::Disarm);
    assert_eq!(
        ask(&mut bench, UpdateRequest::Begin(announced)),
        UpdateAnswer::Ready { next: 0 }
    );
    bench.request(Request::Arm);
    bench.run(20);
    assert_eq!(bench.mode(), Mode::Disarmed);
    assert!(bench.status().vehicle.blockers.contains(Blocker::Update));
    // A host that leaves blocks the vehicle only for a while.
    bench.run(10_100);
    assert!(!bench.status().vehicle.blockers.contains(Blocker::Update));
    bench.request(Request::Arm);
    bench.run(20);
    assert_eq!(bench.mode(), Mode::Armed);
    // The board keeps the abandoned transfer, but takes no piece while armed.
    assert_eq!(ask(&mut bench, piece(&bytes, 0)), refused(UpdateRefusal::NotDisarmed));
    bench.request(Request::Disarm);
    assert_eq!(
        ask(&mut bench, UpdateRequest::Begin(announced)),
        UpdateAnswer::Ready { next: 0 }
    );
    send(&mut bench, &bytes, 0);
    assert_eq!(ask(&mut bench, UpdateRequest::Install), UpdateAnswer::OnlyStored);
    bench.run(20);
    assert!(!bench.status().vehicle.blockers.contains(Blocker::Update));
}

#[test]
fn pieces_that_are_missing_or_wrong_are_found() {
    let (announced, bytes) = image(&elf(BOARD, 2000));
    let mut bench = ready(65);
    assert_eq!(ask(&mut bench, piece(&bytes, 0)), refused(UpdateRefusal::NotBegun));
    assert_eq!(
        ask(&mut bench, UpdateRequest::Install),
        refused(UpdateRefusal::NotBegun)
    );
    ask(&mut bench, UpdateRequest::Begin(announced));
    assert_eq!(
        ask(&mut bench, piece(&bytes, UPDATE_BYTES)),
        refused(UpdateRefusal::OutOfOrder { next: 0 })
    );
    send(&mut bench, &bytes[..2 * UPDATE_BYTES], 0);
    assert_eq!(
        ask(&mut bench, UpdateRequest::Install),
        refused(UpdateRefusal::NotBegun)
    );
    // A host that returns resumes the transfer.
    let next = 2 * UPDATE_BYTES as u32;
    assert_eq!(
        ask(&mut bench, UpdateRequest::Begin(announced)),
        UpdateAnswer::Ready { next }
    );
    let mut wrong = bytes.clone();
    wrong[1900] ^= 1;
    send(&mut bench, &wrong, 2 * UPDATE_BYTES);
    assert_eq!(
        ask(&mut bench, UpdateRequest::Install),
        refused(UpdateRefusal::WrongChecksum)
    );
    // After a wrong checksum the host sends everything again.
    assert_eq!(
        ask(&mut bench, UpdateRequest::Begin(announced)),
        UpdateAnswer::Ready { next: 0 }
    );
    send(&mut bench, &bytes, 0);
    assert_eq!(ask(&mut bench, UpdateRequest::Install), UpdateAnswer::OnlyStored);
    let none = UpdateAnswer::State {
        state: UpdateState::None,
        checksum: 0,
    };
    assert_eq!(ask(&mut bench, UpdateRequest::State), none, "nothing was ordered");
}

#[test]
fn nothing_is_stored_during_a_controlled_stop() {
    let (announced, _) = image(&elf(BOARD, 2000));
    let mut bench = Bench::driving(67, 0.8);
    // The operator falls silent.
    bench.drive = None;
    bench.run(400);
    assert_eq!(bench.mode(), Mode::Stopping);
    assert_eq!(
        ask(&mut bench, UpdateRequest::Begin(announced)),
        refused(UpdateRefusal::NotDisarmed)
    );
    assert_eq!(bench.mode(), Mode::Stopping);
}

/// A battery that runs empty may cut the supply in the middle of a store.
#[test]
fn nothing_is_stored_on_a_low_supply() {
    let (announced, _) = image(&elf(BOARD, 2000));
    let mut bench = ready(66);
    bench
        .board
        .world(|world| world.plant.battery_mut().open_circuit_v = 18.0);
    bench.run(500);
    assert_eq!(
        ask(&mut bench, UpdateRequest::Begin(announced)),
        refused(UpdateRefusal::LowSupply)
    );
}
