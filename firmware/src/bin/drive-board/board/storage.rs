//! The flash that the firmware writes: at the end of bank 2 the stored parameters, before them the fault history.
//! Erasing them does not stall the code, which runs from bank 1.

use embassy_futures::yield_now;
use embassy_stm32::flash::{Async, Error as DriverError, Flash};
use embassy_stm32::pac;
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::mutex::Mutex;
use embassy_time::{Duration, TimeoutError, with_timeout};
use embedded_storage_async::nor_flash::{ErrorType, NorFlash, NorFlashError, NorFlashErrorKind, ReadNorFlash};
use firmware::drive_board::{
    FLASH_SECTOR_BYTES, FLASH_WORD_BYTES, HISTORY_SECTORS, PARAMETER_SECTORS, SECTORS_PER_BANK,
};
use firmware::flash_region::FlashRegion;
use static_cell::StaticCell;

/// Sectors of the part's flash.
const SECTORS: usize = 2 * SECTORS_PER_BANK;
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
        supply_allows()?;
        for (word, at) in bytes.chunks(FLASH_WORD_BYTES).zip((offset..).step_by(FLASH_WORD_BYTES)) {
            clean_up();
            let written = with_timeout(WRITE_TIME, self.flash.write(at, word)).await;
            finish(written)?;
        }
        Ok(())
    }

    async fn erase(&mut self, from: u32, to: u32) -> Result<(), StorageError> {
        check(from, to.checked_sub(from).ok_or(StorageError::Bounds)? as usize)?;
        for sector in (from..to).step_by(FLASH_SECTOR_BYTES) {
            supply_allows()?;
            clean_up();
            let end = sector + FLASH_SECTOR_BYTES as u32;
            let erased = with_timeout(ERASE_TIME, self.flash.erase(sector, end)).await;
            finish(erased)?;
        }
        Ok(())
    }
}

/// Longest time of the write of one word; the data sheet gives 600 us at most.
const WRITE_TIME: Duration = Duration::from_millis(20);
/// Longest time of the erasure of one sector; the data sheet gives 4 s at most.
const ERASE_TIME: Duration = Duration::from_secs(8);

/// The result of a write or an erasure. A failed one leaves neither flags nor a word half written to the flash's buffer.
fn finish(result: Result<Result<(), DriverError>, TimeoutError>) -> Result<(), StorageError> {
    let result = result.map_err(|_| StorageError::TimedOut)?;
    if result.is_err() {
        clean_up();
    }
    result.map_err(StorageError::Program)
}

/// Clears the error flags of both banks and empties their write buffers.
///
/// The part clears these flags through its clear registers alone. The HAL writes the status registers, which changes
/// nothing: without this function the first error of a bank, a corrected single error of a read among them, fails every
/// write after it. A write that was given up leaves the bank in its programming mode, with what it had written in the
/// buffer; leaving that mode drops it.
fn clean_up() {
    for bank in [0, 1].map(|n| pac::FLASH.bank(n)) {
        // The end of an operation is no error: the driver waits for it.
        bank.ccr().write(|w| {
            w.set_clr_wrperr(true);
            w.set_clr_pgserr(true);
            w.set_clr_strberr(true);
            w.set_clr_incerr(true);
            w.set_clr_operr(true);
            w.set_clr_rdperr(true);
            w.set_clr_rdserr(true);
            w.set_clr_sneccerr(true);
            w.set_clr_dbeccerr(true);
        });
        if bank.cr().read().pg() {
            if bank.cr().read().lock() {
                bank.keyr().write_value(UNLOCK_KEYS[0]);
                bank.keyr().write_value(UNLOCK_KEYS[1]);
            }
            bank.cr().modify(|w| w.set_pg(false));
            bank.cr().modify(|w| w.set_lock(true));
        }
    }
}

/// What unlocks the control register of a bank, in this order.
const UNLOCK_KEYS: [u32; 2] = [0x4567_0123, 0xCDEF_89AB];

/// Level 6 of the supply's detector: 2.85 V at the falling edge.
const SUPPLY_LEVEL: u8 = 6;

/// Switches the detector of the part's supply on.
pub fn watch_supply() {
    pac::PWR.cr1().modify(|w| {
        w.set_pls(SUPPLY_LEVEL);
        w.set_pvde(true);
    });
}

/// Refuses a write while the supply is below the detector's level: it is about to fail, and the write with it.
fn supply_allows() -> Result<(), StorageError> {
    if pac::PWR.csr1().read().pvdo() {
        return Err(StorageError::LowSupply);
    }
    Ok(())
}

/// The bank of the flash that holds an address.
fn bank_of(address: usize) -> pac::flash::Bank {
    pac::FLASH.bank(usize::from(
        address >= FLASH_BASE + SECTORS_PER_BANK * FLASH_SECTOR_BYTES,
    ))
}

/// Copies bytes out of one flash word. Reading a word with an uncorrectable error raises a bus fault, which
/// would end every boot anew; this function masks the bus fault and returns an error.
pub(super) fn read_guarded(address: usize, bytes: &mut [u8]) -> Result<(), StorageError> {
    let bank = bank_of(address);
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
        // Every read goes to the bus, because the data cache is off: where it can, one read takes four bytes.
        let (words, rest) = if address.is_multiple_of(4) {
            bytes.as_chunks_mut()
        } else {
            ([].as_mut_slice(), bytes)
        };
        let mut at = address;
        for word in words {
            *word = core::ptr::read_volatile(at as *const u32).to_le_bytes();
            at += 4;
        }
        for byte in rest {
            *byte = core::ptr::read_volatile(at as *const u8);
            at += 1;
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
