//! The steps without the bridges' supply: what to do, what passes, what to look at if a step fails.

use firmware::hardware::Place;

use super::step::{BringUpStep, StepKind, bench, of_spar, off};

/// The 3.3 V rail, V: the regulator's tolerance and the meter's.
const RAIL_V: (f64, f64) = (3.2, 3.4);

/// The steps, in order.
pub(super) const UNPOWERED: &[BringUpStep] = &[
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
            "Feed 2 to 5 A from a bench supply through each motor's current sensor (the ballast motor's too, if there is a \
             spar), in place of the motor, one at a time, in the direction that drives forward.",
            "that motor's current, equal to the supply's meter within 10 %",
            "the sensor's gain and sign in `firmware/src/drive_board/nucleo_144.rs`; left and right exchanged",
        ],
    ),
    off(
        "arm IMU",
        StepKind::AtRest(Place::Arm),
        [
            "Let the arm hang still.",
            "1 g within 5 %, upright within 15 degrees, rates below 0.1 rad/s, no reading repeated for 20 ticks",
            "wires and axes of the arm IMU (SPI1)",
        ],
    ),
    off(
        "arm forward",
        StepKind::TiltedForward(Place::Arm),
        [
            "Tilt the arm forward by 20 degrees or more and hold it.",
            "accelerometer and gyro both show a forward angle, equal within a third",
            "mounting of the arm IMU; one axis exchanged or reversed",
        ],
    ),
    of_spar(off(
        "spar IMU",
        StepKind::AtRest(Place::Spar),
        [
            "Steady the spar, and let it hang still.",
            "1 g within 5 %, upright within 15 degrees, rates below 0.1 rad/s, no reading repeated for 20 ticks",
            "wires and axes of the spar IMU (SPI4)",
        ],
    )),
    of_spar(off(
        "spar forward",
        StepKind::TiltedForward(Place::Spar),
        [
            "Tilt the spar's lower end forward (the camera back) by 20 degrees or more and hold it.",
            "accelerometer and gyro both show a forward angle, equal within a third",
            "mounting of the spar IMU; one axis exchanged or reversed",
        ],
    )),
    off(
        "wheels",
        StepKind::Wheels,
        [
            "Turn each wheel forward by hand, one turn, arm held.",
            "that wheel's encoder counts one turn forward within 20 %, the other encoder does not count",
            "A and B of the encoder exchanged; left and right exchanged; counts per turn",
        ],
    ),
    of_spar(off(
        "ballast",
        StepKind::BallastByHand,
        [
            "Hold the spar upright, and turn the ballast's lower end forward by a quarter turn.",
            "the ballast's encoder counts a quarter turn forward within 20 %",
            "A and B of the ballast's encoder exchanged; counts per turn",
        ],
    )),
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
];
