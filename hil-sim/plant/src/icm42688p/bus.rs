//! The part's serial bus: transfers, the registers that are read and written through them.

use super::Icm42688pModel;
use super::registers as reg;

/// Answer of a bus without a driver.
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
    /// One chip-selected transfer: the first byte is the address (with the read bit), every further one
    /// is written, or replaced by what is read.
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
    pub fn deselect(&mut self) {
        self.transfer = Transfer::Deselected;
        if let Some(words) = self.pending.take() {
            self.publish(&words);
        }
    }

    /// Bytes each way while the chip is selected: as [`Self::exchange`] one after the other.
    // A call, so that a caller's bytes are bytes in memory and not one register each.
    #[inline(never)]
    pub fn exchange_all(&mut self, bytes: &mut [u8]) {
        let Some((first, rest)) = bytes.split_first_mut() else {
            return;
        };
        *first = self.exchange(*first);
        // Every tick reads the data registers in one burst.
        if let Transfer::Read(address) = self.transfer
            && self.time_s >= self.ready_from_s
            && !self.dead()
            && let Some(registers) = self.banks.burst(address, rest.len())
        {
            rest.copy_from_slice(registers);
            self.transfer = Transfer::Read(address + rest.len() as u8);
            return;
        }
        for byte in rest {
            *byte = self.exchange(*byte);
        }
    }

    /// One byte each way while the chip is selected.
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
            // Reading clears.
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
            // Read only.
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

/// Address after `address` in a burst; it stays within the bank.
fn next_address(address: u8) -> u8 {
    (address + 1) & !reg::READ
}
