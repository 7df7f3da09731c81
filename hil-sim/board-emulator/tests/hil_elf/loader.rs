//! The boot loader in front of the firmware. It installs an ordered image, which comes up and confirms itself, and rolls back an
//! image that does not; it recovers from a loss of power; without an image no motor moves.

use std::sync::Arc;

use board_emulator::board::{PartSetup, gaps};
use board_emulator::elf::flight;
use board_emulator::run::{Emulation, EmulationSettings};
use board_emulator::time::MS;
use board_emulator::vehicle::BenchVehicle;
use embassy_futures::block_on;
use firmware::drive_board::FLASH_SECTOR_BYTES;
use firmware::image::{CHECKSUM, Image};
use firmware::image_seal::{ERASED, MARKER, NUMBERS_AT, NUMBERS_BYTES, SEAL_AT, SEAL_BYTES, VERSION_AT};
use firmware::protocol::message::{
    ParameterAnswer, ParameterRequest, UPDATE_BYTES, UpdateAnswer, UpdateRequest, UpdateState,
};
use firmware::update::UpdateStore;
use hil_elf::seal::seal;
use hil_sim::cli::link::console::Console;
use hil_sim::cli::link::session::Link;
use hil_sim::cli::link::update::Update;
use model::supervise::codes::{Blocker, BlockerSet};
use virtual_board::board::flash::VirtualFlash;
use virtual_board::link_client::LinkClient;

use crate::support::{BATTERY_V, Operator, firmware, noise, open, powered_part, ready};
use crate::update::{PLACE, STORES, STORES_BYTES, ask, flash, image, piece};
use crate::wire::EmulatedWire;

/// Where the image runs, behind the boot loader; stated here again on purpose.
const RUNNING: u64 = 0x0802_0000;
/// Where the boot loader keeps the previous image.
const KEPT: u64 = 0x0814_0000;
/// Bytes of each of the three places.
const PLACE_BYTES: usize = 2 * FLASH_SECTOR_BYTES;
/// Longest time of an installation on the emulated flash, and of the start behind it: one image kept and one installed, each
/// two sectors of 1.1 s and 8000 words of 0.15 ms; the checks; the firmware's start.
const INSTALLED_MS: u64 = 9_000;
/// The version of the other firmware.
const OTHER: u8 = 99;

/// A board with its boot loader and, in place of the firmware, these contents of its flash, powered up.
fn powered_with(part: PartSetup, contents: &[(u64, Vec<u8>)]) -> Operator {
    let settings = EmulationSettings {
        part,
        ..EmulationSettings::default()
    };
    let bench = Box::new(BenchVehicle::new(BATTERY_V));
    let emulation = Emulation::power_on_loader(firmware(), bench, settings, contents);
    Operator::new(emulation.expect("the board powers up"))
}

/// The present contents of the three places.
fn places(board: &mut Operator) -> Vec<(u64, Vec<u8>)> {
    [RUNNING, PLACE, KEPT]
        .map(|at| (at, flash(board, at, PLACE_BYTES)))
        .to_vec()
}

/// The firmware under test as another version; `change` may spoil it before it is sealed again.
fn other(change: impl FnOnce(&mut [u8])) -> (Image, Vec<u8>) {
    let (mut image, mut bytes) = image();
    bytes[SEAL_AT + VERSION_AT] = OTHER;
    change(&mut bytes);
    bytes[SEAL_AT + NUMBERS_AT..][..NUMBERS_BYTES].fill(ERASED);
    image.version[0] = u16::from(OTHER);
    image.checksum = CHECKSUM.checksum(&bytes);
    let numbers = [image.length.to_le_bytes(), image.checksum.to_le_bytes()].concat();
    bytes[SEAL_AT + NUMBERS_AT..][..NUMBERS_BYTES].copy_from_slice(&numbers);
    (image, bytes)
}

/// The other firmware with these Thumb instructions, behind its seal, as its first.
fn starting_with(code: &[u8]) -> (Image, Vec<u8>) {
    other(|bytes| {
        let at = SEAL_AT + SEAL_BYTES;
        bytes[at..at + code.len()].copy_from_slice(code);
        bytes[4..8].copy_from_slice(&(RUNNING as u32 + at as u32 + 1).to_le_bytes());
    })
}

