//! The board at the run's present instant: what a caller can read, change and record.

use rigless::emulator::{Host, Stop};
use rigless::mcu::Operate;
use rigless::session::Session;
use rigless::snapshot;
use rigless::soc::Width;

use super::state::{CycleRead, EmulationState, Probe};
use crate::board::gaps::{self, Gap};
use crate::board::{BridgeOutput, DriveBoard, MOTORS};
use crate::error::Error;
use crate::time::Instant;

/// Work that the emulator has done so far.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Work {
    /// Instructions retired.
    pub instructions: u64,
    /// Accesses of the core to peripherals' registers.
    pub accesses: u64,
    /// Stops between two instructions, for an event of a model or of the plant.
    pub stops: u64,
}

/// The board at the run's present instant, between two instructions.
pub struct Stopped<'a> {
    pub(super) session: &'a mut Session<DriveBoard>,
    pub(super) host: &'a mut dyn Host,
    pub(super) state: &'a mut EmulationState,
    pub(super) stop: Stop,
    /// Digest of the images in the flash, which a snapshot carries.
    pub(super) digest: &'a [u8; 32],
}

impl Stopped<'_> {
    /// The board.
    pub fn board(&mut self) -> &mut DriveBoard {
        self.session.board_mut()
    }

    /// The board, and the run's present instant.
    pub fn board_now(&mut self) -> (&mut DriveBoard, Instant) {
        (self.session.board_mut(), self.stop.at)
    }

    /// Virtual time in ns.
    pub fn now(&self) -> u64 {
        self.stop.at.0
    }

    /// Instructions retired so far.
    pub fn instructions(&self) -> u64 {
        self.stop.instruction_count
    }

    /// Work that the emulator has done so far.
    pub fn work(&self) -> Work {
        Work {
            instructions: self.stop.instruction_count,
            accesses: self.state.accesses,
            stops: self.state.stops,
        }
    }

    /// Time in ns at which the firmware's clock last started; before that, the time at which the part started.
    pub fn clock_start(&self) -> u64 {
        let part = self.session.resets().last().map_or(0, |reset| reset.at.0);
        self.state.clock_start().unwrap_or(part)
    }

    /// Restarts of the part so far: instant in ns, and cause.
    pub fn resets(&self) -> Vec<(u64, String)> {
        let resets = self.session.resets().iter();
        resets.map(|reset| (reset.at.0, format!("{:?}", reset.cause))).collect()
    }

    /// Bridges at this instant.
    pub fn bridges(&mut self) -> [BridgeOutput; MOTORS] {
        self.session.board_mut().bridges(self.stop.at)
    }

    /// Every place where the emulated part could not replace the real part.
    pub fn gaps(&self) -> Vec<Gap> {
        gaps::of(self.session)
    }

    /// Pulls the reset pin.
    pub fn reset_by_pin(&mut self) {
        let (at, instructions) = (self.stop.at, self.stop.instruction_count);
        self.session.reset_by_pin(at, instructions, self.host);
    }

    /// Takes the bytes from the host link since the last arrival.
    pub(super) fn receive(&mut self) -> Vec<u8> {
        self.board().wire().take()
    }

    /// Takes a snapshot of the run.
    pub(super) fn freeze(&mut self) -> Result<(snapshot::Taken, EmulationState), Error> {
        let taken = snapshot::take(self.session, self.host, self.stop, self.digest, &NoDriver {})?;
        Ok((taken, self.state.fork()))
    }
}

/// The part's memory.
impl Stopped<'_> {
    /// Reads memory byte by byte.
    ///
    /// # Errors
    /// Outside the part's memory.
    pub fn read(&mut self, address: u64, length: usize) -> Result<Vec<u8>, Error> {
        (address..)
            .take(length)
            .map(|at| Ok(self.host.read(at, Width::W8)? as u8))
            .collect()
    }

    /// Reads memory word by word, which is faster; `length`, in bytes, is a multiple of four. For tests.
    ///
    /// # Errors
    /// Outside the part's memory.
    pub fn read_block(&mut self, address: u64, length: usize) -> Result<Vec<u8>, Error> {
        let mut bytes = Vec::with_capacity(length);
        for at in (address..).step_by(4).take(length / 4) {
            bytes.extend(self.read_word(at)?.to_le_bytes());
        }
        Ok(bytes)
    }

    /// Reads a 32-bit word of memory.
    ///
    /// # Errors
    /// Outside the part's memory.
    pub fn read_word(&mut self, address: u64) -> Result<u32, Error> {
        Ok(self.host.read(address, Width::W32)? as u32)
    }

    /// Writes to RAM, or changes flash as a programmer would.
    ///
    /// # Errors
    /// Outside the part's memory.
    pub fn write(&mut self, address: u64, bytes: &[u8]) -> Result<(), Error> {
        for (at, byte) in (address..).zip(bytes) {
            let byte = u64::from(*byte);
            if self.host.write(at, Width::W8, byte).is_err() {
                self.host.program(at, Width::W8, byte)?;
            }
        }
        Ok(())
    }

    /// Writes a register of a peripheral as the core would. For tests.
    ///
    /// # Errors
    /// When the bus does not accept the write.
    pub fn write_register(&mut self, address: u64, value: u32) -> Result<(), Error> {
        let at = self.stop.at;
        let written = self.session.mcu().write(at, address, Width::W32, u64::from(value));
        written.map_err(|fault| Error::access(&fault))
    }

    /// Reads a register of a peripheral as the core would.
    ///
    /// # Errors
    /// When the bus does not answer the read.
    pub fn register(&mut self, address: u64) -> Result<u32, Error> {
        let word = self.session.mcu().read(self.stop.at, address, Width::W32);
        word.map(|word| word as u32).map_err(|fault| Error::access(&fault))
    }
}

/// Recordings.
impl Stopped<'_> {
    /// Reads `words` 32-bit words from `address` at every step of the plant from now on.
    pub fn probe(&mut self, address: u64, words: u64) {
        self.state.probe = Some(Probe::new(address, words));
    }

    /// Takes the words that the probe has read since the last call.
    pub fn take_probe(&mut self) -> Vec<u32> {
        let probe = self.state.probe.as_mut();
        probe
            .map(|probe| std::mem::take(&mut probe.samples))
            .unwrap_or_default()
    }

    /// Records each read of the cycle counter from now on. For tests.
    pub fn keep_cycle_reads(&mut self) {
        self.state.cycle_reads = Some(Vec::new());
    }

    /// Takes the recorded reads and ends the recording. For tests.
    pub fn take_cycle_reads(&mut self) -> Vec<CycleRead> {
        self.state.cycle_reads.take().unwrap_or_default()
    }

    /// The log so far, as the firmware encoded it, without its first `from` bytes.
    ///
    /// # Errors
    /// When the log's buffer is outside the part's memory.
    pub fn log_bytes(&mut self, from: usize) -> Result<Vec<u8>, Error> {
        self.state.drain_log(self.host)?;
        Ok(self.state.log().get(from..).unwrap_or_default().to_vec())
    }
}

/// What a snapshot stores of the run in addition to the board: nothing. [`super::Frozen`] stores the run's
/// state itself.
pub(super) struct NoDriver {}
rigless::store!(NoDriver {
    values: [],
    parts: [],
    built: []
});
