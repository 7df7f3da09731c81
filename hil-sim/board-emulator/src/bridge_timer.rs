//! TIM1 without its wake-ups.
//!
//! The part's model of a timer with outputs asks for control at every edge of every channel: 80,000
//! times a second for three channels at 20 kHz, most of what a run costs. Nothing on this board looks
//! at an edge, and the model brings itself up to date in one pass whenever it is touched. So its events
//! are dropped here, except around a change of the break input, whose filter they time; and whoever
//! reads the outputs touches it first.

use rigless::device::{Device, DeviceContext, Level, RegisterFile, RequestChange};
use rigless::soc::stm32h743::peripherals::tim::{ADVANCED_TIMERS, Advanced, BreakInput, BreakSource, Tim};
use rigless::time::{EventId, VirtualNanos};

/// How long after a change of the break input the model's events are let through: longer than any
/// setting of the break's filter at this board's clock (15 samples of 32 periods of 5 ns: 2.4 us).
const ALERT_NANOS: u64 = 5_000;

/// Register of the timer's model.
type Register = <Tim<Advanced> as Device>::Register;

/// The bridges' timer.
#[derive(Debug)]
pub struct BridgeTimer {
    /// The part's model.
    pub model: Tim<Advanced>,
    break_level: Level,
    alert_until: u64,
}

rigless::store!(BridgeTimer {
    values: [model, break_level, alert_until],
    parts: [],
    built: []
});

impl BridgeTimer {
    /// TIM1, out of reset, its break input low.
    pub fn new() -> Self {
        Self {
            model: Tim::with_clock(1, ADVANCED_TIMERS[0]),
            break_level: Level::Low,
            alert_until: 0,
        }
    }

    /// Puts a level on the break pin.
    pub fn drive_break(&mut self, level: Level, registers: &mut RegisterFile, context: &mut DeviceContext<'_>) {
        if level != self.break_level {
            self.break_level = level;
            self.alert_until = context.now().0 + ALERT_NANOS;
        }
        self.touch(registers, context);
    }

    /// Brings the model up to now.
    pub fn touch(&mut self, registers: &mut RegisterFile, context: &mut DeviceContext<'_>) {
        self.model.drive_break_source(
            BreakInput::First,
            BreakSource::Pin,
            self.break_level,
            registers,
            context,
        );
    }

    fn alert(&self, now: VirtualNanos) -> bool {
        now.0 <= self.alert_until
    }
}

impl Device for BridgeTimer {
    type Register = Register;

    fn read(&mut self, register: Register, file: &mut RegisterFile, context: &mut DeviceContext<'_>) -> Option<u64> {
        self.model.read(register, file, context)
    }

    fn peek(&self, register: Register, file: &RegisterFile, now: VirtualNanos) -> Option<u64> {
        self.model.peek(register, file, now)
    }

    fn write(&mut self, register: Register, value: u64, file: &mut RegisterFile, context: &mut DeviceContext<'_>) {
        self.model.write(register, value, file, context);
    }

    fn on_event(&mut self, event: EventId, file: &mut RegisterFile, context: &mut DeviceContext<'_>) {
        if self.alert(context.now()) {
            self.model.on_event(event, file, context);
        }
    }

    /// No request or acknowledge is wired to it on this board.
    fn on_request(&mut self, _: RequestChange, _: &mut RegisterFile, _: &mut DeviceContext<'_>) {}

    fn on_clock_input(&mut self, input: usize, hz: u64, file: &mut RegisterFile, context: &mut DeviceContext<'_>) {
        self.model.on_clock_input(input, hz, file, context);
    }

    fn reset(&mut self) {
        self.model.reset();
    }

    fn reset_line(&mut self, file: &mut RegisterFile, context: &mut DeviceContext<'_>) {
        self.model.reset_line(file, context);
    }
}
