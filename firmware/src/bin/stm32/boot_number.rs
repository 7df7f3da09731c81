//! A number that differs from boot to boot, so that frames recorded in one boot mean nothing in another.

use core::mem::MaybeUninit;

use embassy_stm32::pac;

/// The number, and padding that is written after it: the RAM's error correction holds back the last partial write
/// until the next write, and a reset would lose the held write.
#[repr(C, align(8))]
struct BootRecord {
    number: u32,
    flush: [u64; 2],
}

/// Kept over resets; 0 after power-up ([`super::ram`]).
#[unsafe(link_section = ".uninit.boot_number")]
static mut BOOT_RECORD: MaybeUninit<BootRecord> = MaybeUninit::uninit();

/// Step from boot to boot. The step is odd, so all numbers occur before one repeats, and large, so consecutive numbers
/// differ much.
const STEP: u32 = 0x9E37_79B9;

/// Largest number of reads of the random number generator's status. Its first word takes some microseconds.
const WAIT_READS: u32 = 100_000;

/// The number of this boot. To be called once, before the tasks start, with the 48 MHz oscillator running.
pub fn take() -> u32 {
    // SAFETY: start-up is single threaded, and nothing else accesses the record. It consists of plain integers, for
    // which any bits are a value, and power-up wrote it.
    let last = unsafe { core::ptr::read_volatile((&raw const BOOT_RECORD).cast::<u32>()) };
    // Without a random number the first boot after each power-up has the same number: the vehicle drives anyway.
    let before = if last == 0 { random().unwrap_or_default() } else { last };
    let number = before.wrapping_add(STEP);
    let record = BootRecord { number, flush: [0; 2] };
    // SAFETY: as above.
    unsafe { core::ptr::write_volatile((&raw mut BOOT_RECORD).cast::<BootRecord>(), record) };
    number
}

/// A word of the random number generator; `None` if the generator reports an error or returns no word in time.
fn random() -> Option<u32> {
    critical_section::with(|_| pac::RCC.ahb2enr().modify(|w| w.set_rngen(true)));
    pac::RNG.cr().write(|w| w.set_rngen(true));
    let word = (0..WAIT_READS)
        .map(|_| pac::RNG.sr().read())
        .find(|status| status.drdy() || status.secs() || status.cecs())
        .filter(|status| status.drdy() && !status.secs() && !status.cecs())
        .map(|_| pac::RNG.dr().read());
    pac::RNG.cr().write(|w| w.set_rngen(false));
    critical_section::with(|_| pac::RCC.ahb2enr().modify(|w| w.set_rngen(false)));
    word
}
