//! Failures of the part's flash (flags that stay, protected sectors, unreadable words), and settings that the part's errata demand.

use board_emulator::board::{MemoryFault, PartSetup};
use board_emulator::time::MS;
use board_emulator::vehicle::stored::{self, REGION};
use firmware::built_in;
use firmware::drive_board::{BOARD, FLASH_SECTOR_BYTES, FLASH_WORD_BYTES, HISTORY_SECTORS, PARAMETER_SECTORS};
use firmware::image::Image;
use firmware::protocol::message::{
    Answer, Order, ParameterAnswer, ParameterRequest, UpdateAnswer, UpdateRefusal, UpdateRequest,
};
use model::supervise::codes::Blocker;
use model::vehicle::Vehicle;

use crate::support::{Operator, STARTED_MS, firmware, powered_part, ready};

/// Flags of a bank's status register: write protection, sequence, strobe, inconsistency, corrected single error.
const ERRORS: [u32; 5] = [1 << 17, 1 << 18, 1 << 19, 1 << 21, 1 << 25];
/// The parameter that the tests change, and its value.
const CHANGE: ParameterRequest = ParameterRequest::Write { number: 0, value: 0.27 };

/// Flags of an earlier error in either bank do not make a later store fail.
#[test]
fn flags_of_an_earlier_error_fail_no_store() {
    for bank in [0, 1] {
        let mut board = ready();
        board.act(move |board, _| board.part().raise_flash_flags(bank, ERRORS.iter().sum()));
        board.ask(CHANGE);
        assert_eq!(
            board.ask(ParameterRequest::Store),
            ParameterAnswer::Stored,
            "bank {bank}"
        );
    }
}

/// While the part's supply is low, the status reports that, and the board begins neither a store nor an update.
#[test]
fn a_low_supply_refuses_to_store() {
    let mut board = ready();
    board.ask(CHANGE);
    assert!(!board.status().vehicle.blockers.contains(Blocker::PartSupply));
    board.act(|board, now| board.set_supply(now, 2_700));
    let answer = board.ask(ParameterRequest::Store);
    assert_ne!(answer, ParameterAnswer::Stored);
    assert!(board.status().vehicle.blockers.contains(Blocker::PartSupply));
    let image = Image {
        board: BOARD,
        length: 4096,
        checksum: 1,
        build: 1,
        version: [0, 0, 1],
    };
    let begin = board
        .order(Order::Update(UpdateRequest::Begin(image)))
        .expect("identified");
    board.run(200);
    let refused = UpdateAnswer::Refused(UpdateRefusal::LowSupply);
    assert_eq!(board.client.answer_to(begin), Some(Answer::Update(refused)));
    board.act(|board, now| board.set_supply(now, 3_300));
    board.run(50);
    assert!(!board.status().vehicle.blockers.contains(Blocker::PartSupply));
    board.ask(CHANGE);
    assert_eq!(board.ask(ParameterRequest::Store), ParameterAnswer::Stored);
}

/// The flash refuses to write a protected sector and never ends the operation: the board answers all the same.
#[test]
fn a_protected_sector_ends_in_an_answer() {
    let mut board = powered_part(
        PartSetup {
            writable_sectors: [0xFF, 0x0F],
            ..PartSetup::default()
        },
        &[],
    );
    board.run(800);
    board.ask(CHANGE);
    let store = board
        .order(Order::Parameters(ParameterRequest::Store))
        .expect("identified");
    let answer = (0..60).find_map(|_| {
        board.run(200);
        board.client.answer_to(store)
    });
    let answer = answer.expect("an answer within 12 s");
    assert_ne!(answer, Answer::Parameters(ParameterAnswer::Stored));
}

