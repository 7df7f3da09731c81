//! The steps with the bridges' supply on: what to do, what passes, what to look at if a step fails.

use firmware::hardware::ResetCause;

use super::step::{ArmedLook, BringUpStep, LookEnd, StepKind, bench, of_spar, on};

/// Speed of a look at a driven motor, m/s: its bridge drives for a visible share of the PWM's period.
const LOOK_SPEED_M_S: f32 = 1.0;

/// The steps, in order.
pub(super) const POWERED: &[BringUpStep] = &[
    on(
        "supply on",
        StepKind::SupplyOn,
        [
            "Lift the wheels off the ground and steady the arm. Switch the bridges' supply on, limited to 2 A, and measure it.",
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
            "The tool arms at speed 0 for 10 s; give the arm a small push meanwhile.",
            "stays armed, without a fault; currents below 2 A",
            "the fault that the tool names; EncoderImplausible or BallastEncoder: that motor's leads exchanged: supply off at \
             once",
        ],
    ),
    of_spar(on(
        "levelling",
        StepKind::Levelling,
        [
            "Hold the spar upright by the camera; the tool arms at speed 0 for 8 s; tilt the spar's lower end forward by \
             10 degrees and hold it.",
            "the ballast swings forward as its motor's voltage drives it, within a half; no fault of the spar",
            "the ballast motor's leads: supply off at once; the gains of the spar's law",
        ],
    )),
    bench(on(
        "drive and brake",
        StepKind::ArmedLook(ArmedLook {
            speed_m_s: 0.0,
            act: "look at PE9 and PE11",
            ends: LookEnd::Time,
            question: "Did PE9 and PE11 look like the picture, never both low?",
        }),
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
        StepKind::ArmedLook(ArmedLook {
            speed_m_s: 0.0,
            act: "press the emergency stop, the oscilloscope triggered on PE15",
            ends: LookEnd::Stop,
            question: "Were PE9 and PC8 low within 10 us of the edge?",
        }),
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
    bench(on(
        "tick cost",
        StepKind::TickCost,
        [
            "The tool reads the cost of the ticks so far.",
            "worst below 40,000 cycles, a tenth of the tick; no late tick",
            "caches, wait states",
        ],
    )),
    bench(on(
        "currents in step",
        StepKind::ArmedLook(ArmedLook {
            speed_m_s: LOOK_SPEED_M_S,
            act: "look at PE11 and PC0, and compare PC0's mean, 27.5 mV per ampere above 1.65 V, with the current that the \
                  tool shows for the left motor",
            ends: LookEnd::Time,
            question: "Was the current at PC0 at its mean in the middle of each brake, within a tenth of its swing, and that \
                       mean within 0.3 A of the tool's?",
        }),
        [
            "Oscilloscope on PE11 and PC0, wheels off the ground; the tool drives at 1 m/s for 8 s.",
            "the current crosses its mean in the middle of the brake; the tool shows that mean within 0.3 A",
            "bandwidth of the current's amplifier and filter ([power stage](power-stage.md#when-the-currents-are-read))",
        ],
    )),
    bench(on(
        "supply ramped down",
        StepKind::ArmedLook(ArmedLook {
            speed_m_s: 0.0,
            act: "ramp the part's 3.3 V down, within that time",
            ends: LookEnd::Restart(&[ResetCause::BrownOut, ResetCause::PowerOn]),
            question: "Ramp 3.3 V up again. Did the bridges open at 2.76 V (typical), and the part reset at 2.6 V or above?",
        }),
        [
            "The tool arms at speed 0; ramp the part's 3.3 V down within 20 s, and up again.",
            "bridges open at 2.76 V (typical), reset at 2.6 V or above; the board starts again and says so",
            "the supply's detector, option bytes",
        ],
    )),
    bench(on(
        "halted core",
        StepKind::ArmedLook(ArmedLook {
            speed_m_s: 0.0,
            act: "halt the core with the debugger, within that time",
            ends: LookEnd::Opened,
            question: "Read the word at 0x58000418, and let the core run again. Were the bridges open while it was halted, and \
                       the word 0x0000A044?",
        }),
        [
            "The tool arms at speed 0; halt the core with the debugger within 20 s, read the word at 0x58000418 (SYSCFG_CFGR), \
             and let the core run again.",
            "bridges open, no reset; 0x0000A044: lock-up, errors of either RAM and a low supply are tied to the break",
            "`guard_outputs` in `firmware/src/bin/drive-board/board/mod.rs`",
        ],
    )),
    bench(on(
        "watchdog",
        StepKind::ArmedLook(ArmedLook {
            speed_m_s: 0.0,
            act: "halt the core with the debugger, which has cleared bit 18 of 0x5C001054 and bits 0 and 1 of 0x5C00104C, \
                  within that time",
            ends: LookEnd::Restart(&[ResetCause::Watchdog]),
            question: "Let the core run if the debugger still holds it. Were PE9 and PE11 low within 40 ms of the halt?",
        }),
        [
            "Oscilloscope on PE9 and PE11. With the debugger clear bit 18 of 0x5C001054 and bits 0 and 1 of 0x5C00104C: \
             watchdog and timers then go on while the core is halted. The tool arms at speed 0; halt the core within 20 s.",
            "lines low within 40 ms of the halt; the board starts again, by the watchdog",
            "the watchdog's oscillator and its time in `firmware/src/bin/stm32/watchdog.rs`; the bits that the board had set",
        ],
    )),
    bench(on(
        "clock stops",
        StepKind::ArmedLook(ArmedLook {
            speed_m_s: 0.0,
            act: "pull the debugger's plug, the board on its own supply, within that time",
            // A debugger that is plugged in again may reset the board by its pin. A reset by the supply shows a board that
            // fed on the debugger's plug.
            ends: LookEnd::Restart(&[ResetCause::Software, ResetCause::Pin]),
            question: "Put the plug back. Did the bridges open?",
        }),
        [
            "The tool arms at speed 0, the board on its own supply; pull the debugger's plug within 20 s, and put it back.",
            "bridges open; the board starts again, and its log over RTT says that the external clock stopped",
            "the clock security system, its interrupt",
        ],
    )),
];
