//! A number that differs from boot to boot, so that frames recorded in one boot mean nothing in another.

use core::mem::MaybeUninit;

/// The number, and what is written after it: the RAM's error correction holds the last partial write back until the
/// next write, and a reset would lose it.
#[repr(C, align(8))]
struct BootRecord {
    number: u32,
    flush: [u64; 2],
}

/// Kept over resets. After power-up the RAM holds anything, which is as good a number to begin with.
#[unsafe(link_section = ".uninit.boot_number")]
static mut RECORD: MaybeUninit<BootRecord> = MaybeUninit::uninit();

/// Step from boot to boot: odd, so every number comes before one comes again, and far from the numbers around.
const STEP: u32 = 0x9E37_79B9;

/// The number of this boot. To be called once, before the tasks start.
pub fn take() -> u32 {
    // SAFETY: start-up is single threaded, and nothing else accesses the record. It consists of plain integers, for
    // which any bits are a value; the volatile read keeps the compiler from reasoning about memory that nothing
    // initialised.
    let number = unsafe { core::ptr::read_volatile((&raw const RECORD).cast::<u32>()) }.wrapping_add(STEP);
    let record = BootRecord { number, flush: [0; 2] };
    // SAFETY: as above.
    unsafe { core::ptr::write_volatile((&raw mut RECORD).cast::<BootRecord>(), record) };
    number
}
