//! The registers of the part's flash, in two banks of twelve sectors.
//!
//! The HAL has no driver for this flash that leaves the core running, and its register description has one bit too few
//! for a sector of bank 2. This module therefore writes the registers itself.
//!
//! This flash has no error correction. A word that lost a bit reads as another word, so the stores and the image have
//! their own checksums.

use embassy_stm32::Peri;
use embassy_stm32::flash::Error as DriverError;
use embassy_stm32::pac::flash::regs::Sr;
use embassy_stm32::pac::flash::vals::Psize;
use embassy_stm32::pac::{self};
use embassy_stm32::peripherals::FLASH;
use embassy_time::Timer;
use firmware::drive_board::{FLASH_SECTOR_BYTES, SECTORS_PER_BANK};

use super::stm32_registers::flash_map::{FLASH_BASE, UNLOCK_KEYS};

/// The option bytes prevent the reading of a word.
pub struct ProtectedWord;

/// The part's flash.
pub struct TwoBankFlash {
    _peripheral: Peri<'static, FLASH>,
}

/// Bytes that the flash programs at once at 2.7 V or more.
const PROGRAM_BYTES: usize = 4;
/// Number of small sectors at the start of bank 2, which together have the size of one 128 KiB sector.
const SMALL_SECTORS: usize = 5;
/// The sector field of the control register: its first bit, and its mask of five bits.
const SECTOR_FIELD: (u32, u32) = (3, 0x1F);
/// Bit of the sector field that selects bank 2.
const BANK_2: usize = 0x10;

/// Whether the option bytes split the flash into two banks.
pub fn has_two_banks() -> bool {
    !pac::FLASH.optcr().read().n_dbank()
}

/// The sector field of the 128 KiB sector at `offset`; `None` if `offset` is not the start of such a sector in bank 2.
/// The running code is in bank 1.
const fn sector_field(offset: usize) -> Option<u32> {
    match (offset / FLASH_SECTOR_BYTES).checked_sub(SECTORS_PER_BANK) {
        Some(in_bank) if in_bank >= 1 && in_bank < SECTORS_PER_BANK => {
            Some((BANK_2 + SMALL_SECTORS - 1 + in_bank) as u32)
        }
        _ => None,
    }
}

// Sectors 17 and 23, the first and the last erasable sector; a small sector of bank 2 and the end of bank 1, which are
// not erasable.
const _: () = assert!(matches!(sector_field(0x12_0000), Some(0b1_0101)));
const _: () = assert!(matches!(sector_field(0x1F_FFE0), Some(0b1_1011)));
const _: () = assert!(sector_field(0x11_FFE0).is_none() && sector_field(0x0F_FFE0).is_none());

impl TwoBankFlash {
    /// The flash, locked.
    pub fn new(peripheral: Peri<'static, FLASH>) -> Self {
        Self {
            _peripheral: peripheral,
        }
    }

    /// Programs one word of the stores. A power cut halfway leaves only the first bytes, which the stores' checksums
    /// detect.
    pub async fn write_word(&mut self, offset: u32, word: &[u8]) -> Result<(), DriverError> {
        sector_field(offset as usize).ok_or(DriverError::Protected)?;
        unlock()?;
        let mut address = FLASH_BASE + offset as usize;
        for bytes in word.chunks(PROGRAM_BYTES) {
            let bytes = bytes.try_into().map_err(|_| DriverError::Unaligned)?;
            pac::FLASH.cr().write(|w| {
                w.set_psize(Psize::PSIZE32);
                w.set_pg(true);
            });
            // SAFETY: the address lies in bank 2, where no code and no constant is, and is aligned: the stores write
            // whole words. The flash takes the write as an order to program.
            unsafe { core::ptr::write_volatile(address as *mut u32, u32::from_le_bytes(bytes)) };
            cortex_m::asm::dsb();
            // At most 100 us.
            while pac::FLASH.sr().read().bsy() {
                embassy_futures::yield_now().await;
            }
            let result = outcome();
            if result.is_err() {
                lock();
                return result;
            }
            address += PROGRAM_BYTES;
        }
        lock();
        Ok(())
    }

    /// Erases one sector. The core keeps running, because its code is in the other bank.
    pub async fn erase_sector(&mut self, offset: u32) -> Result<(), DriverError> {
        let sector = sector_field(offset as usize).ok_or(DriverError::Protected)?;
        unlock()?;
        let (at, mask) = SECTOR_FIELD;
        pac::FLASH.cr().write(|w| {
            w.set_psize(Psize::PSIZE32);
            w.set_ser(true);
            w.0 |= sector << at;
        });
        // The wrong sector would be the firmware's own.
        if pac::FLASH.cr().read().0 >> at & mask != sector {
            lock();
            return Err(DriverError::Seq);
        }
        pac::FLASH.cr().modify(|w| w.set_strt(true));
        cortex_m::asm::dsb();
        while pac::FLASH.sr().read().bsy() {
            Timer::after_millis(1).await;
        }
        let result = outcome();
        lock();
        result
    }
}

/// Opens the control register, unless the flash has a single bank (an erasure would stop the core for seconds, and the
/// sectors are elsewhere) or is still busy with an abandoned operation.
fn unlock() -> Result<(), DriverError> {
    if !has_two_banks() {
        return Err(DriverError::Protected);
    }
    if pac::FLASH.sr().read().bsy() {
        return Err(DriverError::Seq);
    }
    if pac::FLASH.cr().read().lock() {
        pac::FLASH.keyr().write_value(UNLOCK_KEYS[0]);
        pac::FLASH.keyr().write_value(UNLOCK_KEYS[1]);
    }
    Ok(())
}

/// Leaves every mode and closes the control register.
fn lock() {
    pac::FLASH.cr().write(|w| w.set_lock(true));
}

/// The flash's result of the last operation.
fn outcome() -> Result<(), DriverError> {
    let flags = pac::FLASH.sr().read();
    if flags.wrperr() {
        Err(DriverError::Protected)
    } else if flags.pgaerr() {
        Err(DriverError::Unaligned)
    } else if flags.pgperr() {
        Err(DriverError::Parallelism)
    } else if flags.erserr() || flags.operr() {
        Err(DriverError::Seq)
    } else {
        Ok(())
    }
}

/// Clears the error flags, and ends a mode that an abandoned operation has left on.
pub fn clean_up() {
    // Writing ones clears the flags.
    let mut errors = Sr::default();
    errors.set_operr(true);
    errors.set_wrperr(true);
    errors.set_pgaerr(true);
    errors.set_pgperr(true);
    errors.set_erserr(true);
    errors.set_rderr(true);
    pac::FLASH.sr().write_value(errors);
    if !pac::FLASH.sr().read().bsy() && !pac::FLASH.cr().read().lock() {
        lock();
    }
}

/// Copies bytes out of the flash. This part does not detect a word that lost a bit.
pub fn read_guarded(address: usize, bytes: &mut [u8]) -> Result<(), ProtectedWord> {
    let mut refused = Sr::default();
    refused.set_rderr(true);
    // Writing ones clears the flags.
    pac::FLASH.sr().write_value(refused);
    for (at, byte) in (address..).zip(bytes) {
        // SAFETY: the address lies in the flash, checked by the caller, and any bits are a value. Volatile, because the
        // program writes there behind the compiler's back.
        *byte = unsafe { core::ptr::read_volatile(at as *const u8) };
    }
    if pac::FLASH.sr().read().rderr() {
        return Err(ProtectedWord);
    }
    Ok(())
}
