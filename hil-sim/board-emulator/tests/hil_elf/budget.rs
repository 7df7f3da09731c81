//! The cost of a tick and the depth of the stack.

use board_emulator::time::MS;
use firmware::protocol::frame::FRAME_MAX;
use model::supervise::arming::Mode;

use crate::support::{firmware, ready};

/// Budget of one tick, all stages, in instructions: 60 us, 6 % of a tick, at the cycles that the emulated core counts.
const TICK_INSTRUCTIONS_MAX: u32 = 6_000;
/// Of it the decision: law, governor, steering and levelling.
const DECIDE_INSTRUCTIONS_MAX: u64 = 3_000;
/// Cycles that the emulated core counts per instruction: 400 MHz over 100 million instructions per second.
const CYCLES_PER_INSTRUCTION: u32 = 4;
/// Word with which the start-up code fills the stack.
const PAINT: u32 = 0xCCCC_CCCC;

#[test]
fn a_tick_stays_within_its_budget() {
    let mut board = ready();
    board.arm();
    board.statuses.clear();
    board.run(5_000);
    let ticks: Vec<u32> = board
        .statuses
        .iter()
        .map(|status| status.cycles.total / CYCLES_PER_INSTRUCTION)
        .collect();
    let worst = board.status().cycles.worst / CYCLES_PER_INSTRUCTION;
    let mean = ticks.iter().sum::<u32>() / ticks.len() as u32;
    println!("instructions a tick: mean {mean}, worst since boot {worst}");
    assert!(mean > 500, "a tick does something");
    assert!(worst <= TICK_INSTRUCTIONS_MAX, "{worst}");
    assert_eq!(board.status().vehicle.late_ticks, 0);
}

/// Where the control task reads the cycle counter: at the start of a tick, and after each stage.
const STAGES: [&str; 4] = ["sense", "estimate", "decide", "actuate"];
/// Largest gap between two reads of one tick, in instructions.
const WITHIN_A_TICK: u64 = 20_000;

/// The table of docs/emulated-board.md.
#[test]
fn each_stage_is_counted() {
    let mut board = ready();
    board.arm();
    board.command = Some((0.5, 0.2));
    board
        .emulation
        .at(|stopped| stopped.keep_cycle_reads())
        .expect("it runs");
    board.run(2_000);
    assert_eq!(board.status().vehicle.mode, Mode::Armed, "it drove all the time");
    let reads = board
        .emulation
        .at(|stopped| stopped.take_cycle_reads())
        .expect("it runs");
    // The recording may begin within a tick: the first whole one follows the first long gap.
    let gap = reads.windows(2).position(|pair| pair[1] - pair[0] >= WITHIN_A_TICK);
    let whole = &reads[gap.expect("ticks lie apart") + 1..];
    let ticks: Vec<&[u64]> = whole.chunks_exact(STAGES.len() + 1).collect();
    assert!(ticks.len() > 1_900, "{}", ticks.len());
    for tick in &ticks {
        assert!(
            tick.windows(2).all(|pair| pair[1] - pair[0] < WITHIN_A_TICK),
            "the reads of one tick follow each other: {tick:?}"
        );
    }
    println!("stage      mean  worst  (instructions)");
    let mut stages_worst = [0; STAGES.len()];
    for (n, stage) in STAGES.iter().enumerate() {
        let costs: Vec<u64> = ticks.iter().map(|tick| tick[n + 1] - tick[n]).collect();
        let mean = costs.iter().sum::<u64>() / costs.len() as u64;
        let worst = costs.iter().max().copied().unwrap_or_default();
        println!("{stage:<9} {mean:>5}  {worst:>5}");
        assert!(mean > 20, "{stage} does something");
        stages_worst[n] = worst;
    }
    let [_, _, decide, _] = stages_worst;
    assert!(decide <= DECIDE_INSTRUCTIONS_MAX, "{decide}");
    let total: u64 = stages_worst.iter().sum();
    assert!(total <= u64::from(TICK_INSTRUCTIONS_MAX), "{total}");
}

#[test]
fn no_soft_float_is_linked() {
    let found = firmware()
        .functions(|name| name.starts_with("__aeabi_d") || name.starts_with("__aeabi_f"))
        .expect("the ELF has symbols");
    // The core has no instruction for conversions to and from 64-bit integers.
    let allowed = [
        "__aeabi_d2lz",
        "__aeabi_d2ulz",
        "__aeabi_l2d",
        "__aeabi_ul2d",
        "__aeabi_f2lz",
        "__aeabi_f2ulz",
    ];
    let left: Vec<_> = found
        .iter()
        .filter(|(name, ..)| !allowed.contains(&name.as_str()))
        .collect();
    assert!(left.is_empty(), "{left:?}");
}

#[test]
fn half_of_the_stack_is_never_used() {
    let (top, _) = firmware()
        .symbol("_stack_start")
        .expect("the linker's script defines it");
    let (bottom, _) = firmware().symbol("_stack_end").expect("the linker's script defines it");
    let mut board = ready();
    board.arm();
    board.command = Some((0.5, 0.2));
    board.run(1000);
    // The deepest path of the link: an overlong frame of noise.
    board.emulation.send(&[1; FRAME_MAX + 100]).expect("it runs");
    board.run(300);
    let untouched = board
        .emulation
        .at(move |stopped| {
            (bottom..top)
                .step_by(4)
                .take_while(|at| stopped.read_word(*at).is_ok_and(|word| word == PAINT))
                .count() as u64
                * 4
        })
        .expect("it runs");
    let size = top - bottom;
    println!("stack: {} of {size} bytes used", size - untouched);
    assert!(untouched < size, "the stack is filled at start-up and used");
    assert!(2 * untouched >= size, "{untouched} of {size} bytes left");
    assert!(board.emulation.now() > 1000 * MS);
}