/// The flash's contents once the firmware under test has stored an image and ordered its installation.
fn ordered((announced, bytes): &(Image, Vec<u8>)) -> (u64, Vec<u8>) {
    let place = VirtualFlash::for_an_image();
    let mut store = UpdateStore::new(place.clone(), image().0.checksum);
    block_on(store.begin(*announced)).expect("there is room");
    for at in (0..bytes.len()).step_by(UPDATE_BYTES) {
        let UpdateRequest::Write { bytes, .. } = piece(bytes, at) else {
            panic!("a piece");
        };
        let piece = bytes.as_flattened().try_into().expect("its size");
        block_on(store.write(at as u32, piece)).expect("it is stored");
    }
    let checked = block_on(store.check()).expect("it is whole");
    block_on(store.order(&checked)).expect("it is ordered");
    (PLACE, place.contents())
}

/// A board on which the firmware under test has just ordered an image and restarts.
fn restarting(part: PartSetup, other: &(Image, Vec<u8>)) -> Operator {
    powered_part(part, &[ordered(other)])
}

fn version(board: &mut Operator) -> u8 {
    flash(board, RUNNING + SEAL_AT as u64, 64)[VERSION_AT]
}

/// The running firmware's answer about the last update.
fn state(board: &mut Operator) -> UpdateState {
    board.client = LinkClient::new(2);
    board.run(100);
    match ask(board, UpdateRequest::State) {
        UpdateAnswer::State { state, .. } => state,
        other => panic!("{other:?}"),
    }
}

fn resets(board: &mut Operator) -> Vec<(u64, String)> {
    board.emulation.at(|stopped| stopped.resets()).expect("it runs")
}

/// Runs on, and asserts every 50 ms that every bridge is open.
fn runs_open(board: &mut Operator, milliseconds: u64) {
    for _ in 0..milliseconds / 50 {
        board.emulation.run_for(50 * MS).expect("it runs");
        assert!(open(board));
    }
}

/// The other firmware as the ELF that `link update` reads.
fn other_elf() -> Update {
    let mut elf = std::fs::read(firmware().path()).expect("the ELF is there");
    let marker = MARKER.map(u32::to_le_bytes).concat();
    let at = elf.windows(marker.len()).position(|window| window == marker);
    elf[at.expect("it has a seal") + VERSION_AT] = OTHER;
    seal(&mut elf).expect("an ELF with a seal");
    Update::of(&elf).expect("it is sealed")
}

/// The host's tool sends an image, and waits until the new firmware reports that it has come up. Parameters and fault history stay,
/// and the vehicle arms.
#[test]
fn an_image_over_the_link_is_installed_comes_up_and_is_confirmed() {
    let mut board = ready();
    board.run(50);
    let changed = board.ask(ParameterRequest::Write { number: 0, value: 0.27 });
    assert!(matches!(changed, ParameterAnswer::Value { .. }), "{changed:?}");
    assert_eq!(board.ask(ParameterRequest::Store), ParameterAnswer::Stored);
    // A new set starts a new calibration.
    board.run(800);
    board.arm();
    // A fault for the history: the stop is pressed and released.
    board.act(|board, now| board.set_stop(now, true));
    board.run(500);
    board.command = None;
    board.act(|board, now| board.set_stop(now, false));
    board.run(2_000);
    let stores = flash(&mut board, STORES, STORES_BYTES);
    let history = STORES_BYTES / 2;
    assert!(
        stores[..history].iter().any(|byte| *byte != ERASED),
        "a fault is stored"
    );
    assert!(stores[history..].iter().any(|byte| *byte != ERASED), "a set is stored");

    let wire = EmulatedWire::new(board.emulation);
    let mut console = Console(Vec::new());
    let mut link = Link::new(wire.clone(), 77, Arc::default());
    link.identify().expect("the board says who it is");
    link.update(&other_elf(), &mut console).expect("it is installed");
    drop(link);
    let told = String::from_utf8(console.0).expect("text");
    assert!(told.contains("firmware 99."), "{told}");
    assert!(
        told.ends_with("the new firmware has come up and is confirmed\n"),
        "{told}"
    );

    let mut board = Operator::new(wire.into_board());
    assert_eq!(version(&mut board), OTHER);
    assert_eq!(resets(&mut board).len(), 1);
    assert_eq!(state(&mut board), UpdateState::Confirmed);
    assert!(
        flash(&mut board, STORES, STORES_BYTES) == stores,
        "parameters and faults"
    );
    let read = board.ask(ParameterRequest::Read { number: 0 });
    assert!(
        matches!(read, ParameterAnswer::Value { value, .. } if value == 0.27),
        "{read:?}"
    );
    // The image stays after a reset.
    board.emulation.at(|stopped| stopped.reset_by_pin()).expect("it runs");
    board.emulation.run_for(1_000 * MS).expect("it runs");
    assert_eq!(
        (version(&mut board), state(&mut board)),
        (OTHER, UpdateState::Confirmed)
    );
    board.arm();
    let found = board.emulation.at(|stopped| stopped.gaps()).expect("it runs");
    assert_eq!(gaps::unexpected(&found), []);
}

