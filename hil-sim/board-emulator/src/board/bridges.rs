//! The bridges' lines and the break wire: what the timers drive onto each bridge's inputs, and what trips the timers.

use rigless::device::Level;
use rigless::mcu::Mcu;
use rigless::soc::stm32h743::peripherals::gpio;
use rigless::soc::stm32h743::peripherals::tim::{BreakInput, Channel};
use rigless::time::VirtualNanos;
use serde::{Deserialize, Serialize};

use super::pins::{BridgeInput, BridgeOutput, MOTORS, pin};
use crate::part::{Part, RippleSource};

/// A pin: its port's index, its number, and the alternate function that connects it to its timer.
#[derive(Debug, Clone, Copy)]
struct TimerPin {
    port: usize,
    number: u8,
    function: u8,
}

/// GPIOA, GPIOC, GPIOE.
const PORTS: [(usize, &str); 3] = [(0, "GPIOA"), (2, "GPIOC"), (4, "GPIOE")];

const fn timer_pin(port: usize, number: u8, function: u8) -> TimerPin {
    TimerPin { port, number, function }
}

/// Source of a bridge's input: timer, numbered as in [`Part::with_bridge_timer`], channel and pin.
type LineSource = (usize, u8, TimerPin);

/// IN1 and IN2 of each bridge.
const LINES: [[LineSource; 2]; MOTORS] = [
    [(0, 1, timer_pin(4, 9, 1)), (0, 2, timer_pin(4, 11, 1))],
    [(0, 3, timer_pin(4, 13, 1)), (0, 4, timer_pin(4, 14, 1))],
    [(1, 3, timer_pin(2, 8, 3)), (1, 4, timer_pin(2, 9, 3))],
];
/// Break input of each bridge timer: PE15, PA8.
const BREAKS: [(BreakInput, TimerPin); 2] = [
    (BreakInput::First, timer_pin(4, 15, 1)),
    (BreakInput::Second, timer_pin(0, 8, 3)),
];

/// Faults and states of the lines between board and bridges, in addition to what the timers drive.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[allow(clippy::struct_excessive_bools)] // Each field is a separate wire.
pub(super) struct BridgeWiring {
    /// The stop's second contact is open.
    pub(super) stop_pressed: bool,
    /// The stop's second contact is welded shut.
    pub(super) second_contact_welded: bool,
    /// A bridge driver reports a fault.
    pub(super) driver_fault: bool,
    /// A bridge has shut itself down because it is too hot, and reports that as a fault.
    pub(super) driver_hot: bool,
    /// The pin of this timer's break input is shorted to ground.
    pub(super) grounded: [bool; BREAKS.len()],
    /// Broken lines: the bridge's pull-down holds the input low.
    pub(super) cut: [[bool; 2]; MOTORS],
}

impl BridgeWiring {
    /// Level at the pin of a timer's break input: high while the stop's second contact is open or a driver reports a
    /// fault.
    fn break_level(self, nth: usize) -> Level {
        let wire = (self.stop_pressed && !self.second_contact_welded) || self.driver_fault || self.driver_hot;
        Level::from(wire && !self.grounded[nth])
    }

    /// Puts the wire's level on the break inputs. The filter of each input whose level differs from `before` starts
    /// again.
    pub(super) fn drive_breaks(self, part: &mut Part, now: VirtualNanos, before: Self) {
        for (nth, (input, at)) in BREAKS.into_iter().enumerate() {
            let level = self.break_level(nth);
            part.h7.drive_port(now, at.port, |port, registers, context| {
                port.drive(pin(at.number), Some(level), registers, context);
            });
            let at_timer = self.break_at_timer(part, nth);
            part.with_bridge_timer(now, nth, |timer, registers, context| {
                if level != before.break_level(nth) {
                    timer.time_break_filter(now);
                }
                timer.drive_break(input, at_timer, registers, context);
            });
        }
    }

    /// Level that a timer sees on its break input: low until the pin is connected to the timer.
    fn break_at_timer(self, part: &mut Part, nth: usize) -> Level {
        if connected(part, BREAKS[nth].1) {
            self.break_level(nth)
        } else {
            Level::Low
        }
    }

    /// State of each bridge.
    pub(super) fn outputs(self, part: &mut Part, now: VirtualNanos) -> [BridgeOutput; MOTORS] {
        for (nth, (input, _)) in BREAKS.into_iter().enumerate() {
            let level = self.break_at_timer(part, nth);
            part.with_bridge_timer(now, nth, |timer, registers, context| {
                timer.drive_break(input, level, registers, context);
            });
        }
        std::array::from_fn(|motor| {
            let [in1, in2] = [0, 1].map(|leg| {
                if self.cut[motor][leg] {
                    BridgeInput::Level(Level::Low)
                } else {
                    input(part, now, LINES[motor][leg])
                }
            });
            BridgeOutput::of(in1, in2)
        })
    }
}

/// Source of the ripple of a motor's current at its sensor. `slope_uv_per_us` is the slope of the sensor's voltage
/// under the whole supply.
pub(super) fn ripple(motor: usize, slope_uv_per_us: u32) -> RippleSource {
    let [(timer, in1, _), (_, in2, _)] = LINES[motor];
    RippleSource {
        timer,
        lines: [in1, in2].map(|channel| usize::from(channel) - 1),
        slope_uv_per_us,
    }
}

/// What a timer drives onto a bridge's input. The bridge's pull-down keeps a line low that the timer does not drive.
fn input(part: &mut Part, now: VirtualNanos, (timer, channel, _): LineSource) -> BridgeInput {
    let channel = Channel::new(channel).expect("a timer has six channels");
    part.with_bridge_timer(now, timer, |timer, registers, _| {
        match timer.pulse(channel, now, registers) {
            Some((high_ns, period_ns)) => BridgeInput::Pulse { high_ns, period_ns },
            None => BridgeInput::Level(timer.model.output(channel, registers).unwrap_or(Level::Low)),
        }
    })
}

/// Whether every bridge input is connected to its timer. Until then pull-downs keep the input low.
pub(super) fn all_connected(part: &mut Part) -> bool {
    LINES.into_iter().flatten().all(|(.., at)| connected(part, at))
}

/// Whether a pin is connected to its timer.
fn connected(part: &mut Part, at: TimerPin) -> bool {
    let (_, name) = PORTS
        .into_iter()
        .find(|(port, _)| *port == at.port)
        .expect("the ports of the bridges' pins are listed");
    let slot = part.h7.bus().slot(name).expect("the part has the port");
    let registers = part.h7.bus_mut().slot_mut(slot).registers_mut();
    gpio::Gpio::function(pin(at.number), registers) == Some(at.function)
}
