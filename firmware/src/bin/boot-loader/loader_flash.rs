//! The boot loader's access to the places of the part's flash: it writes one word or erases one sector at a time and
//! waits for the part. The loader runs from bank 1, so a write to that bank stops the core until the write is over.

use embassy_stm32::pac::flash::Bank;
use embedded_storage_async::nor_flash::{ErrorType, NorFlash, NorFlashError, NorFlashErrorKind, ReadNorFlash};
use firmware::drive_board::{FLASH_SECTOR_BYTES, FLASH_WORD_BYTES, SECTORS_PER_BANK};

use super::flash_banks::{bank_of, clean_up, read_guarded};
use super::slow_watchdog;
use super::stm32_registers::flash_map::{FLASH_BASE, UNLOCK_KEYS};

/// Programs 32 bits at a time, as the firmware's driver does.
const PARALLELISM: u8 = 2;
/// Cycles between two checks of whether the part is done: about 10 us at the 64 MHz after a reset.
const LOOK_CYCLES: u32 = 640;

/// An access failed.
#[derive(Debug, Clone, Copy)]
pub struct LoaderFlashError;

impl NorFlashError for LoaderFlashError {
    fn kind(&self) -> NorFlashErrorKind {
        NorFlashErrorKind::Other
    }
}

/// Some consecutive sectors. The type never accesses memory outside them.
pub struct FlashPlace {
    /// Bytes from the start of the flash.
    start: usize,
    bytes: usize,
}

impl FlashPlace {
    /// The place of `sectors` sectors from the sector `first` on.
    pub const fn new(first: usize, sectors: usize) -> Self {
        Self {
            start: first * FLASH_SECTOR_BYTES,
            bytes: sectors * FLASH_SECTOR_BYTES,
        }
    }

    /// The address of an access to `length` bytes.
    fn access(&self, offset: u32, length: usize) -> Result<usize, LoaderFlashError> {
        let end = (offset as usize).checked_add(length).ok_or(LoaderFlashError)?;
        if end > self.bytes {
            return Err(LoaderFlashError);
        }
        Ok(FLASH_BASE + self.start + offset as usize)
    }
}

/// Opens a bank's control register for the next operation.
fn open(bank: Bank) {
    slow_watchdog::feed();
    clean_up();
    if bank.cr().read().lock() {
        bank.keyr().write_value(UNLOCK_KEYS[0]);
        bank.keyr().write_value(UNLOCK_KEYS[1]);
    }
}

/// Waits until the bank has done its work, locks it, and returns whether it succeeded. The watchdog ends the wait for
/// a bank that never finishes.
fn finish(bank: Bank) -> Result<(), LoaderFlashError> {
    cortex_m::asm::dsb();
    let done = loop {
        let status = bank.sr().read();
        if !status.bsy() && !status.qw() && !status.wbne() {
            break status;
        }
        // A word that an error has left partly in the buffer would stay there.
        if status.pgserr() || status.incerr() {
            break status;
        }
        cortex_m::asm::delay(LOOK_CYCLES);
    };
    let failed = done.wrperr() || done.pgserr() || done.strberr() || done.incerr() || done.operr();
    bank.cr().modify(|w| {
        w.set_pg(false);
        w.set_ser(false);
    });
    bank.cr().modify(|w| w.set_lock(true));
    if failed {
        clean_up();
        return Err(LoaderFlashError);
    }
    Ok(())
}

impl ErrorType for FlashPlace {
    type Error = LoaderFlashError;
}

impl ReadNorFlash for FlashPlace {
    const READ_SIZE: usize = 1;

    async fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), LoaderFlashError> {
        let mut address = self.access(offset, bytes.len())?;
        // A damaged word affects only its own read.
        for word in bytes.chunks_mut(FLASH_WORD_BYTES) {
            read_guarded(address, word).map_err(|_| LoaderFlashError)?;
            address += word.len();
        }
        Ok(())
    }

    fn capacity(&self) -> usize {
        self.bytes
    }
}

impl NorFlash for FlashPlace {
    const WRITE_SIZE: usize = FLASH_WORD_BYTES;
    const ERASE_SIZE: usize = FLASH_SECTOR_BYTES;

    async fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), LoaderFlashError> {
        let start = self.access(offset, bytes.len())?;
        let (words, rest) = bytes.as_chunks::<FLASH_WORD_BYTES>();
        if !rest.is_empty() || !start.is_multiple_of(FLASH_WORD_BYTES) {
            return Err(LoaderFlashError);
        }
        for (word, at) in words.iter().zip((start..).step_by(FLASH_WORD_BYTES)) {
            let bank = bank_of(at);
            open(bank);
            bank.cr().modify(|w| {
                w.set_pg(true);
                w.set_psize(PARALLELISM);
            });
            cortex_m::asm::dsb();
            for (part, place) in word.as_chunks::<4>().0.iter().zip((at..).step_by(4)) {
                // SAFETY: the place lies in the flash, outside this program, and takes stores while PG is set.
                unsafe { core::ptr::write_volatile(place as *mut u32, u32::from_le_bytes(*part)) };
            }
            finish(bank)?;
        }
        Ok(())
    }

    async fn erase(&mut self, from: u32, to: u32) -> Result<(), LoaderFlashError> {
        let start = self.access(from, to.saturating_sub(from) as usize)?;
        for at in (start..start + to.saturating_sub(from) as usize).step_by(FLASH_SECTOR_BYTES) {
            let sector = (at - FLASH_BASE) / FLASH_SECTOR_BYTES;
            let bank = bank_of(at);
            open(bank);
            bank.cr().modify(|w| {
                w.set_ser(true);
                w.set_snb((sector % SECTORS_PER_BANK) as u8);
                w.set_psize(PARALLELISM);
            });
            bank.cr().modify(|w| w.set_start(true));
            finish(bank)?;
        }
        Ok(())
    }
}
