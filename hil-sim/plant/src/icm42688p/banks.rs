//! The part's registers in their banks.

use super::registers as reg;

/// A sample: temperature, accelerometer x, y, z, gyro x, y, z, as in the registers from TEMP_DATA1.
pub(super) type Words = [i16; 7];

/// Registers of one bank.
const BANK_SIZE: usize = 128;
const BANKS: usize = 5;
/// First of the data registers.
const DATA: usize = reg::TEMP_DATA1 as usize;

/// Every register.
#[derive(Debug, Clone)]
pub(super) struct Banks(Box<[[u8; BANK_SIZE]; BANKS]>);

impl Banks {
    /// Every register at its reset value.
    pub(super) fn reset() -> Self {
        let mut banks = Self(Box::new([[0; BANK_SIZE]; BANKS]));
        for &(address, value) in reg::RESET_VALUES {
            banks.set(0, address, value);
        }
        banks
    }

    /// A register's value; 0 if the register does not exist.
    #[inline]
    pub(super) fn get(&self, bank: usize, address: u8) -> u8 {
        self.0
            .get(bank)
            .and_then(|registers| registers.get(usize::from(address)))
            .copied()
            .unwrap_or(0)
    }

    /// Changes a register, if it exists.
    #[inline]
    pub(super) fn set(&mut self, bank: usize, address: u8, value: u8) {
        if let Some(register) = self
            .0
            .get_mut(bank)
            .and_then(|registers| registers.get_mut(usize::from(address)))
        {
            *register = value;
        }
    }

    /// The bank that is selected.
    pub(super) fn selected(&self) -> usize {
        usize::from(self.get(0, reg::REG_BANK_SEL) & 7)
    }

    /// `count` registers from `address` on, if bank 0 is selected and none of them has a side effect when read.
    #[inline]
    pub(super) fn burst(&self, address: u8, count: usize) -> Option<&[u8]> {
        let begin = usize::from(address);
        let end = begin + count;
        if end > usize::from(reg::INT_STATUS) || self.selected() != 0 {
            return None;
        }
        self.0[0].get(begin..end)
    }

    /// The present contents of the data registers.
    #[inline]
    pub(super) fn words(&self) -> Words {
        let bank = &self.0[0];
        core::array::from_fn(|i| i16::from_be_bytes([bank[DATA + 2 * i], bank[DATA + 2 * i + 1]]))
    }

    /// Writes a sample to the data registers.
    #[inline]
    pub(super) fn set_words(&mut self, words: &Words) {
        let bank = &mut self.0[0];
        for (i, word) in words.iter().enumerate() {
            [bank[DATA + 2 * i], bank[DATA + 2 * i + 1]] = word.to_be_bytes();
        }
    }
}
