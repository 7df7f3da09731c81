//! The memory at boot: the image's seal, the test of the RAM.

use board_emulator::board::PartSetup;
use board_emulator::time::MS;
use firmware::image_seal::{FLASH_START, MARKER, MISSING, NUMBERS_AT};
use model::command::Request;
use model::supervise::arming::Mode;
use model::supervise::codes::Blocker;

use crate::support::{Operator, powered_part};

/// Where a text or a marker stands in the flash.
fn place(board: &mut Operator, sought: Vec<u8>) -> u64 {
    let start = u64::from(FLASH_START);
    let flash = board.emulation.at(move |stopped| stopped.read_block(start, 192 * 1024));
    let flash = flash.expect("it runs").expect("it is memory");
    let found = flash.windows(sought.len()).position(|window| window == sought);
    start + found.expect("the image has it") as u64
}

fn write(board: &mut Operator, at: u64, bytes: Vec<u8>) {
    let written = board.emulation.at(move |stopped| stopped.write(at, &bytes));
    written.expect("it runs").expect("it is memory");
}

/// The board boots, says what is wrong, and does not arm for this reason alone.
fn blocked(board: &mut Operator, blocker: Blocker) {
    board.command = Some((0.0, 0.0));
    board.run(800);
    let told = format!("self-test: {}: ", blocker.name());
    assert!(
        board.log().iter().any(|line| line.contains(&told)),
        "{:#?}",
        board.log()
    );
    board.request(Request::Arm);
    let status = &board.status().vehicle;
    assert_eq!(status.mode, Mode::Disarmed);
    assert_eq!(status.blockers.iter().collect::<Vec<_>>(), [blocker]);
}

/// A firmware whose seal has no numbers, as a plain build leaves it, boots and talks, and does not arm.
#[test]
fn an_image_without_its_checksum_does_not_arm() {
    let mut board = powered_part(PartSetup::default(), &[]);
    let seal = place(&mut board, MARKER.map(u32::to_le_bytes).concat());
    write(&mut board, seal + NUMBERS_AT as u64, MISSING.to_le_bytes().to_vec());
    blocked(&mut board, Blocker::Unsealed);
}

/// One bit of a message that is never shown: the board does not arm with a firmware that is not the one that was built.
#[test]
fn an_image_of_which_a_bit_has_changed_does_not_arm() {
    let mut board = powered_part(PartSetup::default(), &[]);
    let at = place(&mut board, b"non-maskable interrupt".to_vec());
    write(&mut board, at, vec![b'n' ^ 1]);
    blocked(&mut board, Blocker::Image);
}

/// A word of the AXI SRAM, and one of the DTCM where the stack will be, that change while the march is under way.
#[test]
fn a_word_of_the_ram_that_changes_does_not_arm() {
    // At the first stop the march has written the first words, and has not read them yet. The AXI SRAM comes first: the
    // DTCM's turn is some milliseconds later.
    for (address, after_ms) in [(0x2400_0008, 0), (0x2000_0010, 16)] {
        let mut board = powered_part(PartSetup::default(), &[]);
        let mut found = false;
        // In steps of a tenth of a millisecond until the march has left its first pattern there.
        board.emulation.run_for(after_ms * MS).expect("it runs");
        for _ in 0..100 {
            let word = board.emulation.at(move |stopped| stopped.read_word(address));
            if word.expect("it runs").expect("it is memory") != 0 {
                found = true;
                break;
            }
            board.emulation.run_for(MS / 10).expect("it runs");
        }
        assert!(found, "the march comes to {address:#x}");
        write(&mut board, address, vec![0x42]);
        blocked(&mut board, Blocker::Ram);
    }
}
