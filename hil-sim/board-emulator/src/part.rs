//! The microcontroller: the emulated STM32H743 with its watchdog, without what this board leaves alone.
//!
//! The emulated part offers every change of every request line to every model that might be wired to it, some
//! hundred thousand times a second here. So the models this firmware never touches are left out (their
//! registers still stand; a firmware that reached one would show up among the [`crate::gaps`]), the timers hear
//! none, and DMAMUX1 drives only lines that lead anywhere on this board.

use rigless::device::{DeviceContext, ErasedDevice, RegisterFile, ResetCause};
use rigless::mcu::Mcu;
use rigless::soc::stm32h743::Stm32h743;
use rigless::soc::{Bus, Error};
use rigless::time::VirtualNanos;

use crate::bridge_timer::BridgeTimer;
use crate::multiplexer::RequestMultiplexer;
use crate::plant::MOTORS;
use crate::timer::Timer;
use crate::watchdog::Watchdog;

/// Instances left out: those that listen to request lines and that no code of the firmware touches.
const LEFT_OUT: [&str; 18] = [
    "TIM6",
    "TIM7",
    "TIM8",
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
/// Timers of this board's own: the encoders' in the order of the motors, then the tasks' clock.
const TIMERS: [&str; MOTORS + 1] = ["TIM2", "TIM3", "TIM4", "TIM5"];

/// Which model answers for a slot.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Model {
    /// The part's own.
    Own,
    /// None: the registers alone.
    LeftOut,
    Watchdog,
    BridgeTimer,
    Timer(usize),
    Multiplexer,
}

/// The part.
#[derive(Debug)]
pub struct Part {
    /// Everything but the models below.
    pub h7: Stm32h743,
    /// TIM1.
    pub bridge_timer: BridgeTimer,
    /// TIM2 to TIM5.
    timers: [Timer; TIMERS.len()],
    /// DMAMUX1.
    multiplexer: RequestMultiplexer,
    /// IWDG1.
    pub watchdog: Watchdog,
    /// By slot.
    models: Vec<Model>,
    bridge_timer_slot: usize,
    timer_slots: [usize; TIMERS.len()],
    link_slot: usize,
}

rigless::store!(Part {
    values: [watchdog],
    parts: [h7, bridge_timer, timers, multiplexer],
    built: [models, bridge_timer_slot, timer_slots, link_slot]
});

impl Part {
    /// The part, powered.
    ///
    /// # Errors
    /// When the emulated part's own description is inconsistent.
    pub fn new() -> Result<Self, Error> {
        let h7 = Stm32h743::new()?;
        let bus = h7.bus();
        let mut models = vec![Model::Own; bus.slots().len()];
        for instance in LEFT_OUT {
            models[bus.slot(instance)?] = Model::LeftOut;
        }
        let bridge_timer_slot = bus.slot("TIM1")?;
        models[bridge_timer_slot] = Model::BridgeTimer;
        let mut timer_slots = [0; TIMERS.len()];
        for (nth, instance) in TIMERS.into_iter().enumerate() {
            timer_slots[nth] = bus.slot(instance)?;
            models[timer_slots[nth]] = Model::Timer(nth);
        }
        models[bus.slot("DMAMUX1")?] = Model::Multiplexer;
        models[bus.slot("IWDG")?] = Model::Watchdog;
        let link_slot = bus.slot("USART3")?;
        Ok(Self {
            h7,
            bridge_timer: BridgeTimer::new(),
            timers: std::array::from_fn(Timer::new),
            multiplexer: RequestMultiplexer::new()?,
            watchdog: Watchdog::new(),
            models,
            bridge_timer_slot,
            timer_slots,
            link_slot,
        })
    }

    /// Does something with TIM1 from outside the part, at an instant.
    pub fn with_bridge_timer<T>(
        &mut self,
        at: VirtualNanos,
        action: impl FnOnce(&mut BridgeTimer, &mut RegisterFile, &mut DeviceContext<'_>) -> T,
    ) -> T {
        let (registers, mut context) = self.h7.bus_mut().drive(at, self.bridge_timer_slot);
        action(&mut self.bridge_timer, registers, &mut context)
    }

    /// Does something with the nth encoder's timer from outside the part, at an instant.
    pub fn with_encoder_timer<T>(
        &mut self,
        at: VirtualNanos,
        nth: usize,
        action: impl FnOnce(&mut Timer, &mut RegisterFile, &mut DeviceContext<'_>) -> T,
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
        ErasedDevice::reset(&mut self.bridge_timer);
        for timer in &mut self.timers {
            ErasedDevice::reset(timer);
        }
        ErasedDevice::reset(&mut self.multiplexer);
        self.h7.reset(at, cause);
    }

    /// Asks the one model that has anything outside to look: the link's. The part's own way asks all
    /// hundred of them at every stop.
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
            Model::BridgeTimer => &mut self.bridge_timer,
            Model::Timer(nth) => &mut self.timers[nth],
            Model::Multiplexer => &mut self.multiplexer,
        };
        (self.h7.bus_mut(), Some(model))
    }
}
