//! The emergency stop and the watchdog, with and without a working CPU.

use board_emulator::board::BridgeOutput;
use board_emulator::run::Emulation;
use board_emulator::time::{MS, US};
use model::supervise::arming::Mode;
use model::supervise::codes::Fault;

use crate::support::{Operator, firmware, ready};

/// Thumb `b .`: an endless loop in one instruction.
const ENDLESS_LOOP: [u8; 2] = [0xFE, 0xE7];

fn open(bridges: [BridgeOutput; 3]) -> bool {
    bridges == [BridgeOutput::Open; 3]
}

fn switching(bridges: [BridgeOutput; 3]) -> bool {
    bridges
        .iter()
        .all(|bridge| bridge.duty().is_some() && bridge.never_open())
}

fn bridges(emulation: &mut Emulation) -> [BridgeOutput; 3] {
    emulation.at(|stopped| stopped.bridges()).expect("it runs")
}

/// Puts an endless loop at the start of a function of the firmware; returns the function's address and the replaced bytes.
fn hang(emulation: &mut Emulation, function: &str) -> (u64, Vec<u8>) {
    patch(emulation, function, ENDLESS_LOOP)
}

/// Puts an instruction at the start of a function of the firmware; returns the function's address and the replaced bytes.
fn patch(emulation: &mut Emulation, function: &str, instruction: [u8; 2]) -> (u64, Vec<u8>) {
    let address = firmware().symbol(function).expect("the firmware has it").0 & !1;
    let before = emulation
        .at(move |stopped| {
            let before = stopped.read(address, instruction.len())?;
            stopped.write(address, &instruction)?;
            Ok::<_, board_emulator::Error>(before)
        })
        .expect("it runs")
        .expect("flash can be patched");
    (address, before)
}

#[test]
fn the_stop_opens_the_bridges_in_10_us_with_the_cpu_in_an_endless_loop() {
    let mut board = ready();
    board.arm();
    assert!(switching(bridges(&mut board.emulation)));
    // The task clock's interrupt has the highest priority, so it starves everything else.
    hang(&mut board.emulation, "TIM5");
    board.emulation.run_for(3 * MS).expect("it runs");
    let stuck = board.emulation.at(|stopped| stopped.instructions()).expect("it runs");
    assert!(stuck > 0);
    assert!(
        switching(bridges(&mut board.emulation)),
        "a hung CPU alone stops the timer"
    );

    let pressed_at = board.emulation.now();
    board
        .emulation
        .at(|stopped| {
            let (board, now) = stopped.board_now();
            board.set_stop(now, true);
        })
        .expect("it runs");
    let opened = first_open(&mut board, pressed_at, 20 * US, US / 10);
    println!("bridges open {} ns after the press", opened - pressed_at);
    assert!(opened - pressed_at <= 10 * US, "{} ns", opened - pressed_at);
}

#[test]
fn the_stops_first_contact_alone_disarms_within_a_tick() {
    let mut board = ready();
    board.arm();
    let pressed_at = board.emulation.now();
    board
        .emulation
        .at(|stopped| {
            let (board, now) = stopped.board_now();
            board.set_stop_contact(now, true);
        })
        .expect("it runs");
    let opened = first_open(&mut board, pressed_at, 5 * MS, 20 * US);
    println!("bridges open {} us after the press", (opened - pressed_at) / US);
    // One tick, and the time for which a tick may wait for the IMU.
    assert!(opened - pressed_at <= 1500 * US, "{} us", (opened - pressed_at) / US);
    board.run(50);
    assert_eq!(board.status().vehicle.mode, Mode::Disarmed);
    assert!(board.status().vehicle.faults.contains(Fault::EmergencyStop));
}

/// The board's button disarms, which is no fault; the board reads it every 20 ms.
#[test]
fn the_boards_button_disarms_within_two_of_its_looks() {
    let mut board = ready();
    board.arm();
    board.act(|board, now| board.set_button(now, true));
    board.emulation.run_for(42 * MS).expect("it runs");
    assert!(open(bridges(&mut board.emulation)));
    board.act(|board, now| board.set_button(now, false));
    board.run(50);
    let vehicle = board.status().vehicle;
    assert_eq!(vehicle.mode, Mode::Disarmed);
    assert!(vehicle.faults.is_empty(), "{}", vehicle.faults);
}

#[test]
fn a_driver_fault_stays_open_until_it_is_cleared() {
    let mut board = ready();
    board.arm();
    for fault in [true, false] {
        board
            .emulation
            .at(move |stopped| {
                let (board, now) = stopped.board_now();
                board.set_driver_fault(now, fault);
            })
            .expect("it runs");
        board.run(20);
        assert!(
            open(bridges(&mut board.emulation)),
            "the bridges close once the fault is gone"
        );
    }
    assert!(board.status().vehicle.faults.contains(Fault::BridgeBreak));
    assert_eq!(board.status().vehicle.mode, Mode::Disarmed);
}

