//! Reads the board's memory: its log and its faults.

use std::io::Write;

use firmware::events::LogBlock;
use firmware::protocol::message::{Answer, Order, Read, Reading};
use report::error::CommandError;
use virtual_board::link_client::ANSWER_US;
use virtual_board::words::{fault_name, log_line};

use super::console::Console;
use super::session::{Link, refused};
use super::wire::Wire;

/// Number of times that a question is asked before the link counts as lost.
const READ_ATTEMPTS: u32 = 3;

impl<W: Wire> Link<W> {
    /// Asks the board for a part of its memory. Asks again if the question or the answer was lost, so that a long read
    /// does not fail because of one frame of hundreds.
    pub(super) fn read_memory(&mut self, read: Read) -> Result<Reading, CommandError> {
        for _ in 0..READ_ATTEMPTS {
            if let Some(found) = self.ask_memory(read)? {
                return Ok(found);
            }
        }
        Err(CommandError::Checks(
            "the board did not answer a question about its memory".into(),
        ))
    }

    /// Asks once; `None` if no answer came in time.
    fn ask_memory(&mut self, read: Read) -> Result<Option<Reading>, CommandError> {
        let mut found = None;
        let sequence = self.give(Order::Read(read))?;
        let until_us = self.wire.now_us() + ANSWER_US;
        while found.is_none() && self.wire.now_us() < until_us {
            self.listen()?;
            if let Some(Answer::Refused(refusal)) = self.client.answer_to(sequence) {
                return Err(refused(refusal));
            }
            found = self.client.reading_of(sequence);
        }
        Ok(found)
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

    /// Reads the board's log. `each` receives every block of lines, and the number of lost lines before the block.
    ///
    /// # Errors
    /// Silence, or an error of `each`.
    pub(in crate::cli) fn log(
        &mut self,
        each: impl FnMut(&LogBlock, u32) -> Result<(), CommandError>,
    ) -> Result<(), CommandError> {
        self.log_from(0, each)
    }

    /// As [`Link::log`], starting at line number `from`.
    ///
    /// # Errors
    /// As [`Link::log`].
    pub(super) fn log_from(
        &mut self,
        mut from: u32,
        mut each: impl FnMut(&LogBlock, u32) -> Result<(), CommandError>,
    ) -> Result<(), CommandError> {
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
    /// Shows the last faults, of this boot and of earlier boots.
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

/// The number after `number`, if it is at least `from`. This check ends the read whatever a board answers.
pub(super) fn beyond(number: u32, from: u32) -> Option<u32> {
    if number < from { None } else { number.checked_add(1) }
}

pub(super) fn strange() -> CommandError {
    CommandError::Checks("a strange answer about the board's memory".into())
}
