//! TIM2 to TIM5, deaf to request lines: on this board none of them moves data by DMA or follows another
//! timer, so no request or acknowledge is wired to them.

use rigless::device::{Device, DeviceContext, RegisterFile, RequestChange};
use rigless::soc::stm32h743::peripherals::tim::{General, TIMERS, Tim};
use rigless::time::{EventId, VirtualNanos};

/// Register of the timers' model.
type Register = <Tim<General> as Device>::Register;

/// A general-purpose timer.
#[derive(Debug)]
pub struct Timer {
    /// The part's model.
    pub model: Tim<General>,
}

rigless::store!(Timer {
    values: [model],
    parts: [],
    built: []
});

impl Timer {
    /// TIM2 for 0, to TIM5 for 3, out of reset.
    pub fn new(nth: usize) -> Self {
        // The clock tree tells its rate before it counts.
        Self {
            model: Tim::with_clock(1, TIMERS[nth]),
        }
    }
}

impl Device for Timer {
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
        self.model.on_event(event, file, context);
    }

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
