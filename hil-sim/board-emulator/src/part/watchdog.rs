//! Model of the independent watchdog, for which the emulated part has only registers.

use rigless::device::{Device, DeviceContext, RegisterFile};
use rigless::soc::stm32h743::generated::iwdg::Register;
use rigless::time::{EventId, VirtualNanos};

/// Nominal rate of the low-speed oscillator that drives the watchdog.
const LSI_HZ: u64 = 32_000;
/// Keys of the key register.
const START: u64 = 0xCCCC;
const RELOAD: u64 = 0xAAAA;
const UNLOCK: u64 = 0x5555;

/// IWDG1: keys, prescaler, reload value, end of count. A change of the prescaler or the reload value takes
/// effect at the next reload. On the real part it takes effect within five cycles of the slow clock. A
/// write to either register without the unlocking key changes nothing.
#[derive(Debug, Default, serde::Serialize, serde::Deserialize)]
pub struct IndependentWatchdog {
    started: bool,
    unlocked: bool,
    prescaler: u64,
    reload: u64,
    end: Option<EventId>,
}

impl IndependentWatchdog {
    /// The watchdog at power-up.
    pub fn new() -> Self {
        Self {
            reload: 0xFFF,
            ..Self::default()
        }
    }

    /// Time from a reload to the reset, in ns.
    fn period_ns(&self) -> u64 {
        (self.reload + 1) * (4 << self.prescaler.min(6)) * 1_000_000_000 / LSI_HZ
    }

    fn restart_count(&mut self, context: &mut DeviceContext<'_>) {
        if self.started {
            self.end = Some(context.schedule(VirtualNanos(context.now().0 + self.period_ns())));
        }
    }
}

impl Device for IndependentWatchdog {
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
            _ => {}
        }
    }

    fn on_event(&mut self, event: EventId, _: &mut RegisterFile, context: &mut DeviceContext<'_>) {
        // The event of a count that has been reloaded since is stale.
        if self.end == Some(event) {
            context.request_reset();
        }
    }

    fn reset(&mut self) {
        *self = Self::new();
    }
}
