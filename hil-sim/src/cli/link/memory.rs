//! What the board remembers: its log, the stream of records, and the look back after a fault.

use std::io::Write;

use firmware::events::LogBlock;
use firmware::protocol::frame::encode;
use firmware::protocol::message::{Answer, BoardMessage, Order, Read, Reading};
use firmware::records::codec::{RecordBlock, Records};
use report::error::CommandError;
use virtual_board::words::{fault_name, log_line};

use super::console::Console;
use super::session::{Link, refused};
use super::wire::Wire;

/// What was recorded.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Recorded {
    /// Blocks written.
    pub blocks: u32,
    /// Ticks in them.
    pub ticks: u64,
    /// Blocks that the board made and that did not arrive.
    pub lost: u32,
}

impl Recorded {
    /// One line for the user.
    pub fn line(&self) -> String {
        let Self { blocks, ticks, lost } = self;
        format!("{ticks} ticks in {blocks} blocks, {lost} blocks lost")
    }

    /// Writes a block as the frame that brought it.
    fn write(&mut self, block: RecordBlock, out: &mut impl Write) -> Result<(), CommandError> {
        self.blocks += 1;
        self.ticks += Records::new(&block.bytes).flatten().count() as u64;
        write_frame(&BoardMessage::Records(block), out)
    }
}

/// Writes a message as a frame.
///
/// # Errors
/// [`CommandError::Other`]: the message fits no frame, or `out` takes no more.
pub fn write_frame(message: &BoardMessage, out: &mut impl Write) -> Result<(), CommandError> {
    let frame = encode(message).map_err(|_| CommandError::Other("a message of the board fits no frame".into()))?;
    out.write_all(&frame)
        .map_err(|error| CommandError::Other(format!("output: {error}")))
}

impl<W: Wire> Link<W> {
    /// Writes the stream of records to `out`, as frames behind the board's identity, for `seconds` or until the user
    /// asks to stop. A board that boots meanwhile is asked for its records from the first tick on.
    ///
    /// # Errors
    /// Silence, or `out` takes no more.
    pub fn record(&mut self, seconds: f64, out: &mut impl Write) -> Result<Recorded, CommandError> {
        let from_us = self.wire.now_us();
        let length_us = (seconds * 1e6) as u64;
        let mut recorded = Recorded::default();
        let mut started = false;
        // Who the board is stands in front of its records; a file without a record stays empty.
        let mut unwritten = None;
        // Number of the next block, once there has been one: what went before the first is no loss.
        let mut next: Option<u32> = None;
        while self.wire.now_us() - from_us < length_us && self.interrupts() == 0 {
            let Some(identity) = self.client.identity().copied() else {
                self.identify()?;
                started = false;
                continue;
            };
            if !started {
                unwritten = Some(identity);
                self.client.records.clear();
                self.order(Order::Recording { from: Some(0) })?;
                (started, next) = (true, None);
            }
            self.listen()?;
            while let Some(block) = self.client.records.pop_front() {
                recorded.lost += next.map_or(0, |next| block.number.wrapping_sub(next));
                next = Some(block.number.wrapping_add(1));
                if let Some(identity) = unwritten.take() {
                    write_frame(&BoardMessage::Identity(identity), out)?;
                }
                recorded.write(block, out)?;
            }
        }
        self.order(Order::Recording { from: None })?;
        Ok(recorded)
    }

    /// Asks the board to read something of its memory.
    fn read_memory(&mut self, read: Read) -> Result<Reading, CommandError> {
        let mut found = None;
        let sequence = self.give(Order::Read(read))?;
        let until_us = self.wire.now_us() + super::session::ANSWER_US;
        while found.is_none() && self.wire.now_us() < until_us {
            self.listen()?;
            if let Some(Answer::Refused(refusal)) = self.client.answer_to(sequence) {
                return Err(refused(refusal));
            }
            found = self.client.reading_of(sequence);
        }
        found.ok_or_else(|| CommandError::Checks("the board did not answer a question about its memory".into()))
    }