/// While a new firmware writes its confirmation the vehicle does not arm; afterwards it does.
#[test]
fn a_firmware_that_confirms_itself_keeps_the_vehicle_from_arming() {
    let mut board = restarting(PartSetup::default(), &other(|_| {}));
    // The installation takes 6.6 s; 3 s later the firmware confirms itself.
    runs_open(&mut board, 8_000);
    let record = flight::address(firmware()).expect("the record is the host's");
    let probed = board
        .emulation
        .at(move |stopped| stopped.probe(record, flight::WORDS as u64));
    probed.expect("it runs");
    runs_open(&mut board, 4_500);
    let words = board.emulation.at(|stopped| stopped.take_probe()).expect("it runs");
    let kept: Vec<bool> = words
        .chunks(flight::WORDS)
        .map(|words| flight::decode(words).expect("a record").sample.board_blockers)
        .map(|blockers| BlockerSet::from_bits(blockers).contains(Blocker::Update))
        .collect();
    assert!(kept.contains(&true), "{} ticks", kept.len());
    assert_eq!((kept.first(), kept.last()), (Some(&false), Some(&false)));
    assert_eq!(
        (version(&mut board), state(&mut board)),
        (OTHER, UpdateState::Confirmed)
    );
    board.run(100);
    board.arm();
}

/// Thumb: `movw r0, #0xED0C; movt r0, #0xE000; movw r1, #4; movt r1, #0x05FA; str r1, [r0]; b .`: resets the part.
const RESET: [u8; 20] = [
    0x4E, 0xF6, 0x0C, 0x50, 0xCE, 0xF2, 0x00, 0x00, 0x40, 0xF2, 0x04, 0x01, 0xC0, 0xF2, 0xFA, 0x51, 0x01, 0x60, 0xFE,
    0xE7,
];
/// Thumb `udf #0`: faults before there is a handler for it.
const UNDEFINED: [u8; 2] = [0x00, 0xDE];
/// Thumb `b .`: hangs.
const HANG: [u8; 2] = [0xFE, 0xE7];

/// The boot loader rolls back a sealed image that resets the part, faults or hangs at its first instruction; an image that hangs
/// after its watchdog has reset the part, 32.8 s at the nominal oscillator.
#[test]
fn an_image_that_does_not_come_up_is_rolled_back() {
    for (code, patience_ms) in [(&RESET[..], 0), (&UNDEFINED, 0), (&HANG, 33_000)] {
        let mut board = restarting(PartSetup::default(), &starting_with(code));
        runs_open(&mut board, INSTALLED_MS + patience_ms);
        // The roll-back takes two sectors and one image again.
        runs_open(&mut board, INSTALLED_MS / 2);
        assert_eq!(version(&mut board), image().1[SEAL_AT + VERSION_AT], "{code:x?}");
        assert_eq!(state(&mut board), UpdateState::RolledBack);
        assert!(!resets(&mut board).is_empty());
        board.run(600);
        board.arm();
    }
}

/// A firmware whose self-test fails does not confirm itself, and the boot loader returns to the previous firmware.
#[test]
fn an_image_whose_self_test_fails_is_rolled_back() {
    let part = PartSetup {
        brown_out_level: 0,
        ..PartSetup::default()
    };
    let mut board = restarting(part, &other(|_| {}));
    runs_open(&mut board, INSTALLED_MS);
    assert_eq!(version(&mut board), OTHER, "the image is not tried");
    runs_open(&mut board, 3_500 + INSTALLED_MS / 2);
    assert_eq!(version(&mut board), image().1[SEAL_AT + VERSION_AT]);
    assert_eq!(state(&mut board), UpdateState::RolledBack);
}

/// The stored image changes before its installation: the old firmware keeps running, and reports that the new one was not installed.
#[test]
fn an_ordered_image_that_has_changed_is_not_installed() {
    let (place, mut contents) = ordered(&other(|_| {}));
    contents[5_000] ^= 1;
    let mut board = powered_part(PartSetup::default(), &[(place, contents)]);
    board.run(500);
    assert_eq!(state(&mut board), UpdateState::NotInstalled);
    assert_eq!(version(&mut board), image().1[SEAL_AT + VERSION_AT]);
    board.run(300);
    board.arm();
}