/// All words of the store cannot be read, or one written word: the board starts without a reset. It takes the stored set, if the set
/// does not need the word; otherwise it takes the built-in set, reports that, and does not arm. Unreadable words of the fault history
/// do not block arming.
#[test]
fn a_store_that_cannot_be_read_blocks_arming() {
    const WORD: u64 = FLASH_WORD_BYTES as u64;
    /// Largest number of words of the set that the test tries one by one.
    const WORDS_MAX: usize = 10;
    let vehicle = Vehicle::new(built_in::PARAMETERS.cast::<f64>()).expect("valid");
    let (start, set) = stored::set(&vehicle).expect("it fits");
    assert_eq!(start, REGION);
    let written: Vec<u64> = (start..)
        .step_by(FLASH_WORD_BYTES)
        .zip(set.chunks(FLASH_WORD_BYTES))
        .filter(|(_, word)| word.iter().any(|byte| *byte != 0xFF))
        .map(|(at, _)| at)
        .collect();
    assert!(written.len() >= 5, "{written:#x?}");
    let boot = |memory_fault| {
        let part = PartSetup {
            memory_fault,
            ..PartSetup::default()
        };
        let mut board = powered_part(part, &[(start, set.clone())]);
        board.run(STARTED_MS);
        let resets = board.emulation.at(|stopped| stopped.resets()).expect("it runs");
        assert_eq!(resets, []);
        board
    };
    let blocked = |board: &Operator| board.status().vehicle.blockers.contains(Blocker::Parameters);
    assert!(!blocked(&boot(None)));
    let lost = |board: &mut Operator, first: u64| {
        let log = board.log();
        let told = |text: &str| log.iter().any(|line| line.contains(text));
        let lost = told("parameters: built-in set, arming is blocked");
        assert!(lost != told("parameters: stored set"), "{first:#x}: {log:#?}");
        assert_eq!(blocked(board), lost, "{first:#x}");
        lost
    };
    // Boots take time: of many words the test tries only some.
    let some: Vec<u64> = written
        .iter()
        .copied()
        .step_by(written.len().div_ceil(WORDS_MAX))
        .collect();
    let words = some.len();
    let mut without = 0;
    for first in some {
        let mut board = boot(Some(MemoryFault::unreadable(first, WORD)));
        without += usize::from(lost(&mut board, first));
    }
    assert!(2 * without > words, "only {without} of {words} words lose the set");
    let store = (PARAMETER_SECTORS * FLASH_SECTOR_BYTES) as u64;
    let mut board = boot(Some(MemoryFault::unreadable(REGION, store)));
    assert!(lost(&mut board, REGION));
    let history = (HISTORY_SECTORS * FLASH_SECTOR_BYTES) as u64;
    assert!(!blocked(&boot(Some(MemoryFault::unreadable(
        REGION - history,
        history
    )))));
}

/// The DMA streams of the link's USART make bufferable transfers: without that setting (TRBUFF) a stream that meets another transfer
/// can stay locked (ES0392 2.20.4), and the link would be dead until the next reset.
#[test]
fn the_links_streams_make_bufferable_transfers() {
    /// Control registers of DMA1's streams 0, in, and 1, out.
    const CONTROL: [u64; 2] = [0x4002_0010, 0x4002_0028];
    const BUFFERABLE: u32 = 1 << 20;
    const ENABLED: u32 = 1;
    let mut board = ready();
    board.run(100);
    for register in CONTROL {
        // The setting matters while a transfer runs; the driver clears the register of a stopped stream. A status is on the wire
        // for 3 ms of every 10 ms.
        let running = (0..80).find_map(|_| {
            board.emulation.run_for(MS / 4).expect("it runs");
            let control = board.emulation.at(move |stopped| stopped.register(register));
            let control = control.expect("it runs").expect("the register answers");
            (control & ENABLED != 0).then_some(control)
        });
        let control = running.unwrap_or_else(|| panic!("{register:#x}: no transfer in 20 ms"));
        assert_eq!(control & BUFFERABLE, BUFFERABLE, "{register:#x}: {control:#x}");
    }
}

/// Thumb: `movw r0, #0xED14; movt r0, #0xE000; ldr r1, [r0]; movw r0, #0xFFF8; movt r0, #0x2407; str r1, [r0]; b .`: copies the
/// system control block's CCR, which nobody but the core can read, to the end of the RAM.
const COPY_CCR: [u8; 22] = [
    0x4E, 0xF6, 0x14, 0x50, 0xCE, 0xF2, 0x00, 0x00, 0x01, 0x68, 0x4F, 0xF6, 0xF8, 0x70, 0xC2, 0xF2, 0x07, 0x40, 0x01,
    0x60, 0xFE, 0xE7,
];

/// The data cache is off: in write-through it could lose data (ES0392 2.1.1), and the DMA's buffers would need maintenance.
#[test]
fn the_data_cache_is_off() {
    const COPIED_TO: u64 = 0x2407_FFF8;
    const INSTRUCTION_CACHE: u32 = 1 << 17;
    const DATA_CACHE: u32 = 1 << 16;
    let handler = firmware().symbol("TIM5").expect("the firmware has it").0 & !1;
    let mut board = ready();
    let patched = board.emulation.at(move |stopped| stopped.write(handler, &COPY_CCR));
    patched.expect("it runs").expect("flash can be patched");
    board.emulation.run_for(3 * MS).expect("it runs");
    let caches = board.emulation.at(|stopped| stopped.read_word(COPIED_TO));
    let caches = caches.expect("it runs").expect("it is memory");
    assert_eq!(
        caches & (INSTRUCTION_CACHE | DATA_CACHE),
        INSTRUCTION_CACHE,
        "{caches:#x}"
    );
}

/// A debugger that halts the core stops both bridges' timers, whose outputs then are off, and the watchdog.
#[test]
fn a_debuggers_halt_is_made_to_stop_the_timers_and_the_watchdog() {
    /// The debug unit's registers for APB2 and APB4, and what they stop: TIM1 and TIM8, IWDG1.
    const STOPS: [(u64, u32); 2] = [(0x5C00_104C, 1 << 0 | 1 << 1), (0x5C00_1054, 1 << 18)];
    let mut board = ready();
    for (register, stops) in STOPS {
        let value = board.emulation.at(move |stopped| stopped.register(register));
        let value = value.expect("it runs").expect("the register answers");
        assert_eq!(value & stops, stops, "{register:#x}: {value:#x}");
    }
}
