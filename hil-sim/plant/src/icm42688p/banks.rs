//! The part's registers: some banks of bytes.

use super::Words;
use super::registers as reg;

/// Registers of one bank.
const BANK_SIZE: usize = 128;
const BANKS: usize = 5;

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

    /// A register; 0 where there is none.
    pub(super) fn get(&self, bank: usize, address: u8) -> u8 {
        self.0
            .get(bank)
            .and_then(|registers| registers.get(usize::from(address)))
            .copied()
            .unwrap_or(0)
    }

    /// Changes a register, if there is one.
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

    /// The data registers as they stand.
    pub(super) fn words(&self) -> Words {
        let mut address = reg::TEMP_DATA1;
        core::array::from_fn(|_| {
            let word = i16::from_be_bytes([self.get(0, address), self.get(0, address + 1)]);
            address += 2;
            word
        })
    }

    /// Puts a sample into the data registers.
    pub(super) fn set_words(&mut self, words: &Words) {
        let bytes = words.iter().flat_map(|word| word.to_be_bytes());
        for (address, byte) in (reg::TEMP_DATA1..).zip(bytes) {
            self.set(0, address, byte);
        }
    }
}
