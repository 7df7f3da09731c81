//! TIM1 to TIM5 and TIM8, without the calls that nothing on this board needs.
//!
//! None of these timers moves data by DMA or follows another timer, so none of them hears a request line but those
//! that trip the break of the bridges' timers, TIM1 and TIM8: the clock security system's, and the supply's detector, for
//! which the part has no line ([`BridgeTimer::supply_fell`]).
//!
//! The part's model of a timer with outputs asks for control at every edge of every channel: tens of thousands of times
//! per second for each of the bridges' timers at 20 kHz, most of what a run costs. Nothing on this board looks at an edge,
//! and the model catches up in one pass whenever it is accessed. The events of the bridges' timers are therefore dropped,
//! except around a change of the break input, because they time the break's filter; whoever reads their outputs drives
//! their break inputs first, which makes the models catch up.
//!
//! The emulated encoders move all the edges of a step at one instant, which a filter would take for noise: the inputs of
//! the general timers are not filtered, and what the firmware sets is kept beside the model.

use rigless::device::{Device, DeviceContext, Level, RegisterFile, RequestChange};
use rigless::soc::Layout;
use rigless::soc::stm32h743::peripherals::rcc::CLOCK_FAILURE;
use rigless::soc::stm32h743::peripherals::tim::{
    ADVANCED_TIMERS, Advanced, BreakInput, BreakSource, Family, General, TIMERS, Tim,
};
use rigless::time::{EventId, VirtualNanos};

/// How long after a change of the break input the events of the bridges' timers are let through, in ns: longer than any setting of
/// the break's filter at this board's clock (15 samples of 32 periods of 5 ns: 2.4 us).
const BREAK_FILTER_NS: u64 = 5_000;

/// Instance whose request line trips the bridges' breaks when the external clock fails.
const CLOCKS: &str = "RCC";
/// The line that stands for the supply's detector: the power controller has fewer.
const SUPPLY: (&str, usize) = ("PWR", usize::MAX);

/// Offset of the register that configures channels 1 and 2, and its bits of the inputs' filters.
const CHANNELS_1_AND_2: u32 = 0x18;
const FILTERS: u64 = 0xF0F0;

/// Clock until the clock tree sets the timer's own, before the firmware starts the timer.
const UNSET_CLOCK_HZ: u64 = 1;

/// A timer of one family.
#[derive(Debug)]
pub struct Timer<F: Family> {
    /// The part's model.
    pub model: Tim<F>,
    /// The last instant, in ns, at which an event reaches the model.
    events_until: u64,
    /// The inputs' filters are off, whatever the firmware sets.
    unfiltered: bool,
    /// The inputs' filters as the firmware set them last.
    pub filters: u64,
}

/// TIM1 or TIM8, which switch the bridges.
pub type BridgeTimer = Timer<Advanced>;
/// One of TIM2 to TIM5.
pub type GeneralTimer = Timer<General>;

rigless::store!(BridgeTimer {
    values: [model, events_until, unfiltered, filters],
    parts: [],
    built: []
});
rigless::store!(GeneralTimer {
    values: [model, events_until, unfiltered, filters],
    parts: [],
    built: []
});

impl GeneralTimer {
    /// TIM2 for 0, to TIM5 for 3, out of reset.
    pub fn general(nth: usize) -> Self {
        Self {
            model: Tim::with_clock(UNSET_CLOCK_HZ, TIMERS[nth]),
            events_until: u64::MAX,
            unfiltered: true,
            filters: 0,
        }
    }
}

impl BridgeTimer {
    /// TIM1 for 0, TIM8 for 1, out of reset.
    pub fn bridges(nth: usize) -> Self {
        Self {
            model: Tim::with_clock(UNSET_CLOCK_HZ, ADVANCED_TIMERS[nth])
                .breaks_on(CLOCKS, CLOCK_FAILURE)
                .breaks_on(SUPPLY.0, SUPPLY.1),
            events_until: 0,
            unfiltered: false,
            filters: 0,
        }
    }

    /// Lets the model's events through for as long as the break's filter can take.
    pub fn time_break_filter(&mut self, now: VirtualNanos) {
        self.events_until = now.0 + BREAK_FILTER_NS;
    }

    /// The supply fell below the detector's level, which the firmware has connected to the break.
    pub fn supply_fell(&mut self, registers: &mut RegisterFile, context: &mut DeviceContext<'_>) {
        let (instance, request) = SUPPLY;
        let change = RequestChange {
            instance,
            request,
            level: Level::High,
        };
        self.model.on_request(change, registers, context);
    }

    /// Puts a level on the pin of a break, which makes the model catch up.
    pub fn drive_break(
        &mut self,
        input: BreakInput,
        level: Level,
        registers: &mut RegisterFile,
        context: &mut DeviceContext<'_>,
    ) {
        self.model
            .drive_break_source(input, BreakSource::Pin, level, registers, context);
    }
}

impl<F: Family> Device for Timer<F> {
    type Register = F::Register;

    fn read(&mut self, register: F::Register, file: &mut RegisterFile, context: &mut DeviceContext<'_>) -> Option<u64> {
        self.model.read(register, file, context)
    }

    fn peek(&self, register: F::Register, file: &RegisterFile, now: VirtualNanos) -> Option<u64> {
        self.model.peek(register, file, now)
    }

    fn write(&mut self, register: F::Register, value: u64, file: &mut RegisterFile, context: &mut DeviceContext<'_>) {
        let mut value = value;
        if self.unfiltered && register.spec().offset == CHANNELS_1_AND_2 {
            self.filters = value & FILTERS;
            value &= !FILTERS;
            // The model reads the filters from the file, where the bus has put what the firmware wrote.
            file.set(register, value);
        }
        self.model.write(register, value, file, context);
    }

    fn on_event(&mut self, event: EventId, file: &mut RegisterFile, context: &mut DeviceContext<'_>) {
        if context.now().0 <= self.events_until {
            self.model.on_event(event, file, context);
        }
    }

    /// The clocks' lines alone: no other request or acknowledge is wired to these timers.
    fn on_request(&mut self, change: RequestChange, file: &mut RegisterFile, context: &mut DeviceContext<'_>) {
        if change.instance == CLOCKS {
            self.model.on_request(change, file, context);
        }
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
