//! Start-up: the RAM after power-up, a clock that is missing or stops, and the self-test.

use board_emulator::board::{BridgeBreak, PartSetup};
use board_emulator::run::{Emulation, EmulationSettings};
use board_emulator::time::{MS, US};
use board_emulator::vehicle::BenchVehicle;
use firmware::drive_board::IMAGE_START;
use firmware::drive_board::encoders::FILTER_NS;
use firmware::hardware::ClockSource;
use model::command::Request;
use model::supervise::arming::Mode;
use model::supervise::codes::{Blocker, Fault};

use crate::support::{BATTERY_V, Operator, blocks_alone, firmware, log_has, open, powered_part, ready};

/// The RAM as the part has it: AXI SRAM and DTCM.
const RAM: [(u64, usize); 2] = [(0x2400_0000, 512 * 1024), (0x2000_0000, 128 * 1024)];
/// The number of a boot if the random number generator gave nothing.
const BOOT_WITHOUT_RANDOM: u32 = 0x9E37_79B9;

/// The RAM has any contents after power-up: the start writes every word before the firmware uses the RAM.
#[test]
fn every_word_of_the_ram_is_written_after_power_up() {
    let garbage: Vec<_> = RAM.iter().map(|(at, bytes)| (*at, vec![0xA5; *bytes])).collect();
    let mut board = powered_part(PartSetup::default(), &garbage);
    board.run(200);
    assert!(!log_has(&mut board, "the last run ended"));
    for (at, bytes) in RAM {
        let words = board.emulation.at(move |stopped| stopped.read_block(at, bytes));
        let words = words.expect("it runs").expect("it is memory");
        let left = words.chunks_exact(8).position(|word| word == [0xA5; 8]);
        assert_eq!(left, None, "the word at {at:#010x} + 8 x");
    }
    let boot = board.client.identity().expect("identified").about.boot;
    assert_ne!(boot, BOOT_WITHOUT_RANDOM, "the boot's number comes from zeroed RAM");
}

/// Until the voltage of its core is valid, the part permits no write to the RAM (RM0433 6.4.1): neither the boot loader nor a firmware
/// that starts without it writes a word before that.
#[test]
fn nothing_writes_the_ram_before_the_cores_voltage_is_valid() {
    /// Power controller: its status, and the bit that the voltage is valid (ACTVOSRDY).
    const STATUS: u64 = 0x5802_4804;
    const VALID: u32 = 1 << 13;
    /// The time of an instruction, ns, and the number of instructions to watch: ten times as many as the emulated part's regulator takes.
    const INSTRUCTION: u64 = 10;
    const INSTRUCTIONS: usize = 10_000;
    const GARBAGE: u8 = 0xA5;
    for boot_address in [PartSetup::default().boot_address, IMAGE_START] {
        let settings = EmulationSettings {
            // The run first stops after this interval, before the regulator is ready.
            plant_interval: US,
            part: PartSetup {
                boot_address,
                ..PartSetup::default()
            },
            ..EmulationSettings::default()
        };
        let garbage: Vec<_> = RAM.iter().map(|(at, bytes)| (*at, vec![GARBAGE; *bytes])).collect();
        let bench = Box::new(BenchVehicle::new(BATTERY_V));
        let mut emulation = Emulation::power_on_with(firmware(), bench, settings, &garbage).expect("it powers up");
        let mut valid = || {
            let status = emulation.at(|stopped| stopped.register(STATUS)).expect("it runs");
            let valid = status.expect("a register") & VALID != 0;
            if !valid {
                emulation.run_for(INSTRUCTION).expect("it runs");
            }
            valid
        };
        assert!(!valid(), "the part is in Run* after a power-on");
        let waited = (0..INSTRUCTIONS).find(|_| valid());
        assert!(
            waited.is_some(),
            "{boot_address:#x}: nothing configures the core's supply"
        );
        for (at, bytes) in RAM {
            let words = emulation.at(move |stopped| stopped.read_block(at, bytes));
            let words = words.expect("it runs").expect("it is memory");
            let written = words.iter().position(|byte| *byte != GARBAGE);
            assert_eq!(
                written, None,
                "{boot_address:#x}: a byte of {at:#x} is written too early"
            );
        }
    }
}

/// Without the external clock the board runs from its own oscillator, at the same rates, reports that, and arms.
#[test]
fn without_the_external_clock_the_board_runs_from_its_own() {
    let mut board = powered_part(
        PartSetup {
            external_clock: false,
            ..PartSetup::default()
        },
        &[],
    );
    board.run(800);
    assert!(log_has(
        &mut board,
        "no external clock: the board runs from its own oscillator"
    ));
    assert_eq!(board.status().clock, ClockSource::Internal);
    let before = board.status().vehicle.tick;
    board.run(3000);
    let ticks = board.status().vehicle.tick - before;
    // The emulated part's own oscillator is exact; a status comes every 10 ms.
    assert!((2989..=3011).contains(&ticks), "{ticks} ticks in 3 s");
    board.arm();
}

