//! The firmware's log: drained the way a debug probe does, decoded by the dictionary in the ELF.

use rigless::emulator::{self, Memory};
use rigless::soc::Width;

use super::firmware::Firmware;
use crate::error::Error;

/// Offsets into the RTT control block of up-channel 0's fields: after the identifier (16 bytes), the two
/// channel counts and the channel's name.
const BUFFER: u64 = 28;
const SIZE: u64 = 32;
const WRITE: u64 = 36;
const READ: u64 = 40;

/// Appends to `out` what the firmware has written since the last drain, and advances the channel's read
/// offset. Drains nothing before the firmware has set the control block up.
pub(crate) fn drain(block: u64, memory: &mut (impl Memory + ?Sized), out: &mut Vec<u8>) -> Result<(), emulator::Error> {
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

impl Firmware {
    /// Decodes the log from the bytes that came through RTT.
    ///
    /// # Errors
    /// [`Error::Log`] when the ELF carries no log dictionary.
    pub fn decode(&self, rtt: &[u8]) -> Result<Vec<String>, Error> {
        let table = defmt_decoder::Table::parse(self.bytes())
            .map_err(|error| Error::Log(error.to_string()))?
            .ok_or_else(|| Error::Log("the ELF has no .defmt section".to_owned()))?;
        let mut stream = table.new_stream_decoder();
        stream.received(rtt);
        let mut lines = Vec::new();
        loop {
            match stream.decode() {
                Ok(frame) => lines.push(frame.display(false).to_string()),
                Err(defmt_decoder::DecodeError::UnexpectedEof) => return Ok(lines),
                Err(defmt_decoder::DecodeError::Malformed) => lines.push("<malformed>".to_owned()),
            }
        }
    }
}