/// Undoes a patch and runs for a second, in which the part starts and its bridges must stay open; returns the log.
fn mended(board: &mut Operator, address: u64, before: Vec<u8>) -> Vec<String> {
    board
        .emulation
        .at(move |stopped| stopped.write(address, &before))
        .expect("it runs")
        .expect("flash can be patched");
    for _ in 0..100 {
        board.emulation.run_for(10 * MS).expect("it runs");
        assert!(open(bridges(&mut board.emulation)));
    }
    let log = board.log();
    assert!(log.iter().any(|line| line.contains("self-check done")), "{log:#?}");
    log
}

/// A hung control task, and a hang of everything: the watchdog resets the part within 40 ms, the bridges stay open,
/// and the log names the cause.
#[test]
fn the_watchdog_resets_a_hung_part() {
    // The interrupt of the control tasks, and the clock of all tasks.
    for function in ["UART5", "TIM5"] {
        let mut board = ready();
        let hung_at = board.emulation.now();
        let (address, before) = hang(&mut board.emulation, function);
        let mut reset_at = None;
        for _ in 0..60 {
            board.emulation.run_for(MS).expect("it runs");
            assert!(open(bridges(&mut board.emulation)));
            let resets = board.emulation.at(|stopped| stopped.resets()).expect("it runs");
            if let Some((at, cause)) = resets.first() {
                assert!(cause.contains("IWDG"), "{cause}");
                reset_at = Some(*at);
                break;
            }
        }
        let reset_at = reset_at.expect("the watchdog resets the part");
        println!("{function} hung: reset after {} us", (reset_at - hung_at) / US);
        assert!(reset_at - hung_at <= 40 * MS);
        assert!(reset_at - hung_at >= 10 * MS, "one late tick causes a reset");

        let log = mended(&mut board, address, before);
        assert!(log.iter().any(|line| line.contains("reset by watchdog")), "{log:#?}");
        let resets = board.emulation.at(|stopped| stopped.resets()).expect("it runs");
        assert_eq!(resets.len(), 1, "the part is not reset again: {resets:?}");
    }
}

/// Everything hangs while the vehicle is armed: the bridges are open from the reset on.
#[test]
fn a_part_that_hangs_while_driving_is_safe_within_40_ms() {
    let mut board = ready();
    board.arm();
    let hung_at = board.emulation.now();
    hang(&mut board.emulation, "TIM5");
    let opened = first_open(&mut board, hung_at, 60 * MS, MS / 4);
    println!("bridges open {} us after the hang", (opened - hung_at) / US);
    assert!(opened - hung_at <= 40 * MS);
}

/// Thumb `udf #0`, which faults.
const UNDEFINED: [u8; 2] = [0x00, 0xDE];

/// An undefined instruction while the vehicle is armed: the bridges open at once, and the next run reports the fault.
#[test]
fn a_fault_opens_the_bridges_and_its_message_outlives_the_reset() {
    let mut board = ready();
    board.arm();
    let faulted_at = board.emulation.now();
    let (address, before) = patch(&mut board.emulation, "TIM5", UNDEFINED);
    // The clock's next interrupt is at most a tick away.
    let opened = first_open(&mut board, faulted_at, 5 * MS, 20 * US);
    println!("bridges open {} us after the patch", (opened - faulted_at) / US);
    assert!(opened - faulted_at <= 1100 * US);
    // The firmware itself opens the bridges: the reset, which would open them too, comes only after the message is written.
    let mut resets = board.emulation.at(|stopped| stopped.resets()).expect("it runs");
    assert_eq!(resets, [], "the bridges open only with the reset");
    while resets.is_empty() && board.emulation.now() < opened + 5 * MS {
        board.emulation.run_for(100 * US).expect("it runs");
        resets = board.emulation.at(|stopped| stopped.resets()).expect("it runs");
    }
    let [(_, cause)] = resets.as_slice() else {
        panic!("one reset: {resets:?}");
    };
    assert!(cause.contains("Core"), "{cause}");

    let log = mended(&mut board, address, before);
    let report = format!("the last run ended: hard fault at {address:#010x}");
    assert!(log.iter().any(|line| line.contains(&report)), "{report}: {log:#?}");
    assert!(log.iter().any(|line| line.contains("reset by software")), "{log:#?}");

    // Reported once: the run before the next reset did not end in a fault.
    let lines = log.len();
    board.emulation.at(|stopped| stopped.reset_by_pin()).expect("it runs");
    board.run(500);
    let log = board.log();
    assert!(log.len() > lines, "{log:#?}");
    let again = log.iter().skip(lines).find(|line| line.contains("the last run ended"));
    assert_eq!(again, None);
}

/// Runs in steps until the bridges are open; returns the instant in ns at the end of that step.
fn first_open(board: &mut Operator, from: u64, within: u64, step: u64) -> u64 {
    while board.emulation.now() < from + within {
        board.emulation.run_for(step).expect("it runs");
        if open(bridges(&mut board.emulation)) {
            return board.emulation.now();
        }
    }
    panic!("the bridges are not open {within} ns later");
}