#[test]
fn with_the_external_clock_the_status_says_so() {
    let mut board = ready();
    board.run(100);
    assert_eq!(board.status().clock, ClockSource::External);
}

/// The address of the interrupt handler of the tasks' clock, which runs within a tick.
fn handler() -> u64 {
    firmware().symbol("TIM5").expect("the firmware has it").0 & !1
}

/// Thumb: `movw r0, #0xED04; movt r0, #0xE000; mov r1, #0x80000000; str r1, [r0]; b .`: pends the non-maskable interrupt, which the
/// emulated part's clock monitor does not.
const PEND_NMI: [u8; 16] = [
    0x4E, 0xF6, 0x04, 0x50, 0xCE, 0xF2, 0x00, 0x00, 0x4F, 0xF0, 0x00, 0x41, 0x01, 0x60, 0xFE, 0xE7,
];

/// The external clock stops while the vehicle is armed: the bridges are open before any instruction runs, and the
/// non-maskable interrupt ends the run with a message.
#[test]
fn a_clock_that_stops_opens_the_bridges() {
    let mut board = ready();
    board.arm();
    let before = board
        .emulation
        .at(|stopped| {
            let before = stopped.read(handler(), PEND_NMI.len())?;
            stopped.write(handler(), &PEND_NMI)?;
            Ok::<_, board_emulator::Error>(before)
        })
        .expect("it runs")
        .expect("flash can be patched");
    board.act(|board, now| board.fail_external_clock(now));
    board.emulation.run_for(10 * US).expect("it runs");
    assert!(open(&mut board));
    let mut resets = Vec::new();
    for _ in 0..50 {
        board.emulation.run_for(MS / 2).expect("it runs");
        assert!(open(&mut board));
        resets = board.emulation.at(|stopped| stopped.resets()).expect("it runs");
        if !resets.is_empty() {
            break;
        }
    }
    assert!(!resets.is_empty(), "the interrupt ends the run");
    // Restored before the boot loader reads it, because the boot loader does not start a changed image.
    board
        .emulation
        .at(move |stopped| stopped.write(handler(), &before))
        .expect("it runs")
        .expect("flash can be patched");
    for _ in 0..50 {
        board.emulation.run_for(20 * MS).expect("it runs");
        assert!(open(&mut board));
    }
    assert!(log_has(&mut board, "the last run ended: the external clock stopped"));
}

/// A break that shows only in the system's flag is latched like any other.
#[test]
fn a_supply_that_falls_is_a_break_until_it_is_cleared() {
    let mut board = ready();
    board.arm();
    board.act(|board, now| board.set_supply(now, 2_700));
    board.emulation.run_for(10 * US).expect("it runs");
    assert!(open(&mut board));
    board.run(50);
    assert_eq!(board.status().vehicle.mode, Mode::Disarmed);
    assert!(board.status().vehicle.faults.contains(Fault::BridgeBreak));
    board.act(|board, now| board.set_supply(now, 3_300));
    board.run(50);
    assert!(board.status().vehicle.blockers.contains(Blocker::BridgeBreak));
    board.request(Request::ClearFaults);
    // The wheels on the bench coast.
    board.run(3000);
    board.arm();
    assert!(!open(&mut board));
}

/// The supply falls for a moment while the bridges are open. No output goes off, and only the system's flag shows the break. On the
/// part, the flag must be cleared before the outputs can be enabled again (RM0433 38.4.5).
#[test]
fn a_systems_break_blocks_arming_until_it_is_cleared() {
    /// Status registers of TIM1 and TIM8, and their flag of the system's break (SBIF).
    const STATUS: [u64; 2] = [0x4001_0010, 0x4001_0410];
    const SYSTEM_BREAK: u32 = 1 << 13;
    let mut board = ready();
    let flags = |board: &mut Operator| {
        STATUS.map(|register| {
            let status = board.emulation.at(move |stopped| stopped.register(register));
            status.expect("it runs").expect("the register answers") & SYSTEM_BREAK
        })
    };
    board.act(|board, now| board.set_supply(now, 2_700));
    board.run(50);
    board.act(|board, now| board.set_supply(now, 3_300));
    board.run(50);
    assert_eq!(flags(&mut board), [SYSTEM_BREAK; 2]);
    board.command = Some((0.0, 0.0));
    board.run(100);
    board.request(Request::Arm);
    let status = &board.status().vehicle;
    assert_eq!(status.mode, Mode::Disarmed);
    assert_eq!(status.blockers.iter().collect::<Vec<_>>(), [Blocker::BridgeBreak]);
    board.request(Request::ClearFaults);
    assert_eq!(flags(&mut board), [0; 2]);
    board.arm();
    assert!(!open(&mut board));
}

