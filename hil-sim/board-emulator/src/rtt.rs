//! Draining the firmware's log the way a debug probe does.

use rigless::emulator::{Error, Memory};
use rigless::soc::Width;

/// Offsets into the control block of up-channel 0's fields: after the identifier (16 bytes) and the
/// two channel counts, a name, then these.
const BUFFER: u64 = 28;
const SIZE: u64 = 32;
const WRITE: u64 = 36;
const READ: u64 = 40;

/// Moves what the firmware wrote into `out` and its read offset on. Nothing before the firmware has set
/// the block up.
pub fn drain(block: u64, memory: &mut (impl Memory + ?Sized), out: &mut Vec<u8>) -> Result<(), Error> {
    let write = memory.read(block + WRITE, Width::W32)?;
    let mut read = memory.read(block + READ, Width::W32)?;
    if write == read {
        return Ok(());
    }
    let buffer = memory.read(block + BUFFER, Width::W32)?;
    let size = memory.read(block + SIZE, Width::W32)?;
    if write >= size || read >= size {
        return Ok(());
    }
    while read != write {
        out.push(memory.read(buffer + read, Width::W8)? as u8);
        read = (read + 1) % size;
    }
    memory.write(block + READ, Width::W32, read)
}
