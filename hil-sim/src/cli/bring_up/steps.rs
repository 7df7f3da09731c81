//! The procedure's steps: what to do, what passes, what to look at if a step fails. The page's table is made of them.

/// How a step is carried out.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum StepKind {
    /// The person looks, and answers this question.
    Look(&'static str),
    /// The person measures, and gives a number within these ends.
    Measure(&'static str, f64, f64),
    /// Who the board is, and what its self-test found.
    Identity,
    /// What the board's clocks run from, and how fast they run.
    Clock,
    /// Starts of the supply.
    ColdStarts,
    /// The reset button.
    ResetButton,
    /// The emergency stop's contacts.
    Contacts,
    /// The divider of the supply, with the bridges' supply off.
    SupplyOff,
    /// The current sensors' zeros.
    CurrentZeros,
    /// The current sensors' gains and signs.
    CurrentGain,
    /// The arm IMU, hanging at rest.
    ArmAtRest,
    /// The arm IMU's signs.
    ArmForward,
    /// The encoders, a wheel at a time.
    Wheels,
    /// A store and a read.
    Store,
    /// The supply cut while the board stores.
    PowerCuts,
    /// A start without the external clock.
    NoExternalClock,
    /// A firmware over the link, and the supply cut while the boot loader copies.
    Update,
    /// The divider of the supply, with the bridges' supply on.
    SupplyOn,
    /// Armed, at zero volts.
    Armed,
    /// Armed for an oscilloscope, then this question.
    ArmedLook(&'static str),
    /// The emergency stop, armed.
    StopArmed,
    /// The board's button while armed.
    ButtonArmed,
    /// Both wheels forward.
    Forward,
    /// The wheels against each other.
    Turn,
    /// What a tick costs.
    TickCost,
}

/// One step of the procedure. Its number is its place, from 1.
#[derive(Debug, Clone, Copy)]
pub struct BringUpStep {
    /// A few words.
    pub title: &'static str,
    /// What is done.
    pub does: &'static str,
    /// What is seen if the step passes.
    pub passes: &'static str,
    /// What to look at if it fails.
    pub look_at: &'static str,
    /// Only a board on a bench can show it, no simulated one.
    pub bench_only: bool,
    /// The bridges' supply is on.
    pub powered: bool,
    /// How.
    pub kind: StepKind,
}

/// The 3.3 V rail, V: the regulator's tolerance and the meter's.
const RAIL_V: (f64, f64) = (3.2, 3.4);

const fn off(title: &'static str, kind: StepKind, texts: [&'static str; 3]) -> BringUpStep {
    let [does, passes, look_at] = texts;
    BringUpStep {
        title,
        does,
        passes,
        look_at,
        bench_only: false,
        powered: false,
        kind,
    }
}

const fn on(title: &'static str, kind: StepKind, texts: [&'static str; 3]) -> BringUpStep {
    let step = off(title, kind, texts);
    BringUpStep { powered: true, ..step }
}

const fn bench(step: BringUpStep) -> BringUpStep {
    BringUpStep {
        bench_only: true,
        ..step
    }
}

