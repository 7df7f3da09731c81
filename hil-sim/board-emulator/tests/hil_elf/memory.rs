//! The memory: the image's seal, the test of the RAM, and words of the image that cannot be read.
//!
//! The boards of these tests start without the boot loader, which the option bytes allow: the tests check the firmware's own
//! checks, and the boot loader would not start a bad image.

use board_emulator::board::{MemoryFault, PartSetup};
use board_emulator::time::MS;
use firmware::drive_board::{FLASH_WORD_BYTES, IMAGE_START};
use firmware::image_seal::{MARKER, MISSING, NUMBERS_AT};
use firmware::protocol::message::Order;
use model::command::Request;
use model::supervise::arming::Mode;
use model::supervise::codes::Blocker;

use virtual_board::link_client::LinkClient;

use crate::support::{Operator, blocks_alone, firmware, open, powered_part};

/// Address of a text or a marker in the flash.
fn place(board: &mut Operator, sought: &[u8]) -> u64 {
    let start = u64::from(IMAGE_START);
    let flash = board.emulation.at(move |stopped| stopped.read_block(start, 256 * 1024));
    let flash = flash.expect("it runs").expect("it is memory");
    let found = flash.windows(sought.len()).position(|window| window == sought);
    start + found.expect("the image has it") as u64
}

/// A part that starts with the firmware.
fn without_loader() -> PartSetup {
    PartSetup {
        boot_address: IMAGE_START,
        ..PartSetup::default()
    }
}

fn write(board: &mut Operator, at: u64, bytes: Vec<u8>) {
    let written = board.emulation.at(move |stopped| stopped.write(at, &bytes));
    written.expect("it runs").expect("it is memory");
}

/// A firmware whose seal has no numbers, as after a plain build, boots and answers, but does not arm.
#[test]
fn an_image_without_its_checksum_does_not_arm() {
    let mut board = powered_part(without_loader(), &[]);
    let seal = place(&mut board, &MARKER.map(u32::to_le_bytes).concat());
    write(&mut board, seal + NUMBERS_AT as u64, MISSING.to_le_bytes().to_vec());
    blocks_alone(&mut board, Blocker::Unsealed);
}

/// One bit of a message that is never shown has changed: the board does not arm with a firmware that is not the one that was built.
#[test]
fn an_image_of_which_a_bit_has_changed_does_not_arm() {
    let mut board = powered_part(without_loader(), &[]);
    let at = place(&mut board, b"non-maskable interrupt");
    write(&mut board, at, vec![b'n' ^ 1]);
    blocks_alone(&mut board, Blocker::Image);
}

/// A board whose memory has gone bad.
fn with_fault(fault: MemoryFault) -> Operator {
    let part = PartSetup {
        memory_fault: Some(fault),
        ..without_loader()
    };
    powered_part(part, &[])
}

fn resets(board: &mut Operator) -> usize {
    board.emulation.at(|stopped| stopped.resets()).expect("it runs").len()
}

/// The board reports an unreadable word of the image, and does not restart because of it.
#[test]
fn a_word_of_the_image_that_cannot_be_read_does_not_arm() {
    let mut sound = powered_part(without_loader(), &[]);
    let at = place(&mut sound, b"non-maskable interrupt");
    let word = at - at % FLASH_WORD_BYTES as u64;
    let mut board = with_fault(MemoryFault::unreadable(word, FLASH_WORD_BYTES as u64));
    blocks_alone(&mut board, Blocker::Image);
    assert_eq!(resets(&mut board), 0);
}

/// Wherever in the image the word lies, the board either starts and reports the word or, if the start itself needs the word, restarts
/// again and again. The bridges stay open.
#[test]
fn no_unreadable_word_of_the_image_lets_the_board_arm() {
    const PLACES: u64 = 8;
    let mut sound = powered_part(without_loader(), &[]);
    let seal = place(&mut sound, &MARKER.map(u32::to_le_bytes).concat());
    let length = sound
        .emulation
        .at(move |stopped| stopped.read_word(seal + NUMBERS_AT as u64));
    let length = u64::from(length.expect("it runs").expect("it is memory"));
    let mut told = 0;
    for n in 0..PLACES {
        let first = (u64::from(IMAGE_START) + length * n / PLACES) & !(FLASH_WORD_BYTES as u64 - 1);
        let mut board = with_fault(MemoryFault::unreadable(first, FLASH_WORD_BYTES as u64));
        board.command = Some((0.0, 0.0));
        for _ in 0..14 {
            board.run(50);
            assert!(open(&mut board), "{first:#x}");
        }
        board.order(Order::Request(Request::Arm));
        board.run(50);
        assert!(open(&mut board), "{first:#x}");
        if resets(&mut board) == 0 {
            told += 1;
            assert!(board.status().vehicle.blockers.contains(Blocker::Image), "{first:#x}");
        }
        let armed = board
            .statuses
            .iter()
            .any(|status| status.vehicle.mode != Mode::Disarmed);
        assert!(!armed, "{first:#x}");
    }
    assert!(told >= PLACES / 2, "{told}");
}

/// A word of the image that goes bad while the vehicle is armed: the tick that needs the word ends the run, the bridges are
/// open, and the next start reports why.
#[test]
fn a_word_that_goes_bad_while_armed_opens_the_bridges() {
    const SINCE: u64 = 1200 * MS;
    let functions = firmware().functions(|name| name.contains("sincosf")).expect("an ELF");
    let (_, first, bytes) = functions.into_iter().next().expect("the control laws need it");
    // The next tick needs the function's constants. They can be read again when the board restarts the tasks.
    let mut board = with_fault(MemoryFault::Unreadable {
        first,
        bytes,
        since: SINCE,
        until: SINCE + 3 * MS,
    });
    board.run(800);
    board.arm();
    board.emulation.run_until(SINCE).expect("it runs");
    assert!(!open(&mut board));
    board.emulation.run_for(2 * MS).expect("it runs");
    for _ in 0..100 {
        assert!(open(&mut board));
        board.emulation.run_for(MS).expect("it runs");
    }
    assert_eq!(resets(&mut board), 1);
    board.client = LinkClient::new(2);
    board.run(200);
    assert_eq!(board.status().vehicle.mode, Mode::Disarmed);
    let log = board.log();
    assert!(
        log.iter().any(|line| line.contains("the last run ended: hard fault")),
        "{log:#?}"
    );
}

/// A stuck bit in an unused part of the AXI SRAM, in the test's own result, in an unused part of the DTCM, and at the bottom of the
/// stack.
#[test]
fn bits_of_the_ram_that_stick_do_not_arm() {
    let (result, _) = firmware().symbol("RAM_TEST").expect("the firmware has it");
    for (address, bits) in [
        (0x2407_FFFC, 1 << 31),
        (result + 4, 1 << 4),
        (0x2001_0000, 1),
        (0x2000_0000, 1 << 7),
    ] {
        let mut board = with_fault(MemoryFault::Stuck { address, bits });
        blocks_alone(&mut board, Blocker::Ram);
    }
}
