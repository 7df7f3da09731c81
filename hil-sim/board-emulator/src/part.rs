//! The microcontroller: the emulated STM32H743 with its watchdog.

use rigless::device::{Device, ErasedDevice, ResetCause};
use rigless::mcu::Mcu;
use rigless::soc::stm32h743::Stm32h743;
use rigless::soc::{Bus, Error};
use rigless::time::VirtualNanos;

use crate::watchdog::Watchdog;

/// The part.
#[derive(Debug)]
pub struct Part {
    /// Everything but the watchdog.
    pub h7: Stm32h743,
    /// IWDG1.
    pub watchdog: Watchdog,
    watchdog_slot: usize,
}

rigless::store!(Part { values: [watchdog], parts: [h7], built: [watchdog_slot] });

impl Part {
    /// The part, powered.
    ///
    /// # Errors
    /// When the emulated part's own description is inconsistent.
    pub fn new() -> Result<Self, Error> {
        let h7 = Stm32h743::new()?;
        let watchdog_slot = h7.bus().slot("IWDG")?;
        Ok(Self {
            h7,
            watchdog: Watchdog::new(),
            watchdog_slot,
        })
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
        self.h7.reset(at, cause);
    }

    fn poll(&mut self, now: VirtualNanos) {
        self.h7.poll(now);
    }

    fn split(&mut self, slot: usize) -> (&mut Bus, Option<&mut dyn ErasedDevice>) {
        if slot == self.watchdog_slot {
            (self.h7.bus_mut(), Some(&mut self.watchdog))
        } else {
            self.h7.split(slot)
        }
    }
}