    /// Writes the look back to `out`, as frames behind the board's identity.
    ///
    /// # Errors
    /// There is none: no fault has occurred since the vehicle was last armed. Silence, or `out` takes no more.
    pub fn look_back(&mut self, out: &mut impl Write) -> Result<Recorded, CommandError> {
        let mut unwritten = self.client.identity().copied();
        let mut recorded = Recorded::default();
        let mut from = 0;
        loop {
            match self.read_memory(Read::LookBack { from })? {
                Reading::LookBack { frozen: false, .. } => {
                    return Err(CommandError::Checks(
                        "no fault has occurred since the vehicle was last armed: there is nothing to look back at"
                            .into(),
                    ));
                }
                Reading::LookBack { block: Some(block), .. } => {
                    let Some(after) = beyond(block.number, from) else {
                        return Err(strange());
                    };
                    if recorded.blocks > 0 {
                        recorded.lost += block.number.wrapping_sub(from);
                    }
                    from = after;
                    if let Some(identity) = unwritten.take() {
                        write_frame(&BoardMessage::Identity(identity), out)?;
                    }
                    recorded.write(block, out)?;
                }
                Reading::LookBack { block: None, .. } => return Ok(recorded),
                Reading::Log(_) | Reading::Faults(_) => return Err(strange()),
            }
        }
    }

    /// Shows the board's log.
    ///
    /// # Errors
    /// Silence, or the output is closed.
    pub fn show_log<O: Write>(&mut self, console: &mut Console<O>) -> Result<(), CommandError> {
        self.log(|block, lost| {
            if lost > 0 {
                console.line(&format!("({lost} older lines are gone)"))?;
            }
            block.lines.iter().try_for_each(|line| console.line(&log_line(line)))
        })
    }

    /// Reads the board's log: `each` gets every block of lines, and how many lines before it are gone.
    ///
    /// # Errors
    /// Silence, or what `each` finds.
    pub(in crate::cli) fn log(
        &mut self,
        mut each: impl FnMut(&LogBlock, u32) -> Result<(), CommandError>,
    ) -> Result<(), CommandError> {
        let mut from = 0;
        loop {
            let Reading::Log(block) = self.read_memory(Read::Log { from })? else {
                return Err(strange());
            };
            if block.lines.is_empty() {
                return Ok(());
            }
            let last = block.first.saturating_add(block.lines.len() as u32 - 1);
            let Some(after) = beyond(last, from) else {
                return Err(strange());
            };
            each(&block, block.first.saturating_sub(from))?;
            from = after;
        }
    }
}

impl<W: Wire> Link<W> {
    /// Shows the last faults, of this boot and of those before.
    ///
    /// # Errors
    /// Silence, or the output is closed.
    pub fn show_faults<O: Write>(&mut self, console: &mut Console<O>) -> Result<(), CommandError> {
        let boot = self.client.identity().map(|identity| identity.about.boot);
        let mut from = 0;
        loop {
            let Reading::Faults(entries) = self.read_memory(Read::Faults { from })? else {
                return Err(strange());
            };
            if entries.is_empty() {
                return if from == 0 { console.line("no faults") } else { Ok(()) };
            }
            for entry in &entries {
                let Some(after) = beyond(entry.number, from) else {
                    return Err(strange());
                };
                let of = if boot == Some(entry.boot) {
                    "this boot"
                } else {
                    "an earlier boot"
                };
                console.line(&format!(
                    "{:>4}  {of} {:08x}, {}.{:06} s after it, {}: {}",
                    entry.number,
                    entry.boot,
                    entry.time_us / 1_000_000,
                    entry.time_us % 1_000_000,
                    entry.mode.name(),
                    fault_name(entry.fault),
                ))?;
                from = after;
            }
        }
    }
}

/// The number behind `number`, if that is at least `from`: whatever a board answers, reading its memory ends.
fn beyond(number: u32, from: u32) -> Option<u32> {
    if number < from { None } else { number.checked_add(1) }
}

fn strange() -> CommandError {
    CommandError::Checks("a strange answer about the board's memory".into())
}
