//! Power-up until the board is ready to arm.

use board_emulator::board::{BridgeOutput, INSTRUCTIONS_PER_SECOND, gaps};
use board_emulator::time::MS;

use crate::support::{Operator, READY, powered};

/// Longest time from the start of the clock to the line that reports the end of the self-check, in ms: the check of the
/// image, 192 KiB at 25 instructions per byte; the IMUs' start; the calibration's 500 ticks; the log task's period.
const READY_WITHIN_MS: f64 = 192.0 * 1024.0 * 25.0 / INSTRUCTIONS_PER_MS + 50.0 + 500.0 + 50.0;
/// Longest time from the reset to the start of the firmware's clock, in ms: the boot loader zeroes the DTCM and checks the image,
/// 256 KiB at 25 instructions per byte; the test of the RAM, 640 KiB at 4 instructions per byte.
const CLOCK_WITHIN_MS: f64 = (256.0 * 25.0 + 640.0 * 4.0) * 1024.0 / INSTRUCTIONS_PER_MS;
/// Instructions that the emulated core retires in a millisecond.
const INSTRUCTIONS_PER_MS: f64 = INSTRUCTIONS_PER_SECOND as f64 / 1000.0;

#[test]
fn the_board_boots_says_so_and_keeps_its_bridges_open() {
    let mut board = Operator::new(powered());
    let mut connected_at = None;
    // In steps of half a millisecond through the start-up code, then of 10 ms.
    while board.emulation.now() < READY {
        let step = if board.emulation.now() < 20 * MS {
            MS / 2
        } else {
            10 * MS
        };
        board.emulation.run_for(step).expect("it runs");
        let (now, bridges, connected) = board
            .emulation
            .at(|stopped| {
                (
                    stopped.now(),
                    stopped.bridges(),
                    stopped.board().bridge_pins_connected(),
                )
            })
            .expect("it runs");
        assert_eq!(bridges, [BridgeOutput::Open; 3], "at {now} ns");
        if connected && connected_at.is_none() {
            connected_at = Some(now);
        }
    }
    assert!(connected_at.is_some(), "the bridges' pins never go to their timer");

    let log = board.log();
    let line = |text: &str| {
        log.iter()
            .find(|line| line.contains(text))
            .unwrap_or_else(|| panic!("no `{text}` in {log:#?}"))
    };
    line("biplanar drive board");
    line("reset by power-on");
    line("arm IMU: started");
    line("spar IMU: started");
    let done = line("self-check done");
    let seconds: f64 = done
        .split_whitespace()
        .next()
        .expect("a time")
        .parse()
        .expect("a number");
    assert!((100.0..READY_WITHIN_MS).contains(&(seconds * 1e3)), "{done}");
    assert!(
        !log.iter().any(|line| line.contains("WARN") || line.contains("ERROR")),
        "{log:#?}"
    );

    let (found, resets, clock_start) = board
        .emulation
        .at(|stopped| (stopped.gaps(), stopped.resets(), stopped.clock_start()))
        .expect("it runs");
    let clock_ms = clock_start as f64 / MS as f64;
    println!("the firmware's clock runs {clock_ms:.1} ms after the reset");
    assert!((1.0..CLOCK_WITHIN_MS).contains(&clock_ms), "{clock_ms}");
    assert_eq!(gaps::unexpected(&found), [], "allowed: {:#?}", gaps::ALLOWED);
    // A gap that no longer occurs must leave the list.
    for allowed in gaps::ALLOWED {
        assert!(
            found
                .iter()
                .any(|gap| gap.kind == allowed.kind && gap.place == allowed.place),
            "{allowed:?} is allowed and does not occur"
        );
    }
    assert_eq!(resets, []);
}

/// The clock tree as the part's registers show it: 400 MHz from the debugger's clock.
#[test]
fn the_clock_tree_is_as_designed() {
    const RCC: u64 = 0x5802_4400;
    let mut board = Operator::new(powered());
    board.emulation.run_until(READY).expect("it runs");
    let read = |offset: u64| board.emulation.at(move |stopped| stopped.register(RCC + offset));
    let mut read = read;
    let mut register = |offset| read(offset).expect("it runs").expect("the register answers");
    // CFGR: PLL1 drives the core (SW and SWS 3).
    assert_eq!(register(0x10) & 0x3F, 0b01_1011);
    // CR: HSE on, ready and bypassed; PLL1 on and ready.
    assert_eq!(register(0x00) & 0x0307_0000, 0x0307_0000);
    // PLLCKSELR: HSE, divided by 2; PLL1DIVR: times 200 (0xC7 + 1), P by 2 (1 + 1).
    assert_eq!(register(0x28) & 0x3F3, 2 << 4 | 2);
    assert_eq!(register(0x30) & 0xFFFF, 1 << 9 | 0xC7);
    // D1CFGR: core and D1 bus undivided / halved: HPRE 2, D1CPRE 1.
    assert_eq!(register(0x18) & 0xF0F, 0b1000);
}
