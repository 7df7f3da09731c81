//! DMAMUX1, deaf to itself: its own outputs are wired back to it only as synchronisation and trigger inputs,
//! which no channel of this firmware uses, and it drives most of the part's request lines.

use rigless::device::{Device, DeviceContext, RegisterFile, RequestChange};
use rigless::soc::stm32h743::peripherals::dmamux::Dmamux1;

/// Register of the multiplexer's model.
type Register = <Dmamux1 as Device>::Register;

/// The multiplexer between the peripherals' request lines and the DMA streams.
#[derive(Debug)]
pub struct RequestMultiplexer {
    model: Dmamux1,
}

rigless::store!(RequestMultiplexer {
    values: [],
    parts: [model],
    built: []
});

impl RequestMultiplexer {
    /// DMAMUX1, out of reset.
    pub fn new() -> Self {
        Self { model: Dmamux1::new() }
    }
}

impl Device for RequestMultiplexer {
    type Register = Register;

    fn write(&mut self, register: Register, value: u64, file: &mut RegisterFile, context: &mut DeviceContext<'_>) {
        self.model.write(register, value, file, context);
    }

    fn on_request(&mut self, request: RequestChange, file: &mut RegisterFile, context: &mut DeviceContext<'_>) {
        if request.instance != "DMAMUX1" {
            self.model.on_request(request, file, context);
        }
    }

    fn reset(&mut self) {
        self.model.reset();
    }

    fn reset_line(&mut self, file: &mut RegisterFile, context: &mut DeviceContext<'_>) {
        self.model.reset_line(file, context);
    }
}
