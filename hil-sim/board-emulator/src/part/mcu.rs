//! The microcontroller: the emulator's STM32H743 with a watchdog, without the models this firmware never uses.
//!
//! The emulated part offers every change of every request line to every model that might be wired to the line, here about
//! a hundred thousand times per second. Three measures reduce this cost. The models that this firmware never accesses are
//! left out; their registers remain, and the list of gaps would report a firmware that accessed one of them. The timers
//! listen to no request line. DMAMUX1 drives only the lines to which something on this board listens.

use rigless::device::{DeviceContext, ErasedDevice, RegisterFile, ResetCause};
use rigless::emulator::CoreSpec;
use rigless::mcu::Mcu;
use rigless::soc::stm32h743::Stm32h743;
use rigless::soc::{Bus, Error};
use rigless::time::VirtualNanos;

use super::bridge_timer::BridgeTimer;
use super::converter::TriggeredConverter;
use super::faulty_core;
use super::multiplexer::RequestMultiplexer;
use super::setup::{PartSetup, status};
use super::timer::GeneralTimer;
use super::watchdog::IndependentWatchdog;
use super::waveform::PwmWaveform;

/// Instances left out: they listen to request lines, and the firmware never accesses them.
const LEFT_OUT: [&str; 17] = [
    "TIM6",
    "TIM7",
    "TIM12",
    "TIM13",
    "TIM14",
    "TIM15",
    "TIM16",
    "TIM17",
    "SPI2",
    "SPI3",
    "SPI5",
    "SPI6",
    "BDMA",
    "DMAMUX2",
    "ADC2",
    "ADC3",
    "ADC3_Common",
];
/// The bridges' timers, in the order in which [`Part::with_bridge_timer`] numbers them.
const BRIDGE_TIMERS: [&str; 2] = ["TIM1", "TIM8"];
/// General-purpose timers, in the order in which [`Part::with_timer`] numbers them.
const GENERAL_TIMERS: [&str; 4] = ["TIM2", "TIM3", "TIM4", "TIM5"];

/// The model that answers for a slot of the bus.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Model {
    /// The part's own model.
    Own,
    /// No model, only the registers.
    LeftOut,
    Watchdog,
    BridgeTimer(usize),
    Timer(usize),
    Multiplexer,
    Converter,
}

/// The emulated part.
#[derive(Debug)]
pub struct Part {
    /// Every peripheral except those below.
    pub h7: Stm32h743,
    /// TIM1 and TIM8.
    bridge_timers: [BridgeTimer; BRIDGE_TIMERS.len()],
    /// TIM2 to TIM5.
    timers: [GeneralTimer; GENERAL_TIMERS.len()],
    /// ADC1.
    pub converter: TriggeredConverter,
    /// DMAMUX1.
    multiplexer: RequestMultiplexer,
    /// IWDG1.
    watchdog: IndependentWatchdog,
    /// The model of each slot.
    models: Vec<Model>,
    bridge_timer_slots: [usize; BRIDGE_TIMERS.len()],
    timer_slots: [usize; GENERAL_TIMERS.len()],
    link_slot: usize,
    clocks_slot: usize,
    setup: PartSetup,
}

rigless::store!(Part {
    values: [watchdog],
    parts: [h7, bridge_timers, timers, converter, multiplexer],
    built: [models, bridge_timer_slots, timer_slots, link_slot, clocks_slot, setup]
});

impl Part {
    /// The part at power-up.
    ///
    /// # Errors
    /// When the emulated part's own description is inconsistent.
    pub fn new(setup: PartSetup) -> Result<Self, Error> {
        let mut h7 = Stm32h743::new()?;
        let (flash, registers) = h7.program();
        setup.program(flash, registers);
        let identity_slot = h7.bus().slot("DBGMCU")?;
        setup.mark(h7.bus_mut().slot_mut(identity_slot).registers_mut());
        let bus = h7.bus();
        let mut models = vec![Model::Own; bus.slots().len()];
        for instance in LEFT_OUT {
            models[bus.slot(instance)?] = Model::LeftOut;
        }
        let mut bridge_timer_slots = [0; BRIDGE_TIMERS.len()];
        for (nth, instance) in BRIDGE_TIMERS.into_iter().enumerate() {
            bridge_timer_slots[nth] = bus.slot(instance)?;
            models[bridge_timer_slots[nth]] = Model::BridgeTimer(nth);
        }
        let mut timer_slots = [0; GENERAL_TIMERS.len()];
        for (nth, instance) in GENERAL_TIMERS.into_iter().enumerate() {
            timer_slots[nth] = bus.slot(instance)?;
            models[timer_slots[nth]] = Model::Timer(nth);
        }
        models[bus.slot("ADC1")?] = Model::Converter;
        models[bus.slot("DMAMUX1")?] = Model::Multiplexer;
        models[bus.slot("IWDG")?] = Model::Watchdog;
        let link_slot = bus.slot("USART3")?;
        let clocks_slot = bus.slot("RCC")?;
        Ok(Self {
            h7,
            bridge_timers: std::array::from_fn(|nth| BridgeTimer::new(nth, setup.deaf_break)),
            timers: std::array::from_fn(GeneralTimer::new),
            converter: TriggeredConverter::new(),
            multiplexer: RequestMultiplexer::new()?,
            watchdog: IndependentWatchdog::new(),
            models,
            bridge_timer_slots,
            timer_slots,
            link_slot,
            clocks_slot,
            setup,
        })
    }

