//! The microcontroller: the emulated STM32H743 with its watchdog, and TIM1 without its wake-ups.

use rigless::device::{Device, DeviceContext, ErasedDevice, RegisterFile, ResetCause};
use rigless::mcu::Mcu;
use rigless::soc::stm32h743::Stm32h743;
use rigless::soc::{Bus, Error};
use rigless::time::VirtualNanos;

use crate::bridge_timer::BridgeTimer;
use crate::watchdog::Watchdog;

/// The part.
#[derive(Debug)]
pub struct Part {
    /// Everything but the watchdog and TIM1.
    pub h7: Stm32h743,
    /// TIM1.
    pub bridge_timer: BridgeTimer,
    /// IWDG1.
    pub watchdog: Watchdog,
    watchdog_slot: usize,
    bridge_timer_slot: usize,
    link_slot: usize,
}

rigless::store!(Part {
    values: [watchdog],
    parts: [h7, bridge_timer],
    built: [watchdog_slot, bridge_timer_slot, link_slot]
});

impl Part {
    /// The part, powered.
    ///
    /// # Errors
    /// When the emulated part's own description is inconsistent.
    pub fn new() -> Result<Self, Error> {
        let h7 = Stm32h743::new()?;
        let watchdog_slot = h7.bus().slot("IWDG")?;
        let bridge_timer_slot = h7.bus().slot("TIM1")?;
        let link_slot = h7.bus().slot("USART3")?;
        Ok(Self {
            h7,
            bridge_timer: BridgeTimer::new(),
            watchdog: Watchdog::new(),
            watchdog_slot,
            bridge_timer_slot,
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
}

impl Mcu for Part {
    fn bus(&self) -> &Bus {
        self.h7.bus()
    }

    fn bus_mut(&mut self) -> &mut Bus {
        self.h7.bus_mut()
    }

    fn reset(&mut self, at: VirtualNanos, cause: ResetCause) {
        Device::reset(&mut self.watchdog);
        Device::reset(&mut self.bridge_timer);
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
        if slot == self.watchdog_slot {
            (self.h7.bus_mut(), Some(&mut self.watchdog))
        } else if slot == self.bridge_timer_slot {
            (self.h7.bus_mut(), Some(&mut self.bridge_timer))
        } else {
            self.h7.split(slot)
        }
    }
}
