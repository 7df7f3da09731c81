//! The bridges' two timers: their output on the lines, and that neither drives without the other.

use board_emulator::board::BridgeOutput;
use board_emulator::time::{MS, US};
use model::command::Request;
use model::supervise::arming::Mode;
use model::supervise::codes::{Blocker, Fault};

use crate::support::{Operator, open, ready};

/// Break registers of TIM1 and TIM8, and their main output enable.
const BREAK_REGISTERS: [u64; 2] = [0x4001_0044, 0x4001_0444];
const MAIN_OUTPUT_ENABLE: u32 = 1 << 15;
/// Bridges of each timer.
const BRIDGES: [&[usize]; 2] = [&[0, 1], &[2]];
/// A tick, and the time for which a tick waits for the IMU, in ns.
const TICK_AND_WAIT: u64 = 1500 * US;
/// One period at 20 kHz, in ns.
const PERIOD_NS: u64 = 50_000;

fn bridges(board: &mut Operator) -> [BridgeOutput; 3] {
    board.emulation.at(|stopped| stopped.bridges()).expect("it runs")
}

fn register(board: &mut Operator, address: u64) -> u32 {
    let value = board.emulation.at(move |stopped| stopped.register(address));
    value.expect("it runs").expect("the register answers")
}

fn write(board: &mut Operator, address: u64, value: u32) {
    let written = board
        .emulation
        .at(move |stopped| stopped.write_register(address, value));
    written.expect("it runs").expect("the register takes it");
}

/// Runs in steps until the bridges are open; returns how long that took, in ns.
fn opens_within(board: &mut Operator, within: u64, step: u64) -> u64 {
    let from = board.emulation.now();
    while board.emulation.now() < from + within {
        board.emulation.run_for(step).expect("it runs");
        if open(board) {
            return board.emulation.now() - from;
        }
    }
    panic!("the bridges are not open {within} ns later");
}

/// While the vehicle is armed, each bridge alternates between driving and braking 20,000 times per second, and is never open,
/// whichever way it drives.
#[test]
fn an_armed_bridge_drives_and_brakes_and_is_never_open() {
    let mut board = ready();
    board.arm();
    let mut driven = [[0_u32; 2]; 3];
    for command in [0.5, -0.5] {
        board.command = Some((command, 0.0));
        for _ in 0..40 {
            board.run(10);
            for (n, bridge) in bridges(&mut board).into_iter().enumerate() {
                assert!(bridge.never_open(), "{n}: {bridge:?}");
                let BridgeOutput::Switching {
                    forward_ns,
                    reverse_ns,
                    brake_ns,
                    period_ns,
                } = bridge
                else {
                    panic!("{n}: {bridge:?}");
                };
                assert_eq!(period_ns, PERIOD_NS);
                assert!(forward_ns == 0 || reverse_ns == 0, "{n}: {bridge:?}");
                // The largest duty leaves 6 % of the period.
                assert!(brake_ns >= 3_000 - 5, "{n}: {bridge:?}");
                driven[n][0] += u32::from(forward_ns > 0);
                driven[n][1] += u32::from(reverse_ns > 0);
            }
        }
    }
    println!("samples that drove forward, in reverse: {driven:?}");
    let torn = board.emulation.at(|stopped| stopped.board().part().unheld_writes());
    assert_eq!(
        torn.expect("it runs"),
        0,
        "for a period, a pair of lines could mix the duties of two ticks, and both lines be low"
    );
    for [forward, reverse] in &driven[..2] {
        assert!(*forward > 0 && *reverse > 0, "both ways: {driven:?}");
    }
}

/// The outputs of a timer go off without a flag: the board switches the other timer's outputs off within a tick, and the vehicle
/// does not stay armed with dead bridges.
#[test]
fn outputs_that_are_off_disarm_within_a_tick() {
    for (nth, address) in BREAK_REGISTERS.into_iter().enumerate() {
        let mut board = ready();
        board.arm();
        let value = register(&mut board, address);
        write(&mut board, address, value & !MAIN_OUTPUT_ENABLE);
        let now = bridges(&mut board);
        for (n, bridge) in now.into_iter().enumerate() {
            assert_eq!(
                bridge == BridgeOutput::Open,
                BRIDGES[nth].contains(&n),
                "timer {nth}, bridge {n}"
            );
        }
        let took = opens_within(&mut board, 5 * MS, 20 * US);
        println!("timer {nth}: every bridge is open {} us later", took / US);
        assert!(took <= TICK_AND_WAIT, "timer {nth}: {} us", took / US);
        for _ in 0..100 {
            board.emulation.run_for(100 * US).expect("it runs");
            assert!(open(&mut board), "the outputs come on again");
        }
        board.run(50);
        assert_eq!(board.status().vehicle.mode, Mode::Disarmed);
        assert!(board.status().vehicle.faults.contains(Fault::BridgeBreak));
    }
}

