//! The firmware's log when its reader is gone.

use board_emulator::run::{Emulation, EmulationSettings};
use board_emulator::time::MS;
use board_emulator::vehicle::BenchVehicle;
use model::supervise::arming::Mode;

use crate::support::{BATTERY_V, Operator, READY, firmware};

/// Offsets into the RTT control block of up-channel 0's size, of the two offsets into its buffer, and of its
/// mode: after the identifier (16 bytes), the two channel counts, the channel's name and its buffer.
const SIZE: u64 = 32;
const WRITE: u64 = 36;
const READ: u64 = 40;
const MODE: u64 = 44;
/// "Block if full": the mode that a debugger's log reader sets when it attaches.
const BLOCK_IF_FULL: u32 = 2;
/// How long the vehicle drives without a reader, in ms: time for a log line or two, each of which could block.
const DRIVEN_MS: u64 = 1500;
/// Distance of the reader ahead of the writer, in bytes: no room, room for the beginning of a line, and room for some lines.
const ROOMS: [u32; 3] = [1, 12, 100];

/// A log reader attached, set the channel to block, and was unplugged: the buffer is full and nobody drains it. The
/// vehicle drives on.
#[test]
fn a_full_log_in_blocking_mode_stops_nothing() {
    let settings = EmulationSettings {
        // Nobody reads.
        log_interval: 3_600_000 * MS,
        ..EmulationSettings::default()
    };
    let emulation = Emulation::power_on(firmware(), Box::new(BenchVehicle::new(BATTERY_V)), settings);
    let mut board = Operator::new(emulation.expect("the board powers up"));
    board.emulation.run_until(READY).expect("it runs");

    board.arm();
    for room in ROOMS {
        drives_on_with(&mut board, room);
    }
    let resets = board.emulation.at(|stopped| stopped.resets()).expect("it runs");
    assert_eq!(resets, []);
}

fn drives_on_with(board: &mut Operator, room: u32) {
    let block = firmware().rtt_block();
    let written = board
        .emulation
        .at(move |stopped| {
            let size = stopped.read_word(block + SIZE)?;
            let write = stopped.read_word(block + WRITE)?;
            stopped.write(block + READ, &((write + room) % size).to_le_bytes())?;
            stopped.write(block + MODE, &BLOCK_IF_FULL.to_le_bytes())?;
            Ok::<_, board_emulator::Error>(write)
        })
        .expect("it runs")
        .expect("the control block is in RAM");

    let before = *board.status();
    board.run(DRIVEN_MS);
    let after = *board.status();
    assert_eq!(after.vehicle.mode, Mode::Armed, "faults {}", after.vehicle.faults);
    let ticks = u64::from(after.vehicle.tick - before.vehicle.tick);
    assert!(
        (DRIVEN_MS - 60..=DRIVEN_MS + 60).contains(&ticks),
        "{room}: {ticks} ticks"
    );
    assert_eq!(after.vehicle.late_ticks, before.vehicle.late_ticks, "{room}");

    let (mode, wrote) = board
        .emulation
        .at(move |stopped| {
            let mode = stopped.read_word(block + MODE)?;
            Ok::<_, board_emulator::Error>((mode, stopped.read_word(block + WRITE)?))
        })
        .expect("it runs")
        .expect("the control block is in RAM");
    assert_eq!(mode, BLOCK_IF_FULL, "the firmware changes the mode");
    assert_ne!(wrote, written, "the firmware stops logging");
}
