//! The firmware's log: drained as a debug probe drains it, and decoded with the dictionary in the ELF.

use defmt_decoder::{DecodeError, StreamDecoder, Table};
use rigless::emulator::{self, Memory};
use rigless::soc::Width;

/// Offsets of up-channel 0's fields in the RTT control block: after the identifier (16 bytes), the two
/// channel counts and the channel's name.
const BUFFER: u64 = 28;
const SIZE: u64 = 32;
const WRITE: u64 = 36;
const READ: u64 = 40;

/// Appends to `out` what the firmware has written since the last drain, and advances the channel's read
/// offset. Drains nothing before the firmware has set up the control block.
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

/// The log of one run, decoded as it arrives.
pub struct LogReader<'a> {
    decoder: Box<dyn StreamDecoder + Send + Sync + 'a>,
}

impl<'a> LogReader<'a> {
    /// A reader that uses the dictionary of the ELF that writes the log.
    pub(super) fn new(table: &'a Table) -> Self {
        Self {
            decoder: table.new_stream_decoder(),
        }
    }

    /// The lines that these bytes complete.
    pub fn lines(&mut self, rtt: &[u8]) -> Vec<String> {
        self.decoder.received(rtt);
        let mut lines = Vec::new();
        loop {
            match self.decoder.decode() {
                Ok(frame) => lines.push(frame.display(false).to_string()),
                Err(DecodeError::UnexpectedEof) => return lines,
                Err(DecodeError::Malformed) => lines.push("<malformed>".to_owned()),
            }
        }
    }
}

/// The dictionary of an ELF's log, or why it has none.
pub(super) fn table_of(elf: &[u8]) -> Result<Table, String> {
    let table = Table::parse(elf).map_err(|error| error.to_string())?;
    table.ok_or_else(|| "the ELF has no .defmt section".to_owned())
}
