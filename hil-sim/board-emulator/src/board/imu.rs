//! An IMU on a bus of 16-bit frames.

use rigless::chip::Timeline;
use rigless::chip::icm42688p::Icm42688p;
use rigless::chip::spi::Peer;
use rigless::time::EventId;

/// The emulated ICM-42688-P. Its model transfers one byte at a time; this wrapper transfers frames of any whole
/// number of bytes, which put the same bits on the wires.
#[derive(Debug)]
pub struct Imu {
    /// The part's model.
    pub chip: Icm42688p,
}

rigless::store!(Imu {
    values: [],
    parts: [chip],
    built: []
});

impl Imu {
    /// The IMU at power-up.
    pub fn new() -> Self {
        Self { chip: Icm42688p::new() }
    }
}

impl Peer for Imu {
    fn transfer(&mut self, mosi: u32, bits: u8, context: &mut Timeline<'_, '_>) -> u32 {
        let bytes = usize::from(bits / 8);
        // The first bit of a frame is its highest.
        let sent = mosi.to_be_bytes();
        sent.iter()
            .skip(sent.len().saturating_sub(bytes))
            .fold(0, |answer, byte| {
                answer << 8 | (self.chip.transfer(u32::from(*byte), 8, context) & 0xFF)
            })
    }

    fn select(&mut self, context: &mut Timeline<'_, '_>) {
        self.chip.select(context);
    }

    fn deselect(&mut self, context: &mut Timeline<'_, '_>) {
        self.chip.deselect(context);
    }

    fn on_event(&mut self, event: EventId, context: &mut Timeline<'_, '_>) {
        self.chip.on_event(event, context);
    }

    fn restarted(&mut self, context: &mut Timeline<'_, '_>) {
        self.chip.restarted(context);
    }
}
