//! The flash that the firmware writes: the stored parameters at the end of bank 2, the fault history before them, and,
//! on the first board, an image from the link at the start of bank 2. Erasing them does not stall the code, which runs
//! from bank 1.

use embassy_futures::yield_now;
use embassy_stm32::flash::Error as DriverError;
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::mutex::Mutex;
use embassy_time::{Duration, TimeoutError, with_timeout};
use embedded_storage_async::nor_flash::{ErrorType, NorFlash, NorFlashError, NorFlashErrorKind, ReadNorFlash};
use firmware::drive_board::{
    ARRIVED_SECTORS, FLASH_SECTOR_BYTES, FLASH_WORD_BYTES, HISTORY_SECTORS, PARAMETER_SECTORS, SECTORS_PER_BANK, memory,
};
use firmware::flash_region::FlashRegion;
use static_cell::StaticCell;

use super::supply;
use crate::board::PartFlash;
use crate::board::flash::{clean_up, read_guarded};
use crate::board::stm32_registers::flash_map::FLASH_BASE;

/// Sectors of the part's flash.
const SECTORS: usize = 2 * SECTORS_PER_BANK;

/// Why an access failed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, defmt::Format)]
pub enum StorageError {
    /// The access is outside the region.
    Bounds,
    /// The part cannot read a word, because it has two or more bit errors, as after a power cut during a write, or is
    /// protected.
    Unreadable,
    /// The flash failed to program or to erase.
    Program(DriverError),
    /// The flash did not finish in time.
    TimedOut,
    /// The part's supply is too low to write.
    LowSupply,
}

impl NorFlashError for StorageError {
    fn kind(&self) -> NorFlashErrorKind {
        match self {
            Self::Bounds => NorFlashErrorKind::OutOfBounds,
            Self::Unreadable | Self::Program(_) | Self::TimedOut | Self::LowSupply => NorFlashErrorKind::Other,
        }
    }
}

/// Number of words that are read without a pause. Reads never wait, and the store may read a whole sector at once; the
/// pauses let the other tasks of the executor run.
const WORDS_WITHOUT_PAUSE: u32 = 16;

/// The part's flash.
pub struct BoardFlash {
    flash: PartFlash,
    words_since_pause: u32,
}

/// A region of the part's flash.
pub type Region = FlashRegion<'static, CriticalSectionRawMutex, BoardFlash>;

/// The parts of the flash that the firmware writes.
pub struct Regions {
    /// Stored parameters.
    pub parameters: Region,
    /// Fault history.
    pub fault_history: Region,
    /// An image that arrives over the link; `None` on a board without a place for it.
    pub update: Option<Region>,
}

/// Takes the flash driver, and returns the regions. To be called once.
pub fn regions(flash: PartFlash) -> Regions {
    static FLASH: StaticCell<Mutex<CriticalSectionRawMutex, BoardFlash>> = StaticCell::new();
    let flash: &'static _ = FLASH.init(Mutex::new(BoardFlash {
        flash,
        words_since_pause: 0,
    }));
    let parameters = SECTORS - PARAMETER_SECTORS;
    Regions {
        parameters: FlashRegion::new(flash, parameters, PARAMETER_SECTORS),
        fault_history: FlashRegion::new(flash, parameters - HISTORY_SECTORS, HISTORY_SECTORS),
        update: memory::ARRIVED_SECTOR.map(|first| FlashRegion::new(flash, first, ARRIVED_SECTORS)),
    }
}

/// Checks that an access stays in the flash.
fn check(offset: u32, length: usize) -> Result<(), StorageError> {
    match (offset as usize).checked_add(length) {
        Some(end) if end <= SECTORS * FLASH_SECTOR_BYTES => Ok(()),
        _ => Err(StorageError::Bounds),
    }
}

impl ErrorType for BoardFlash {
    type Error = StorageError;
}

impl ReadNorFlash for BoardFlash {
    const READ_SIZE: usize = 1;

    async fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), StorageError> {
        check(offset, bytes.len())?;
        let mut address = FLASH_BASE + offset as usize;
        let mut rest = bytes;
        while !rest.is_empty() {
            // Interrupts are off for at most one word.
            let length = rest.len().min(FLASH_WORD_BYTES - address % FLASH_WORD_BYTES);
            let (piece, after) = rest.split_at_mut(length);
            read(address, piece)?;
            self.words_since_pause += 1;
            if self.words_since_pause >= WORDS_WITHOUT_PAUSE {
                self.words_since_pause = 0;
                yield_now().await;
            }
            address += length;
            rest = after;
        }
        Ok(())
    }

    fn capacity(&self) -> usize {
        SECTORS * FLASH_SECTOR_BYTES
    }
}

impl NorFlash for BoardFlash {
    const WRITE_SIZE: usize = FLASH_WORD_BYTES;
    const ERASE_SIZE: usize = FLASH_SECTOR_BYTES;

    async fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), StorageError> {
        check(offset, bytes.len())?;
        supply_allows()?;
        for (word, at) in bytes.chunks(FLASH_WORD_BYTES).zip((offset..).step_by(FLASH_WORD_BYTES)) {
            clean_up();
            let written = with_timeout(WRITE_TIME, self.flash.write_word(at, word)).await;
            finish(written)?;
        }
        Ok(())
    }

    async fn erase(&mut self, from: u32, to: u32) -> Result<(), StorageError> {
        check(from, to.checked_sub(from).ok_or(StorageError::Bounds)? as usize)?;
        for sector in (from..to).step_by(FLASH_SECTOR_BYTES) {
            supply_allows()?;
            clean_up();
            let erased = with_timeout(ERASE_TIME, self.flash.erase_sector(sector)).await;
            finish(erased)?;
        }
        Ok(())
    }
}

/// Longest time of the write of one word; the data sheet gives 600 us at most.
const WRITE_TIME: Duration = Duration::from_millis(20);
/// Longest time of the erasure of one sector; the data sheet gives 4 s at most.
const ERASE_TIME: Duration = Duration::from_secs(8);

/// The result of a write or an erasure. After a failure, the function clears the flags and a partly written word in the
/// flash's buffer.
fn finish(result: Result<Result<(), DriverError>, TimeoutError>) -> Result<(), StorageError> {
    let result = result.map_err(|_| StorageError::TimedOut)?;
    if result.is_err() {
        clean_up();
    }
    result.map_err(StorageError::Program)
}

/// Refuses a write while the supply is about to fail, because the write would fail, too.
fn supply_allows() -> Result<(), StorageError> {
    if supply::is_low() {
        return Err(StorageError::LowSupply);
    }
    Ok(())
}

/// Copies bytes out of one flash word.
pub fn read(address: usize, bytes: &mut [u8]) -> Result<(), StorageError> {
    read_guarded(address, bytes).map_err(|_| StorageError::Unreadable)
}
