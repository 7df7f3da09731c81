//! The flash that the firmware writes: at the end of bank 2 the stored parameters, before them the fault history.
//! Erasing them does not stall the code, which runs from bank 1.

use embassy_futures::yield_now;
use embassy_stm32::flash::{Async, Error as DriverError, Flash};
use embassy_stm32::pac;
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::mutex::Mutex;
use embedded_storage_async::nor_flash::{ErrorType, NorFlash, NorFlashError, NorFlashErrorKind, ReadNorFlash};
use firmware::drive_board::{FLASH_SECTOR_BYTES, FLASH_WORD_BYTES, HISTORY_SECTORS, PARAMETER_SECTORS};
use firmware::flash_region::FlashRegion;
use static_cell::StaticCell;

/// Sectors of the part's flash.
const SECTORS: usize = 16;
/// Where the flash appears to the core.
const FLASH_BASE: usize = 0x0800_0000;

/// Bit of the system control block's `CCR`: the core ignores data bus faults while FAULTMASK is set.
const CCR_BFHFNMIGN: u32 = 1 << 8;
/// Bits of the system control block's `CFSR` that report bus faults.
const CFSR_BUS_FAULTS: u32 = 0x0000_FF00;

/// Why an access failed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, defmt::Format)]
pub enum StorageError {
    /// The access does not lie in the region.
    Bounds,
    /// A word has two bit errors or more, as a power cut during a write can leave.
    Unreadable,
    /// The flash failed to program or to erase.
    Program(DriverError),
}

impl NorFlashError for StorageError {
    fn kind(&self) -> NorFlashErrorKind {
        match self {
            Self::Bounds => NorFlashErrorKind::OutOfBounds,
            Self::Unreadable | Self::Program(_) => NorFlashErrorKind::Other,
        }
    }
}

/// Words that are read without a pause. Reading never waits, and the store may read a whole sector in one
/// go: the pauses give the other tasks of its executor their turns.
const WORDS_WITHOUT_PAUSE: u32 = 16;

/// The part's flash.
pub struct BoardFlash {
    flash: Flash<'static, Async>,
    words_since_pause: u32,
}

/// A region of the part's flash.
pub type Region = FlashRegion<'static, CriticalSectionRawMutex, BoardFlash>;

/// Takes the flash driver, and returns the regions of the parameters and of the fault history. To be called once.
pub fn regions(flash: Flash<'static, Async>) -> (Region, Region) {
    static FLASH: StaticCell<Mutex<CriticalSectionRawMutex, BoardFlash>> = StaticCell::new();
    let flash: &'static _ = FLASH.init(Mutex::new(BoardFlash {
        flash,
        words_since_pause: 0,
    }));
    let parameters = SECTORS - PARAMETER_SECTORS;
    (
        FlashRegion::new(flash, parameters, PARAMETER_SECTORS),
        FlashRegion::new(flash, parameters - HISTORY_SECTORS, HISTORY_SECTORS),
    )
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
            // Interrupts are off for one word at most.
            let length = rest.len().min(FLASH_WORD_BYTES - address % FLASH_WORD_BYTES);
            let (piece, after) = rest.split_at_mut(length);
            read_guarded(address, piece)?;
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
        self.flash.write(offset, bytes).await.map_err(StorageError::Program)
    }

    async fn erase(&mut self, from: u32, to: u32) -> Result<(), StorageError> {
        check(from, to.checked_sub(from).ok_or(StorageError::Bounds)? as usize)?;
        self.flash.erase(from, to).await.map_err(StorageError::Program)
    }
}

/// Copies bytes out of one flash word. Reading a word with an uncorrectable error raises a bus fault, which
/// would end every boot anew; this function masks the bus fault and returns an error.
fn read_guarded(address: usize, bytes: &mut [u8]) -> Result<(), StorageError> {
    let bank = pac::FLASH.bank(1);
    bank.ccr().write(|w| w.set_clr_dbeccerr(true));
    // SAFETY: the system control block is a device of the core, and nothing else in this program writes
    // CCR after start-up nor reads CFSR outside a fault handler, which cannot run while FAULTMASK is set.
    let scb = unsafe { &*cortex_m::peripheral::SCB::PTR };
    let (damaged, faulted);
    // SAFETY: FAULTMASK raises the priority above every handler but NMI and is lowered again below; with
    // BFHFNMIGN a data bus fault is then ignored. The address lies in the flash, checked by the caller.
    unsafe {
        cortex_m::asm::dsb();
        core::arch::asm!("cpsid f", options(nomem, nostack));
        scb.ccr.modify(|w| w | CCR_BFHFNMIGN);
        cortex_m::asm::dsb();
        cortex_m::asm::isb();
        for (n, byte) in bytes.iter_mut().enumerate() {
            *byte = core::ptr::read_volatile((address + n) as *const u8);
        }
        cortex_m::asm::dsb();
        faulted = scb.cfsr.read() & CFSR_BUS_FAULTS != 0;
        // Writing ones clears the flags.
        scb.cfsr.write(CFSR_BUS_FAULTS);
        scb.ccr.modify(|w| w & !CCR_BFHFNMIGN);
        cortex_m::asm::dsb();
        core::arch::asm!("cpsie f", options(nomem, nostack));
    }
    damaged = bank.sr().read().dbeccerr();
    bank.ccr().write(|w| w.set_clr_dbeccerr(true));
    if damaged || faulted {
        return Err(StorageError::Unreadable);
    }
    Ok(())
}