/// The steps, in order: all of those without the bridges' supply first.
pub const STEPS: &[BringUpStep] = &[
    bench(off(
        "marking",
        StepKind::Look("Does the part's marking end in V?"),
        [
            "Read the part's marking.",
            "revision V",
            "another part: the board refuses it (PartRevision)",
        ],
    )),
    bench(off(
        "3.3 V",
        StepKind::Measure(
            "Measure 3.3 V at the board, unplugged from the power stage",
            RAIL_V.0,
            RAIL_V.1,
        ),
        [
            "Measure 3.3 V at the board, unplugged from the power stage.",
            "3.2 to 3.4 V",
            "the supply, JP jumpers",
        ],
    )),
    off(
        "identity",
        StepKind::Identity,
        [
            "Flash the board (`cargo flash-board`). The tool asks the board for its identity.",
            "version, build; no item of the self-test among the blockers",
            "the item's row in [safety](safety.md#the-self-test)",
        ],
    ),
    off(
        "clock",
        StepKind::Clock,
        [
            "The tool compares the board's clock with its own.",
            "the external clock, equal within 1 %",
            "SB jumpers of the ST-LINK's clock (MCO)",
        ],
    ),
    off(
        "cold starts",
        StepKind::ColdStarts,
        [
            "Switch the board's supply off for 1 s, 100 times.",
            "each start by power-on; no run ended in a panic or a fault",
            "`firmware/src/bin/stm32/ram.rs`, `firmware/src/bin/drive-board/board/core_supply.rs`",
        ],
    ),
    bench(off(
        "reset button",
        StepKind::ResetButton,
        [
            "Press the board's reset button.",
            "a start by the reset pin",
            "the button's wire (NRST)",
        ],
    )),
    off(
        "contacts",
        StepKind::Contacts,
        [
            "Release and press the emergency stop; open one contact at a time.",
            "each input follows its own contact; the second contact trips the break",
            "wiring of PG2, PE15 and PA8",
        ],
    ),
    bench(off(
        "supply off",
        StepKind::SupplyOff,
        [
            "Measure the bridges' supply, off.",
            "below 1 V, and the board reads the same within 0.5 V",
            "the divider at PA3; a supply that is on",
        ],
    )),
    off(
        "current zeros",
        StepKind::CurrentZeros,
        [
            "The tool reads the current sensors with the bridges open.",
            "within 0.5 A of 0, each",
            "the sensors' supply and mid-scale, PC0, PB1, PA4",
        ],
    ),
    off(
        "current gain",
        StepKind::CurrentGain,
        [
            "Feed 2 to 5 A from a bench supply through each drive motor's current sensor, in place of the motor, one at \
             a time, in the direction that drives forward.",
            "that motor's current, equal to the supply's meter within 10 %",
            "the sensor's gain and sign in `firmware/src/drive_board/nucleo_h743zi/analog.rs`; left and right exchanged",
        ],
    ),
    off(
        "arm IMU",
        StepKind::ArmAtRest,
        [
            "Let the arm hang still.",
            "1 g within 5 %, upright within 15 degrees, rates below 0.1 rad/s, no reading repeated for 20 ticks",
            "wires and axes of the arm IMU (SPI1)",
        ],
    ),
    off(
        "arm forward",
        StepKind::ArmForward,
        [
            "Tilt the arm forward by 20 degrees or more and hold it.",
            "accelerometer and gyro both show a forward angle, equal within a third",
            "mounting of the arm IMU; one axis exchanged or reversed",
        ],
    ),
    off(
        "wheels",
        StepKind::Wheels,
        [
            "Turn each wheel forward by hand, one turn, arm held.",
            "that wheel's encoder counts one turn forward within 20 %, the other encoder does not count",
            "A and B of the encoder exchanged; left and right exchanged; counts per turn",
        ],
    ),
    off(
        "store",
        StepKind::Store,
        [
            "The tool stores a changed parameter and reads it back.",
            "stored, in force, and put back",
            "the board's 3.3 V (blocker PartSupply), write protection of bank 2",
        ],
    ),
    bench(off(
        "power cuts",
        StepKind::PowerCuts,
        [
            "Cut the board's supply while it stores, 20 times.",
            "the old or the new value at each start; the set is never lost",
            "the store ([safety](safety.md#stored-parameters))",
        ],
    )),
    bench(off(
        "bridges low",
        StepKind::Look(
            "Oscilloscope on PE9 and PE11, PE13 and PE14, PC8 and PC9: are all low, also while you hold the reset button?",
        ),
        [
            "Oscilloscope on the bridges' lines, two at a time: PE9 and PE11, PE13 and PE14, PC8 and PC9, disarmed.",
            "all low; all stay low in reset",
            "pull-downs of the power stage",
        ],
    )),
    bench(off(
        "no clock",
        StepKind::NoExternalClock,
        [
            "Take the clock's jumper off, or pull the debugger's plug with the board on its own supply; reset.",
            "the board starts on its own oscillator and reports so",
            "the bounded wait in `firmware/src/bin/drive-board/board/clocks.rs`",
        ],
    )),
    on(
        "supply on",
        StepKind::SupplyOn,
        [
            "Wheels off the ground. Switch the bridges' supply on, limited to 2 A, and measure it.",
            "within the battery's range, and the board reads the same within 3 %",
            "the divider at PA3, 1:20; the supply's wires",
        ],
    ),
    bench(on(
        "update",
        StepKind::Update,
        [
            "The tool sends the firmware that `--firmware` names over the link, twice; the second time cut the board's \
             supply once it restarts.",
            "confirmed; after the cut the board comes back",
            "the red lamp ([updating](updating.md#without-a-firmware)), `firmware/src/bin/boot-loader/`",
        ],
    )),
    on(
        "armed",
        StepKind::Armed,
        [
            "The tool arms at speed 0 for 3 s.",
            "stays armed; currents below 2 A",
            "the fault that the tool names; polarity: supply off at once",
        ],
    ),
    bench(on(
        "drive and brake",
        StepKind::ArmedLook("Did PE9 and PE11 look like the picture, never both low?"),
        [
            "Oscilloscope on PE9 and PE11; the tool arms at speed 0 for 20 s. Then the same on PE13 and PE14, PC8 and PC9.",
            "the picture below, on either line; never both low",
            "polarity, a line that is cut: supply off at once",
        ],
    )),
    on(
        "stop while armed",
        StepKind::StopArmed,
        [
            "The tool arms; press the emergency stop.",
            "EmergencyStop and BridgeBreak, disarmed",
            "wiring of PG2, PE15 and PA8",
        ],
    ),
    on(
        "button",
        StepKind::ButtonArmed,
        [
            "The tool arms; press the board's blue button.",
            "disarmed, without a fault",
            "the button's line, PC13, high while pressed",
        ],
    ),
    bench(on(
        "stop, in hardware",
        StepKind::ArmedLook("Triggered on PE15, pressing the stop: were PE9 and PC8 low within 10 us of the edge?"),
        [
            "Oscilloscope on PE9 and PC8, triggered on PE15; the tool arms for 20 s; press the stop.",
            "both timers' lines low within 10 us of the edge",
            "the break's wire, to PE15 and to PA8, and its filter",
        ],
    )),
    on(
        "forward",
        StepKind::Forward,
        [
            "The tool drives forward at 0.5 m/s for 3 s.",
            "both wheels turn forward, by their encoders within a quarter of the rates that their voltages predict; no fault",
            "motor leads exchanged",
        ],
    ),
    on(
        "turn",
        StepKind::Turn,
        [
            "The tool turns left on the spot at 0.2 rad/s for 0.5 s.",
            "the left wheel turns backward, the right one forward, each within a quarter of the rate that its voltage predicts; no fault",
            "left and right motor exchanged: supply off at once",
        ],
    ),
    on(
        "tick cost",
        StepKind::TickCost,
        [
            "The tool reads the cost of the ticks so far.",
            "worst below 40,000 cycles, a tenth of the tick; no late tick",
            "caches, wait states",
        ],
    ),
    bench(on(
        "currents in step",
        StepKind::Look(
            "Oscilloscope on PE11 and PC0, wheels off the ground, `hil-sim link drive` at 1 m/s: is the current at PC0 at its \
             mean in the middle of each brake, within a tenth of its swing, and does the tool show that mean, \
             27.5 mV per ampere above 1.65 V, within 0.3 A?",
        ),
        [
            "Oscilloscope on PE11 and PC0 while `hil-sim link drive` drives at 1 m/s, wheels off the ground.",
            "the current crosses its mean in the middle of the brake; the tool shows that mean within 0.3 A",
            "bandwidth of the current's amplifier and filter ([power stage](power-stage.md#when-the-currents-are-read))",
        ],
    )),
    bench(on(
        "supply ramped down",
        StepKind::Look(
            "3.3 V ramped down: did the bridges open at 2.76 V (typical), and the part reset at 2.6 V or above?",
        ),
        [
            "Ramp the part's 3.3 V down while `hil-sim link` drives at speed 0.",
            "bridges open at 2.76 V (typical), reset at 2.6 V or above",
            "the supply's detector, option bytes",
        ],
    )),
    bench(on(
        "halted core",
        StepKind::Look("Halted while armed: bridges open, no reset, and 0x0000A044 at 0x58000418?"),
        [
            "Halt the core with the debugger while `hil-sim link` drives at speed 0; read the word at 0x58000418 (SYSCFG_CFGR).",
            "bridges open, no reset; 0x0000A044: lock-up, errors of either RAM and a low supply are tied to the break",
            "`guard_outputs` in `firmware/src/bin/drive-board/board/mod.rs`",
        ],
    )),
    bench(on(
        "clock stops",
        StepKind::Look("Pull the debugger's plug while armed: did the bridges open?"),
        [
            "Pull the debugger's plug while armed, the board on its own supply.",
            "bridges open; the next log says that the external clock stopped",
            "the clock security system, its interrupt",
        ],
    )),
];