/// Every encoder's input has the filter whose time the firmware's library states, and the inputs that an unplugged cable
/// leaves open have their pull-ups: encoders, the IMUs' answers, the link.
#[test]
fn the_inputs_are_filtered_and_pulled() {
    const EIGHT_SAMPLES_OF_32_PERIODS: u64 = 0xF0F0;
    /// Ports with the pins that are pulled up.
    const PULLED_UP: [(u64, &[u32]); 6] = [
        (0x5802_0000, &[15, 6, 8]),
        (0x5802_0400, &[3]),
        (0x5802_0800, &[6, 7]),
        (0x5802_0C00, &[12, 13, 9]),
        (0x5802_1000, &[5, 15]),
        (0x5802_1800, &[2]),
    ];
    const PULLS: u64 = 0x0C;
    assert_eq!(FILTER_NS, 8 * 32 * 5);
    let mut board = ready();
    let filters = board
        .emulation
        .at(|stopped| [0, 1, 2].map(|nth| stopped.board().part().encoder_filters(nth)));
    assert_eq!(filters.expect("it runs"), [EIGHT_SAMPLES_OF_32_PERIODS; 3]);
    for (port, pins) in PULLED_UP {
        let pulls = board.emulation.at(move |stopped| stopped.register(port + PULLS));
        let pulls = pulls.expect("it runs").expect("the register answers");
        for pin in pins {
            assert_eq!(pulls >> (2 * pin) & 3, 1, "port {port:#x}, pin {pin}");
        }
    }
}

/// A second contact that is welded shut shows at the first press, and stays reported until faults are cleared.
#[test]
fn contacts_that_disagree_are_told_until_faults_are_cleared() {
    let mut board = ready();
    board.act(|board, now| {
        board.weld_second_contact();
        board.set_stop(now, true);
    });
    board.run(50);
    assert!(
        !board.status().vehicle.blockers.contains(Blocker::StopContacts),
        "the status reports a disagreement after 50 ms"
    );
    board.run(150);
    assert!(board.status().vehicle.blockers.contains(Blocker::StopContacts));
    board.act(|board, now| board.set_stop(now, false));
    board.run(300);
    assert!(
        board.status().vehicle.blockers.contains(Blocker::StopContacts),
        "the report ends without ClearFaults"
    );
    board.request(Request::ClearFaults);
    assert!(!board.status().vehicle.blockers.contains(Blocker::StopContacts));
}

/// The stop may be pressed while the board boots: its self-test needs no contact.
#[test]
fn each_item_of_the_self_test_is_logged() {
    let mut board = powered_part(PartSetup::default(), &[]);
    board.act(|board, now| board.set_stop(now, true));
    board.run(300);
    for item in ["BreakPath", "BoardOptions", "PartRevision", "Image", "Unsealed", "Ram"] {
        assert!(
            log_has(&mut board, &format!("self-test: {item} passed")),
            "{item}: {:#?}",
            board.log()
        );
    }
    assert!(log_has(&mut board, "self-test: silicon revision 0x2003"));
}

/// The board reports each item that fails, and that item alone blocks arming.
#[test]
fn each_item_of_the_self_test_blocks_arming() {
    let good = PartSetup::default();
    let brown_out = |brown_out_level| PartSetup {
        brown_out_level,
        ..good
    };
    let revision = |revision| PartSetup { revision, ..good };
    let swapped = PartSetup {
        banks_swapped: true,
        ..good
    };
    for (part, blocker) in [
        (brown_out(0), Blocker::BoardOptions),
        (brown_out(2), Blocker::BoardOptions),
        (swapped, Blocker::BoardOptions),
        (revision(0x1003), Blocker::PartRevision),
        (revision(0x2001), Blocker::PartRevision),
    ] {
        let mut board = powered_part(part, &[]);
        println!("{part:?}");
        blocks_alone(&mut board, blocker);
    }
}

/// A sector that firmware or boot loader writes is protected, one of every kind: in bank 1 the running image's first and last, in
/// bank 2 those of the arrived image, the kept image, the fault history and the parameters.
#[test]
fn a_protected_sector_that_is_written_blocks_arming() {
    for writable_sectors in [
        [0xFD, 0xFF],
        [0xFB, 0xFF],
        [0xFF, 0xFE],
        [0xFF, 0xFB],
        [0xFF, 0xEF],
        [0xFF, 0xBF],
        [0xFF, 0x7F],
    ] {
        let part = PartSetup {
            writable_sectors,
            ..PartSetup::default()
        };
        println!("{writable_sectors:#04x?}");
        blocks_alone(&mut powered_part(part, &[]), Blocker::BoardOptions);
    }
}

/// Each of the three breaks of the bridges' timers does nothing when the self-test triggers it.
#[test]
fn a_break_that_does_nothing_blocks_arming() {
    for (timer, nth) in [(0, 0), (1, 0), (1, 1)] {
        let part = PartSetup {
            deaf_break: Some(BridgeBreak { timer, nth }),
            ..PartSetup::default()
        };
        println!("{:?}", part.deaf_break);
        blocks_alone(&mut powered_part(part, &[]), Blocker::BreakPath);
    }
}
