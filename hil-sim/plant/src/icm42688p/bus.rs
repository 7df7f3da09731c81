//! The part's serial bus: transfers that read and write its registers.

use super::Icm42688pModel;
use super::registers as reg;

/// Byte read from a bus that no part drives.
const FLOATING: u8 = 0xff;

/// State of the serial transfer while the chip is selected.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Transfer {
    Deselected,
    Address,
    Read(u8),
    Write(u8),
}

impl Icm42688pModel {
    /// One chip-selected transfer. The first byte is the address (with the read bit); every further byte is written, or
    /// replaced by the byte read.
    pub fn transfer(&mut self, bytes: &mut [u8]) {
        self.select();
        self.exchange_all(bytes);
        self.deselect();
    }

    /// Chip select goes low.
    pub fn select(&mut self) {
        self.transfer = Transfer::Address;
    }

    /// Chip select goes high.
    #[inline]
    pub fn deselect(&mut self) {
        self.transfer = Transfer::Deselected;
        if let Some(words) = self.pending {
            self.pending = None;
            self.publish(&words);
        }
    }

    /// Exchanges bytes in both directions while the chip is selected, like repeated [`Self::exchange`].
    pub fn exchange_all(&mut self, bytes: &mut [u8]) {
        for byte in bytes {
            *byte = self.exchange(*byte);
        }
    }

    /// Exchanges frames of two bytes in both directions while the chip is selected, high byte first, like repeated
    /// [`Self::exchange`].
    // A tick calls this function once per part; inlined, the number of frames is known.
    #[allow(clippy::inline_always)]
    #[inline(always)]
    pub fn exchange_frames<const FRAMES: usize>(&mut self, frames: &mut [u16; FRAMES]) {
        if let Some((registers, next)) = self.frames_of_burst(frames) {
            *frames = registers.map(u16::from_be_bytes);
            // The part answers 0 while it receives the address.
            frames[0] &= 0xff;
            self.transfer = Transfer::Read(next);
            return;
        }
        let mut bytes = frames.map(u16::to_be_bytes);
        self.exchange_all(bytes.as_flattened_mut());
        *frames = bytes.map(u16::from_be_bytes);
    }

    /// Answer to a burst read that begins with the address, as in every tick's read of the data registers, and the
    /// address after the burst. In the answer the register before the first takes the place of the address. `None` for
    /// any other transfer.
    fn frames_of_burst<const FRAMES: usize>(&self, frames: &[u16; FRAMES]) -> Option<([[u8; 2]; FRAMES], u8)> {
        let [address, _] = frames.first()?.to_be_bytes();
        let reads = self.transfer == Transfer::Address && address & reg::READ != 0;
        if !reads || self.time_s < self.ready_from_s || self.dead() {
            return None;
        }
        let before = (address & !reg::READ).checked_sub(1)?;
        let (pairs, _) = self.banks.burst(before, 2 * FRAMES)?.as_chunks();
        Some((*<&[_; FRAMES]>::try_from(pairs).ok()?, before + 2 * FRAMES as u8))
    }

    /// Exchanges one byte in each direction while the chip is selected.
    pub fn exchange(&mut self, byte: u8) -> u8 {
        if self.dead() {
            return FLOATING;
        }
        match self.transfer {
            Transfer::Deselected => FLOATING,
            Transfer::Address => {
                let address = byte & !reg::READ;
                self.transfer = if byte & reg::READ != 0 {
                    Transfer::Read(address)
                } else {
                    Transfer::Write(address)
                };
                0
            }
            Transfer::Read(address) => {
                self.transfer = Transfer::Read(next_address(address));
                self.read(address)
            }
            Transfer::Write(address) => {
                self.transfer = Transfer::Write(next_address(address));
                self.write(address, byte);
                0
            }
        }
    }

    fn read(&mut self, address: u8) -> u8 {
        if self.time_s < self.ready_from_s {
            return 0;
        }
        if address == reg::REG_BANK_SEL {
            return self.banks.get(0, address);
        }
        let bank = self.banks.selected();
        let value = self.banks.get(bank, address);
        if bank == 0 && address == reg::INT_STATUS {
            // Reading clears the register.
            self.banks.set(0, address, 0);
        }
        value
    }

    fn write(&mut self, address: u8, value: u8) {
        if self.time_s < self.ready_from_s {
            return;
        }
        let bank = self.banks.selected();
        match (bank, address) {
            (_, reg::REG_BANK_SEL) => self.banks.set(0, address, value & 7),
            (0, reg::DEVICE_CONFIG) if value & reg::DEVICE_CONFIG_RESET != 0 => {
                self.reset();
                self.ready_from_s = self.time_s + reg::RESET_S;
            }
            // Read-only registers.
            (0, reg::WHO_AM_I | reg::INT_STATUS | reg::TEMP_DATA1..=reg::GYRO_DATA_Z0) => {}
            (0, _) => {
                self.banks.set(0, address, value);
                match address {
                    reg::PWR_MGMT0 => self.power(value),
                    reg::GYRO_CONFIG0 | reg::ACCEL_CONFIG0 | reg::GYRO_ACCEL_CONFIG0 => self.configure(),
                    _ => {}
                }
            }
            (bank, _) => self.banks.set(bank, address, value),
        }
    }
}

/// Address after `address` in a burst, within the same bank.
fn next_address(address: u8) -> u8 {
    (address + 1) & !reg::READ
}
