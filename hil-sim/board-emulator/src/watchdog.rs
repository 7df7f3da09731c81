//! The independent watchdog, which the emulated part's own model leaves to its register file.

use rigless::device::{Device, DeviceContext, RegisterFile};
use rigless::soc::stm32h743::generated::iwdg::Register;
use rigless::time::{EventId, VirtualNanos};

/// Nominal rate of the low-speed oscillator it counts on.
const LSI_HZ: u64 = 32_000;
/// Keys of its key register.
const START: u64 = 0xCCCC;
const RELOAD: u64 = 0xAAAA;
const UNLOCK: u64 = 0x5555;

/// IWDG1: keys, prescaler, reload value, end of count. Changes of the prescaler and the reload value
/// take effect at the next reload, as the part's do within five cycles of its slow clock; a write of
/// either without the unlocking key is refused.
#[derive(Debug, Default, serde::Serialize, serde::Deserialize)]
pub struct Watchdog {
    started: bool,
    unlocked: bool,
    prescaler: u64,
    reload: u64,
    end: Option<EventId>,
    /// Writes of prescaler or reload value the lock kept out.
    pub refused_writes: u32,
}

impl Watchdog {
    /// The part at power-up.
    pub fn new() -> Self {
        Self {
            reload: 0xFFF,
            ..Self::default()
        }
    }

    /// Whether the firmware started it.
    pub fn started(&self) -> bool {
        self.started
    }

    /// Time from a reload to the reset in virtual nanoseconds.
    pub fn period_nanos(&self) -> u64 {
        (self.reload + 1) * (4 << self.prescaler.min(6)) * 1_000_000_000 / LSI_HZ
    }

    fn restart_count(&mut self, context: &mut DeviceContext<'_>) {
        if self.started {
            self.end = Some(context.schedule(VirtualNanos(context.now().0 + self.period_nanos())));
        }
    }
}

impl Device for Watchdog {
    type Register = Register;

    fn write(&mut self, register: Register, value: u64, registers: &mut RegisterFile, context: &mut DeviceContext<'_>) {
        match register {
            Register::Kr => {
                self.unlocked = value & 0xFFFF == UNLOCK;
                match value & 0xFFFF {
                    START => {
                        self.started = true;
                        self.restart_count(context);
                    }
                    RELOAD => self.restart_count(context),
                    _ => {}
                }
            }
            Register::Pr if self.unlocked => self.prescaler = registers.get(Register::Pr) & 7,
            Register::Rlr if self.unlocked => self.reload = registers.get(Register::Rlr) & 0xFFF,
            Register::Pr | Register::Rlr => self.refused_writes += 1,
            _ => {}
        }
    }

    fn on_event(&mut self, event: EventId, _: &mut RegisterFile, context: &mut DeviceContext<'_>) {
        // Events of counts that were reloaded since are stale.
        if self.end == Some(event) {
            context.request_reset();
        }
    }

    fn reset(&mut self) {
        *self = Self::new();
    }
}