    /// The external clock stops.
    pub fn fail_external_clock(&mut self, at: VirtualNanos) {
        let slot = self.clocks_slot;
        // The model and the bus that it drives cannot be borrowed from the part at the same time.
        let mut clocks = std::mem::take(&mut self.h7.rcc);
        let (registers, mut context) = self.h7.bus_mut().drive(at, slot);
        clocks.fail_hse(registers, &mut context);
        self.h7.rcc = clocks;
    }

    /// Sets flags in the status register of a flash bank. For tests.
    pub fn raise_flash_flags(&mut self, bank: usize, flags: u32) {
        let (_, registers) = self.h7.program();
        let register = status(bank);
        registers.set(register, registers.get(register) | u64::from(flags));
    }

    /// Address from which the core reads its vectors after a reset.
    pub fn boot_address(&self) -> u32 {
        self.setup.boot_address
    }

    /// A core made by `spec`, with the part's bad memory, if any.
    pub fn with_memory_fault(&self, mut spec: CoreSpec) -> CoreSpec {
        if let Some(fault) = self.setup.memory_fault {
            spec.processor = faulty_core::constructor(spec.processor, fault);
        }
        spec
    }

    /// Acts on a bridge timer from outside the part, at an instant: TIM1 for 0, TIM8 for 1.
    pub fn with_bridge_timer<T>(
        &mut self,
        at: VirtualNanos,
        nth: usize,
        action: impl FnOnce(&mut BridgeTimer, &mut RegisterFile, &mut DeviceContext<'_>) -> T,
    ) -> T {
        let (registers, mut context) = self.h7.bus_mut().drive(at, self.bridge_timer_slots[nth]);
        action(&mut self.bridge_timers[nth], registers, &mut context)
    }

    /// Writes of the bridges' compare values that the end of a period could have separated from the writes of the other
    /// values.
    pub fn unheld_writes(&self) -> u64 {
        self.bridge_timers.iter().map(|timer| timer.unheld_writes).sum()
    }

    /// What the bridge timers drive onto their channels: TIM1, TIM8.
    fn waveforms(&mut self) -> [PwmWaveform; BRIDGE_TIMERS.len()] {
        std::array::from_fn(|nth| {
            let slot = self.bridge_timer_slots[nth];
            let registers = self.h7.bus_mut().slot_mut(slot).registers_mut();
            self.bridge_timers[nth].waveform(registers)
        })
    }

    /// Filters of the inputs of an encoder's timer, TIM2 for 0, as the firmware set them: bits 4 to 7 of channel 1, 12 to
    /// 15 of channel 2. For tests.
    pub fn encoder_filters(&self, nth: usize) -> u64 {
        self.timers[nth].filters
    }

    /// Acts on a general-purpose timer from outside the part, at an instant: TIM2 for 0, to TIM5 for 3.
    pub fn with_timer<T>(
        &mut self,
        at: VirtualNanos,
        nth: usize,
        action: impl FnOnce(&mut GeneralTimer, &mut RegisterFile, &mut DeviceContext<'_>) -> T,
    ) -> T {
        let (registers, mut context) = self.h7.bus_mut().drive(at, self.timer_slots[nth]);
        action(&mut self.timers[nth], registers, &mut context)
    }
}

impl Mcu for Part {
    fn bus(&self) -> &Bus {
        self.h7.bus()
    }

    fn bus_mut(&mut self) -> &mut Bus {
        self.h7.bus_mut()
    }

    fn reset(&mut self, at: VirtualNanos, cause: ResetCause) {
        ErasedDevice::reset(&mut self.watchdog);
        for timer in &mut self.bridge_timers {
            ErasedDevice::reset(timer);
        }
        for timer in &mut self.timers {
            ErasedDevice::reset(timer);
        }
        ErasedDevice::reset(&mut self.converter);
        ErasedDevice::reset(&mut self.multiplexer);
        self.h7.reset(at, cause);
    }

    /// Polls the link's model, the only model with an input from outside the part. The part's own `poll` asks all hundred
    /// models at every stop.
    fn poll(&mut self, now: VirtualNanos) {
        let slot = self.link_slot;
        if let (bus, Some(model)) = self.h7.split(slot) {
            let (registers, mut context) = bus.drive(now, slot);
            model.poll(registers, &mut context);
        }
    }

    fn split(&mut self, slot: usize) -> (&mut Bus, Option<&mut dyn ErasedDevice>) {
        let model: &mut dyn ErasedDevice = match self.models.get(slot).copied().unwrap_or(Model::Own) {
            Model::Own => return self.h7.split(slot),
            Model::LeftOut => return (self.h7.bus_mut(), None),
            Model::Watchdog => &mut self.watchdog,
            Model::BridgeTimer(nth) => &mut self.bridge_timers[nth],
            Model::Timer(nth) => &mut self.timers[nth],
            Model::Multiplexer => &mut self.multiplexer,
            Model::Converter => {
                let waveforms = self.waveforms();
                self.converter.follow(&waveforms);
                &mut self.converter
            }
        };
        (self.h7.bus_mut(), Some(model))
    }
}
