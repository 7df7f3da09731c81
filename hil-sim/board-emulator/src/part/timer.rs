//! TIM2 to TIM5, without the calls that nothing on this board needs.
//!
//! None of these timers moves data by DMA or follows another timer, so none of them listens to a request
//! line.
//!
//! The emulated encoders produce all edges of a step at one instant. A filter would take these edges for
//! noise. The timers' inputs are therefore not filtered, and the wrapper stores the filter that the
//! firmware sets.

use rigless::device::{Device, DeviceContext, RegisterFile};
use rigless::soc::Layout;
use rigless::soc::stm32h743::generated::tim2::Register;
use rigless::soc::stm32h743::peripherals::tim::{General, TIMERS, Tim};
use rigless::time::{EventId, VirtualNanos};

/// Offset of the register that configures channels 1 and 2, and that register's bits for the input
/// filters.
const CHANNELS_1_AND_2: u32 = 0x18;
const FILTERS: u64 = 0xF0F0;

/// Clock of any timer until the clock tree sets it, before the firmware starts the timer.
pub const UNSET_CLOCK_HZ: u64 = 1;

/// One of TIM2 to TIM5.
#[derive(Debug)]
pub struct GeneralTimer {
    /// The part's model.
    pub model: Tim<General>,
    /// The input filters as the firmware last set them.
    pub filters: u64,
}

rigless::store!(GeneralTimer {
    values: [model, filters],
    parts: [],
    built: []
});

impl GeneralTimer {
    /// TIM2 for 0 to TIM5 for 3, in the reset state.
    pub fn new(nth: usize) -> Self {
        Self {
            model: Tim::with_clock(UNSET_CLOCK_HZ, TIMERS[nth]),
            filters: 0,
        }
    }
}

impl Device for GeneralTimer {
    type Register = Register;

    fn read(&mut self, register: Register, file: &mut RegisterFile, context: &mut DeviceContext<'_>) -> Option<u64> {
        self.model.read(register, file, context)
    }

    fn peek(&self, register: Register, file: &RegisterFile, now: VirtualNanos) -> Option<u64> {
        self.model.peek(register, file, now)
    }

    fn write(&mut self, register: Register, value: u64, file: &mut RegisterFile, context: &mut DeviceContext<'_>) {
        let mut value = value;
        if register.spec().offset == CHANNELS_1_AND_2 {
            self.filters = value & FILTERS;
            value &= !FILTERS;
            // The model reads the filters from the register file, where the bus has put the firmware's
            // value.
            file.set(register, value);
        }
        self.model.write(register, value, file, context);
    }

    fn on_event(&mut self, event: EventId, file: &mut RegisterFile, context: &mut DeviceContext<'_>) {
        self.model.on_event(event, file, context);
    }

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
