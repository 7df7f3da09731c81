//! Last words: a panic or a fault opens the bridges, stores its message for the next boot and resets the part.

use core::fmt::{self, Write};
use core::mem::MaybeUninit;
use core::panic::PanicInfo;

use cortex_m::peripheral::SCB;
use cortex_m_rt::{ExceptionFrame, exception};
use crc::{CRC_32_ISCSI, Crc, NoTable};
use firmware::hardware::ResetCause;

use super::bridges;
use crate::board::clocks;

/// Bytes of the longest stored message.
const TEXT_BYTES: usize = 240;
/// Checksum of the record's text, without a table in flash: the text is short, and its checksum need not be fast.
const TABLELESS_CHECKSUM: Crc<u32, NoTable> = Crc::<u32, NoTable>::new(&CRC_32_ISCSI);
/// Marks a record as written: after power-up the record is all zeros ([`super::ram`]).
const MAGIC: u32 = 0x4C41_5354;

/// The record that survives a reset.
#[repr(C, align(8))]
struct CrashRecord {
    magic: u32,
    length: u32,
    checksum: u32,
    text: [u8; TEXT_BYTES],
    /// Written after everything else: the RAM's error correction holds back the last partial write until the next
    /// write, and a reset would lose the held write.
    flush: [u64; 2],
}

#[unsafe(link_section = ".uninit.crash")]
static mut CRASH_RECORD: MaybeUninit<CrashRecord> = MaybeUninit::uninit();

/// The message of the last run.
pub struct LastWords {
    text: [u8; TEXT_BYTES],
    length: usize,
}

impl LastWords {
    /// The message.
    pub fn as_str(&self) -> &str {
        let bytes = self.text.get(..self.length).unwrap_or_default();
        // If a message was cut in the middle of a character, the part before the character is kept.
        core::str::from_utf8(bytes)
            .or_else(|error| core::str::from_utf8(bytes.get(..error.valid_up_to()).unwrap_or_default()))
            .unwrap_or_default()
    }
}

/// Takes the message of the last run, if any. After a start of the supply there is no message, because the RAM has
/// lost its contents. To be called before the tasks start.
pub fn take(cause: ResetCause) -> Option<LastWords> {
    if matches!(cause, ResetCause::PowerOn | ResetCause::BrownOut) {
        return None;
    }
    // SAFETY: start-up is single threaded, and only a dying program accesses the record otherwise. The record
    // consists of plain integers, for which any bits are a value; the volatile read keeps the compiler from
    // reasoning about memory that nothing initialised.
    let record = unsafe { core::ptr::read_volatile((&raw const CRASH_RECORD).cast::<CrashRecord>()) };
    // SAFETY: as above.
    unsafe { core::ptr::write_volatile((&raw mut CRASH_RECORD).cast::<u32>(), 0) };
    let length = record.length as usize;
    let text = record.text.get(..length)?;
    (record.magic == MAGIC && record.checksum == TABLELESS_CHECKSUM.checksum(text)).then_some(LastWords {
        text: record.text,
        length,
    })
}

/// Text cut to a fixed length.
struct Text {
    bytes: [u8; TEXT_BYTES],
    length: usize,
}

impl Write for Text {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        for (to, from) in self.bytes.iter_mut().skip(self.length).zip(text.bytes()) {
            *to = from;
            self.length += 1;
        }
        Ok(())
    }
}

/// Opens the bridges, then stores the message, then resets the part.
fn die(message: fmt::Arguments<'_>) -> ! {
    // Interrupts first: a task of higher priority could close a bridge again after it was opened.
    cortex_m::interrupt::disable();
    bridges::open_all();
    let mut text = Text {
        bytes: [0; TEXT_BYTES],
        length: 0,
    };
    // `Text` cuts a long message and never returns an error.
    let _ = text.write_fmt(message);
    let record = CrashRecord {
        magic: MAGIC,
        length: text.length as u32,
        checksum: TABLELESS_CHECKSUM.checksum(text.bytes.get(..text.length).unwrap_or_default()),
        text: text.bytes,
        flush: [0; 2],
    };
    // SAFETY: interrupts are off and the program ends here, so nothing else accesses the record.
    unsafe { core::ptr::write_volatile((&raw mut CRASH_RECORD).cast::<CrashRecord>(), record) };
    cortex_m::asm::dsb();
    SCB::sys_reset();
}

#[panic_handler]
fn panic(info: &PanicInfo<'_>) -> ! {
    die(format_args!("{info}"))
}

#[exception]
unsafe fn HardFault(frame: &ExceptionFrame) -> ! {
    // SAFETY: a read of a core register that nothing else uses.
    let cfsr = unsafe { (*SCB::PTR).cfsr.read() };
    die(format_args!(
        "hard fault at {:#010x}, called from {:#010x}, cfsr {cfsr:#010x}",
        frame.pc(),
        frame.lr()
    ))
}

/// The clock security system calls this when the external clock stops. The part then runs on its own oscillator, every
/// time is wrong, and the next start takes the internal oscillator.
#[exception]
unsafe fn NonMaskableInt() -> ! {
    bridges::open_all();
    if clocks::external_clock_stopped() {
        die(format_args!("the external clock stopped"))
    }
    die(format_args!("non-maskable interrupt"))
}

#[exception]
unsafe fn DefaultHandler(number: i16) -> ! {
    die(format_args!("interrupt {number} has no handler"))
}
