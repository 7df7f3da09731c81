//! The registers of the part's two flash banks, for reading and cleaning up in both the firmware and the boot loader.

use embassy_stm32::pac;
use firmware::drive_board::{FLASH_SECTOR_BYTES, SECTORS_PER_BANK};

use super::stm32_registers::flash_map::{FLASH_BASE, UNLOCK_KEYS};

/// Bit of the system control block's `CCR`: the core ignores data bus faults while FAULTMASK is set.
const CCR_BFHFNMIGN: u32 = 1 << 8;
/// Bits of the system control block's `CFSR` that report bus faults.
const CFSR_BUS_FAULTS: u32 = 0x0000_FF00;

/// A word has two or more bit errors, as after a power cut during a write.
pub struct DamagedWord;

/// Clears the error flags of both banks and empties their write buffers.
///
/// The part clears these flags only through its clear registers. The HAL writes the status registers, which has no
/// effect: without this function the first error of a bank, even a corrected single-bit error of a read, would fail
/// every later write. An abandoned write leaves the bank in its programming mode with the written data in the buffer;
/// leaving that mode drops the data.
pub fn clean_up() {
    for bank in [0, 1].map(|n| pac::FLASH.bank(n)) {
        // The end-of-operation flag is no error; the driver waits for it.
        bank.ccr().write(|w| {
            w.set_clr_wrperr(true);
            w.set_clr_pgserr(true);
            w.set_clr_strberr(true);
            w.set_clr_incerr(true);
            w.set_clr_operr(true);
            w.set_clr_rdperr(true);
            w.set_clr_rdserr(true);
            w.set_clr_crcrderr(true);
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

/// The bank of the flash that holds an address.
pub fn bank_of(address: usize) -> pac::flash::Bank {
    pac::FLASH.bank(usize::from(
        address >= FLASH_BASE + SECTORS_PER_BANK * FLASH_SECTOR_BYTES,
    ))
}

/// Copies bytes out of one flash word. Reading a word with an uncorrectable error raises a bus fault, which would end
/// every boot. This function masks the bus fault and returns an error.
pub fn read_guarded(address: usize, bytes: &mut [u8]) -> Result<(), DamagedWord> {
    let bank = bank_of(address);
    // The read would stall the core until the bank is done, with every interrupt but one off.
    if bank.sr().read().bsy() {
        return Err(DamagedWord);
    }
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
        // Every read goes to the bus, because the data cache is off. Where possible, one read fetches four bytes.
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
        return Err(DamagedWord);
    }
    Ok(())
}
