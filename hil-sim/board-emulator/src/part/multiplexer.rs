//! DMAMUX1, reduced to the lines to which something on this board listens.
//!
//! For each word moved, the multiplexer's model changes lines six times: its channel's request, an event and an
//! acknowledge, each up and down. Events lead back to the multiplexer's own synchronisation and trigger inputs,
//! which no channel of this firmware uses. Acknowledges lead to the timers, and no timer requests DMA. This
//! wrapper keeps both off the part's lines, where every listener would see them.

use rigless::device::{Device, DeviceContext, Level, RegisterFile, RequestChange};
use rigless::mcu::{Bare, Mcu, Operate};
use rigless::soc::Error;
use rigless::soc::stm32h743::builder;
use rigless::soc::stm32h743::peripherals::dmamux::{DMAMUX1_FIRST_EVENT, Dmamux1};

/// Register of the multiplexer's model.
type Register = <Dmamux1 as Device>::Register;

const INSTANCE: &str = "DMAMUX1";
/// Position of the multiplexer's only interrupt.
const OVERRUN: usize = 0;

/// The multiplexer between the peripherals' request lines and the DMA streams.
#[derive(Debug)]
pub struct RequestMultiplexer {
    model: Dmamux1,
    /// A part without models. The multiplexer's model drives the lines of this part instead of the lines of the
    /// board's part.
    lines: Bare,
    slot: usize,
}

rigless::store!(RequestMultiplexer {
    values: [],
    parts: [model],
    built: [lines, slot]
});

impl RequestMultiplexer {
    /// DMAMUX1 in the reset state.
    ///
    /// # Errors
    /// When the emulated part's own description is inconsistent.
    pub fn new() -> Result<Self, Error> {
        let lines = Bare::new(builder())?;
        let slot = lines.bus().slot(INSTANCE)?;
        Ok(Self {
            model: Dmamux1::new(),
            lines,
            slot,
        })
    }

    /// Acts on the model, and passes on its changes of the lines to which something listens.
    fn call(&mut self, context: &mut DeviceContext<'_>, action: impl FnOnce(&mut Dmamux1, &mut DeviceContext<'_>)) {
        let (_, mut own) = self.lines.bus_mut().drive(context.now(), self.slot);
        action(&mut self.model, &mut own);
        for change in self.lines.drain_requests() {
            if change.request < DMAMUX1_FIRST_EVENT {
                context.request(change.request, change.level);
            }
        }
        for change in self.lines.drain_interrupts() {
            context.interrupt(OVERRUN, change.level);
        }
        for told in self.lines.drain_told() {
            context.tell(told.register, told.reason);
        }
    }
}

impl Device for RequestMultiplexer {
    type Register = Register;

    fn write(&mut self, register: Register, value: u64, file: &mut RegisterFile, context: &mut DeviceContext<'_>) {
        self.call(context, |model, own| model.write(register, value, file, own));
    }

    fn on_request(&mut self, request: RequestChange, file: &mut RegisterFile, context: &mut DeviceContext<'_>) {
        // The multiplexer ignores its own lines, and the falling edge of a controller's acknowledge.
        let controller = matches!(request.instance, "DMA1" | "DMA2");
        if request.instance != INSTANCE && !(controller && request.level == Level::Low) {
            self.call(context, |model, own| model.on_request(request, file, own));
        }
    }

    fn reset(&mut self) {
        self.model.reset();
    }

    fn reset_line(&mut self, file: &mut RegisterFile, context: &mut DeviceContext<'_>) {
        self.call(context, |model, own| model.reset_line(file, own));
    }
}
