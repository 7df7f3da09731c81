//! The cost of a tick and the depth of the stack.

use board_emulator::run::CycleRead;
use board_emulator::time::MS;
use firmware::protocol::frame::FRAME_MAX;
use model::supervise::arming::Mode;

use crate::support::{firmware, ready};

/// Budget of one tick, all stages, in instructions of its own: 60 us, 6 % of a tick, at the cycles that the emulated core
/// counts.
const TICK_INSTRUCTIONS_MAX: u32 = 6_000;
/// The same including interrupts, which all have a higher priority: a tenth of a tick.
const INTERRUPTED_INSTRUCTIONS_MAX: u32 = 10_000;
/// The share of the decision in this budget: law, governor, steering and levelling.
const DECIDE_INSTRUCTIONS_MAX: u64 = 3_000;
/// Cycles that the emulated core counts per instruction: 400 MHz over 100 million instructions per second.
const CYCLES_PER_INSTRUCTION: u32 = 4;
/// Word with which the start-up code fills the stack.
const PAINT: u32 = 0xCCCC_CCCC;

#[test]
fn a_tick_and_what_interrupts_it_take_a_tenth_of_its_time() {
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
    assert!(worst <= INTERRUPTED_INSTRUCTIONS_MAX, "{worst}");
    assert_eq!(board.status().vehicle.late_ticks, 0);
}

/// Where the control task reads the cycle counter: at the start of a tick, and after each stage.
const STAGES: [&str; 4] = ["sense", "estimate", "decide", "actuate"];
/// Largest gap between two reads of one tick, in instructions.
const WITHIN_A_TICK: u64 = 20_000;

/// The table of docs/emulated-board.md: the cost of each stage by itself, standing and driving. A stage accesses the same number of
/// peripheral registers in every tick, most stages none. A stage with more accesses was interrupted and does not count.
#[test]
fn a_tick_stays_within_its_budget() {
    println!("stage      mean  worst  (instructions)");
    for (name, command) in [("standing", (0.0, 0.0)), ("driving", (0.5, 0.2))] {
        let mut board = ready();
        board.arm();
        board.command = Some(command);
        board
            .emulation
            .at(|stopped| stopped.keep_cycle_reads())
            .expect("it runs");
        board.run(2_000);
        assert_eq!(
            board.status().vehicle.mode,
            Mode::Armed,
            "the vehicle did not stay armed"
        );
        let reads = board
            .emulation
            .at(|stopped| stopped.take_cycle_reads())
            .expect("it runs");
        let took = |pair: &[CycleRead]| pair[1].instructions - pair[0].instructions;
        // The recording may begin within a tick. The reads of one tick follow each other closely. Between two ticks the core
        // sometimes runs long, which shows where a tick begins.
        let ticks_from = |begin: usize| reads[begin..].chunks_exact(STAGES.len() + 1);
        let follow = |tick: &[CycleRead]| tick.windows(2).all(|pair| took(pair) < WITHIN_A_TICK);
        let begins: Vec<usize> = (0..=STAGES.len())
            .filter(|begin| ticks_from(*begin).all(follow))
            .collect();
        let [begin] = begins[..] else {
            panic!("{name}: a tick could begin at several places, or at none: {begins:?}");
        };
        let ticks: Vec<&[CycleRead]> = ticks_from(begin).collect();
        assert!(ticks.len() > 1_900, "{}", ticks.len());
        let mut stages_worst = [0; STAGES.len()];
        for (n, stage) in STAGES.iter().enumerate() {
            let stages = || ticks.iter().map(|tick| &tick[n..=n + 1]);
            let accesses = |pair: &[CycleRead]| pair[1].accesses - pair[0].accesses;
            let least = stages().map(accesses).min().expect("there are ticks");
            let own = stages().filter(|pair| accesses(pair) == least);
            let costs: Vec<u64> = own.map(took).collect();
            assert!(
                4 * costs.len() > 3 * ticks.len(),
                "{name}: {stage} was interrupted in {} of {} ticks",
                ticks.len() - costs.len(),
                ticks.len()
            );
            let mean = costs.iter().sum::<u64>() / costs.len() as u64;
            let worst = costs.iter().max().copied().unwrap_or_default();
            println!("{stage:<9} {mean:>5}  {worst:>5}  {name}");
            assert!(mean > 20, "{stage} does something");
            stages_worst[n] = worst;
        }
        let [_, _, decide, _] = stages_worst;
        if command != (0.0, 0.0) {
            // Standing, the decision also probes the motors' sensors.
            assert!(decide <= DECIDE_INSTRUCTIONS_MAX, "{name}: {decide}");
        }
        let total: u64 = stages_worst.iter().sum();
        assert!(total <= u64::from(TICK_INSTRUCTIONS_MAX), "{name}: {total}");
    }
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
    let roots = firmware()
        .functions(|name| name.contains("sqrtf"))
        .expect("the ELF has symbols");
    assert!(
        roots.is_empty(),
        "the part has an instruction for square roots: {roots:?}"
    );
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
