//! An IMU on a bus with 16-bit frames.

use plant::icm42688p::registers as register;
use rigless::chip::Timeline;
use rigless::chip::icm42688p::Icm42688p;
use rigless::chip::spi::Peer;
use rigless::time::EventId;

/// The emulated ICM-42688-P. Its model transfers one byte at a time. This wrapper transfers frames of any whole
/// number of bytes, with the same bits on the wires.
#[derive(Debug)]
pub struct EmulatedImu {
    /// The part's model.
    pub chip: Icm42688p,
    /// Register to which the transfer's next byte is written. `None` before the address, and during a read.
    writes: Option<u8>,
    /// Whether the next byte is the transfer's address.
    address_next: bool,
    /// Register bank that the driver selected.
    bank: u8,
    /// What the driver wrote to INTF_CONFIG1. The part's model stores this register and does not act on it.
    intf_config1: u8,
}

rigless::store!(EmulatedImu {
    values: [writes, address_next, bank, intf_config1],
    parts: [chip],
    built: []
});

/// Value of INTF_CONFIG1 after a reset.
const INTF_CONFIG1_RESET: u8 = 0x91;

impl EmulatedImu {
    /// The IMU at power-up.
    pub fn new() -> Self {
        Self {
            chip: Icm42688p::new(),
            writes: None,
            address_next: false,
            bank: 0,
            intf_config1: INTF_CONFIG1_RESET,
        }
    }

    /// INTF_CONFIG1 as the driver left it. The register switches the adaptive full scale, whose stalls the
    /// plant's sensor models.
    pub fn intf_config1(&self) -> u8 {
        self.intf_config1
    }

    /// Follows the driver's writes to the registers that the part's model does not act on.
    fn follow(&mut self, byte: u8) {
        if self.address_next {
            self.address_next = false;
            self.writes = (byte & register::READ == 0).then_some(byte);
            return;
        }
        let Some(address) = self.writes else { return };
        self.writes = Some((address + 1) & !register::READ);
        match (self.bank, address) {
            (_, register::REG_BANK_SEL) => self.bank = byte & 7,
            (0, register::INTF_CONFIG1) => self.intf_config1 = byte,
            (0, register::DEVICE_CONFIG) if byte & register::DEVICE_CONFIG_RESET != 0 => {
                self.intf_config1 = INTF_CONFIG1_RESET;
            }
            _ => {}
        }
    }
}

impl Peer for EmulatedImu {
    fn transfer(&mut self, mosi: u32, bits: u8, context: &mut Timeline<'_, '_>) -> u32 {
        let bytes = usize::from(bits / 8);
        // A frame starts with its highest bit.
        let sent = mosi.to_be_bytes();
        sent.iter()
            .skip(sent.len().saturating_sub(bytes))
            .fold(0, |answer, byte| {
                self.follow(*byte);
                answer << 8 | (self.chip.transfer(u32::from(*byte), 8, context) & 0xFF)
            })
    }

    fn select(&mut self, context: &mut Timeline<'_, '_>) {
        self.address_next = true;
        self.writes = None;
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