/// The power is cut at several instants of the installation, and again during the repair. The next start continues, and
/// the image starts.
#[test]
fn an_installation_that_loses_its_power_goes_on() {
    let mut board = restarting(PartSetup::default(), &other(|_| {}));
    let mut cuts = Vec::new();
    // The installation takes 6.6 s: four sectors of 1.1 s, and twice 7000 words of 0.13 ms.
    for step_ms in [300, 1_400, 1_300, 1_000, 1_100, 900] {
        board.emulation.run_for(step_ms * MS).expect("it runs");
        cuts.push(places(&mut board));
    }
    let different = cuts.windows(2).filter(|pair| pair[0] != pair[1]).count();
    assert!(different >= 3, "{different}");
    for (n, cut) in cuts.iter().enumerate() {
        let mut again = powered_with(PartSetup::default(), cut);
        runs_open(&mut again, 200 * n as u64);
        let mut board = powered_with(PartSetup::default(), &places(&mut again));
        runs_open(&mut board, INSTALLED_MS);
        assert_eq!(version(&mut board), OTHER, "cut {n}");
        assert!(resets(&mut board).is_empty());
        let state = state(&mut board);
        assert!(
            matches!(state, UpdateState::OnTrial | UpdateState::Confirmed),
            "cut {n}: {state:?}"
        );
    }
}

/// Port B, with the red lamp's pin PB14, and the offset of its levels.
const PORT_B: u64 = 0x5802_0400;
const LEVELS: u64 = 0x14;

/// The power controller's CSR1, and its bit that the core's voltage is valid (ACTVOSRDY).
const POWER_STATUS: u64 = 0x5802_4804;
const VOLTAGE_VALID: u32 = 1 << 13;

/// No bootable image: an erased flash, noise in every sector behind the boot loader, a damaged image, an image that
/// nobody sealed, an image that is linked for the start of the flash. The bridges' pins stay as the reset has left
/// them, the boot loader starts nothing, and the red lamp blinks.
#[test]
fn without_an_image_nothing_moves_and_the_lamp_blinks() {
    let (_, mut damaged) = image();
    damaged[5_000] ^= 1;
    let (_, mut unsealed) = image();
    unsealed[SEAL_AT + NUMBERS_AT..][..NUMBERS_BYTES].fill(ERASED);
    let (_, elsewhere) = other(|bytes| {
        let reset: [u8; 4] = bytes[4..8].try_into().expect("a vector");
        let reset = u32::from_le_bytes(reset) - FLASH_SECTOR_BYTES as u32;
        bytes[4..8].copy_from_slice(&reset.to_le_bytes());
    });
    let garbage = |seed| {
        let bank_1 = noise(7 * FLASH_SECTOR_BYTES, seed);
        vec![(RUNNING, bank_1), (PLACE, noise(8 * FLASH_SECTOR_BYTES, !seed))]
    };
    for contents in [
        vec![],
        garbage(0x9E37_79B9_7F4A_7C15),
        garbage(0x0123_4567_89AB_CDEF),
        vec![(RUNNING, damaged)],
        vec![(RUNNING, unsealed)],
        vec![(RUNNING, elsewhere)],
    ] {
        let mut board = powered_with(PartSetup::default(), &contents);
        let mut levels = Vec::new();
        for _ in 0..40 {
            runs_open(&mut board, 50);
            let (connected, level) = board
                .emulation
                .at(|stopped| {
                    (
                        stopped.board().bridge_pins_connected(),
                        stopped.register(PORT_B + LEVELS),
                    )
                })
                .expect("it runs");
            assert!(!connected);
            // The port has no clock before the lamp is used.
            levels.extend(level.ok().map(|level| level >> 14 & 1));
        }
        // The loader itself has configured the core's supply (left Run*), without which it may not program the flash.
        let power = board.emulation.at(|stopped| stopped.register(POWER_STATUS));
        let power = power.expect("it runs").expect("a register");
        assert_eq!(power & VOLTAGE_VALID, VOLTAGE_VALID);
        assert!(levels.contains(&0) && levels.contains(&1), "{levels:?}");
        assert_eq!(resets(&mut board), []);
        board.client = LinkClient::new(2);
        board.run(100);
        assert!(board.client.identity().is_none() && board.statuses.is_empty());
    }
}