/// Once start-up has set the breaks, no write changes them, or the outputs' off state, until a reset.
#[test]
fn no_write_changes_the_breaks() {
    /// Dead time, off states, both breaks with their polarities and filters, automatic output.
    const LOCKED: u32 = 0xFF | 3 << 10 | 1 << 12 | 1 << 13 | 1 << 14 | 0xF << 16 | 0xF << 20 | 1 << 24 | 1 << 25;
    /// Off states driven; first break enabled, active high.
    const FIRST: u32 = 3 << 10 | 1 << 12 | 1 << 13;
    /// Second break enabled, active high.
    const SECOND: u32 = 1 << 24 | 1 << 25;
    let mut board = ready();
    for (address, expected) in BREAK_REGISTERS.into_iter().zip([FIRST, FIRST | SECOND]) {
        let before = register(&mut board, address);
        assert_eq!(before & LOCKED, expected, "{address:#x}: unfiltered, no dead time");
        write(&mut board, address, !before & !MAIN_OUTPUT_ENABLE);
        assert_eq!(register(&mut board, address) & LOCKED, expected, "{address:#x}");
    }
}

/// The break input of a timer is shorted to ground. A driver's fault opens the other timer's bridges in hardware, and the
/// task opens the rest within a tick.
#[test]
fn a_break_input_that_is_shorted_opens_within_a_tick() {
    for nth in [0, 1] {
        let mut board = ready();
        board.arm();
        board.act(move |board, now| {
            board.ground_break(now, nth);
            board.set_driver_fault(now, true);
        });
        for (n, bridge) in bridges(&mut board).into_iter().enumerate() {
            let shorted = BRIDGES[nth].contains(&n);
            assert_eq!(bridge != BridgeOutput::Open, shorted, "input {nth}, bridge {n}");
        }
        let took = opens_within(&mut board, 5 * MS, 20 * US);
        println!("input {nth}: every bridge is open {} us later", took / US);
        assert!(took <= TICK_AND_WAIT, "input {nth}: {} us", took / US);
        board.run(50);
        assert!(board.status().vehicle.faults.contains(Fault::BridgeBreak));
    }
}

/// One timer's break trips while the other timer's input is shorted to ground. A disarmed vehicle reports the break and does not arm
/// until the cause has gone and the faults are cleared.
#[test]
fn each_timers_own_break_blocks_until_it_is_cleared() {
    for shorted in [0, 1] {
        let mut board = ready();
        board.run(100);
        assert!(!board.status().vehicle.blockers.contains(Blocker::BridgeBreak));
        board.act(move |board, now| {
            board.ground_break(now, shorted);
            board.set_driver_fault(now, true);
        });
        board.run(50);
        assert!(
            board.status().vehicle.blockers.contains(Blocker::BridgeBreak),
            "the break of timer {} alone",
            1 - shorted
        );
        board.act(|board, now| board.set_driver_fault(now, false));
        board.run(50);
        assert!(
            board.status().vehicle.blockers.contains(Blocker::BridgeBreak),
            "latched"
        );
        board.request(Request::ClearFaults);
        assert!(!board.status().vehicle.blockers.contains(Blocker::BridgeBreak));
        board.arm();
        assert!(bridges(&mut board).iter().all(|bridge| bridge.never_open()));
    }
}

/// The first press of the emergency stop reveals a break input that is shorted to ground, like a contact that is welded shut.
#[test]
fn a_break_input_that_is_shorted_is_told() {
    for nth in [0, 1] {
        let mut board = ready();
        board.act(move |board, now| {
            board.ground_break(now, nth);
            board.set_stop(now, true);
        });
        board.run(200);
        assert!(
            board.status().vehicle.blockers.contains(Blocker::StopContacts),
            "input {nth}"
        );
    }
}

/// A line from the board to a drive motor's bridge breaks. Its pull-down turns every brake into the drive of the other line, with up
/// to the whole supply in the wrong direction. The current shows this, and the bridges open.
#[test]
fn a_broken_line_to_a_bridge_opens_the_bridges() {
    /// The current rises within the motor's electrical time constant, the fault takes three ticks, the analogue reading is
    /// half a tick old and a tick old at most when it counts, and the tick itself may wait for the IMU.
    const WITHIN: u64 = 6 * MS;
    for (motor, input) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
        let mut board = ready();
        board.arm();
        board.act(move |board, _| board.cut_line(motor, input));
        let took = opens_within(&mut board, WITHIN, 100 * US);
        println!("motor {motor}, IN{}: open {} us later", input + 1, took / US);
        board.run(50);
        assert_eq!(board.status().vehicle.mode, Mode::Disarmed);
        assert!(board.status().vehicle.faults.contains(Fault::Overcurrent));
    }
}
