//! Writes the stream of records, and the look back after a fault, to a file.

use std::io::Write;

use firmware::events::LogBlock;
use firmware::protocol::message::{Identity, Order, Read, Reading};
use firmware::records::codec::{RecordBlock, Records};
use record_file::run::StatusStory;
use record_file::writer::RecordWriter;
use report::error::CommandError;

use super::memory::{beyond, strange};
use super::session::Link;
use super::wire::Wire;

/// Longest time for which the look back may still grow after a fault, us: 0.2 s of the board's time, which takes 1 s on a board at
/// a fifth of real time.
const FREEZES_US: u64 = 1_500_000;
/// Time between two requests for the new lines of the board's log, us.
const LOG_US: u64 = 500_000;

/// Counts of a recording.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Recorded {
    /// Blocks written.
    pub blocks: u32,
    /// Ticks in these blocks.
    pub ticks: u64,
    /// Blocks that the board sent and that did not arrive.
    pub lost: u32,
}

impl Recorded {
    /// One line for the user.
    pub fn line(&self) -> String {
        let Self { blocks, ticks, lost } = self;
        format!("{ticks} ticks in {blocks} blocks, {lost} blocks lost")
    }

    /// Writes a block.
    fn write<O: Write>(&mut self, block: RecordBlock, out: &mut RecordWriter<O>) -> Result<(), CommandError> {
        self.blocks += 1;
        self.ticks += Records::new(&block.bytes).flatten().count() as u64;
        Ok(out.block(block)?)
    }
}

/// The board's log, read in parallel with other work.
#[derive(Debug, Default)]
struct LogFollower {
    /// The number of the next line.
    from: u32,
    /// The number of the unanswered question, and the time of the last question, us.
    asked: Option<u32>,
    asked_us: u64,
}

impl LogFollower {
    /// Asks for new lines if a question is due, and writes the lines that have arrived.
    fn follow<W: Wire, O: Write>(&mut self, link: &mut Link<W>, out: &mut RecordWriter<O>) -> Result<(), CommandError> {
        let now_us = link.wire.now_us();
        if let Some(sequence) = self.asked
            && let Some(reading) = link.client.reading_of(sequence)
        {
            self.asked = None;
            let Reading::Log(block) = reading else {
                return Err(strange());
            };
            self.write(&block, out)?;
        }
        // A question whose answer was lost is asked again.
        if now_us - self.asked_us >= LOG_US {
            self.asked = Some(link.give(Order::Read(Read::Log { from: self.from }))?);
            self.asked_us = now_us;
        }
        Ok(())
    }

    fn write<O: Write>(&mut self, block: &LogBlock, out: &mut RecordWriter<O>) -> Result<(), CommandError> {
        // No line is written twice, whatever a board answers.
        let known = self.from.saturating_sub(block.first);
        let new = LogBlock {
            first: block.first.saturating_add(known),
            lines: block.lines.iter().skip(known as usize).copied().collect(),
        };
        if !new.lines.is_empty() {
            self.from = new.first.saturating_add(new.lines.len() as u32);
        }
        Ok(out.log_block(&new)?)
    }
}

/// A recording in progress: selects the board's messages for the file, and tracks what must still be written.
#[derive(Debug, Default)]
pub(super) struct LinkRecording {
    recorded: Recorded,
    story: StatusStory,
    log: LogFollower,
    /// The board's identity, which precedes its records in the file. A file without a record stays empty.
    unwritten: Option<Identity>,
    /// Whether the parameters in force must still be written after the identity.
    untold_vehicle: bool,
    /// Number of the next block, once a block has arrived. Blocks before the first do not count as lost.
    next: Option<u32>,
    /// The last recorded boot.
    boot: Option<u32>,
    /// Boot and number of the last status written.
    last_status: Option<(u32, u32)>,
}

impl LinkRecording {
    /// Asks the board that has just sent its identity for its records, from the oldest record that it still
    /// has.
    ///
    /// # Errors
    /// The board refuses, or is silent.
    pub(super) fn begin<W: Wire>(&mut self, link: &mut Link<W>, identity: Identity) -> Result<(), CommandError> {
        self.unwritten = Some(identity);
        link.order(Order::Recording { from: Some(0) })?;
        self.next = None;
        self.log = LogFollower::default();
        Ok(())
    }

    /// Whether a record has arrived, and everything that must precede the next record has been written.
    pub(super) fn is_under_way(&self) -> bool {
        self.unwritten.is_none() && !self.untold_vehicle
    }

    /// Writes everything that has arrived since the last call.
    ///
    /// # Errors
    /// `out` cannot be written.
    pub(super) fn take<W: Wire, O: Write>(
        &mut self,
        link: &mut Link<W>,
        out: &mut RecordWriter<O>,
    ) -> Result<(), CommandError> {
        while let Some(block) = link.client.records.pop_front() {
            self.recorded.lost += self.next.map_or(0, |next| block.number.wrapping_sub(next));
            self.next = Some(block.number.wrapping_add(1));
            if let Some(identity) = self.unwritten.take() {
                self.meet(&identity, out)?;
                self.untold_vehicle = out.keeps_all();
            }
            self.recorded.write(block, out)?;
        }
        if std::mem::take(&mut self.untold_vehicle) {
            // Meanwhile the client keeps the blocks. A board with other parameters than the tool's is
            // recorded without parameters.
            if let Ok(parameters) = link.parameters() {
                out.vehicle(vehicle_file::to_toml(&parameters))?;
            }
        }
        if self.unwritten.is_some() || link.client.identity().is_none() {
            return Ok(());
        }
        // The status stays in the client, because other code reads it too.
        if out.keeps_all()
            && let Some(status) = link.client.status
            && self.last_status.replace((status.boot, status.sequence)) != Some((status.boot, status.sequence))
        {
            out.status(&status.vehicle)?;
            self.story
                .add(&status.vehicle)
                .iter()
                .try_for_each(|event| out.event(event))?;
        }
        self.log.follow(link, out)
    }

    /// Writes the board's identity, and a new boot if the board has already been recorded in another boot.
    fn meet<O: Write>(&mut self, identity: &Identity, out: &mut RecordWriter<O>) -> Result<(), CommandError> {
        let boot = identity.about.boot;
        let boots = self.boot.replace(boot).is_some_and(|known| known != boot);
        if boots {
            self.story.end().iter().try_for_each(|event| out.event(event))?;
        }
        out.identity(identity)?;
        if boots {
            out.event(&self.story.restart())?;
        }
        Ok(())
    }

    /// Ends the board's stream of records, and writes the last lines of its log.
    ///
    /// # Errors
    /// The board refuses or is silent, or `out` cannot be written.
    pub(super) fn end<W: Wire, O: Write>(
        mut self,
        link: &mut Link<W>,
        out: &mut RecordWriter<O>,
    ) -> Result<Recorded, CommandError> {
        link.order(Order::Recording { from: None })?;
        if self.unwritten.is_none() {
            self.story.end().iter().try_for_each(|event| out.event(event))?;
            link.log_from(self.log.from, |block, _| self.log.write(block, out))?;
        }
        Ok(self.recorded)
    }
}

impl<W: Wire> Link<W> {
    /// Writes the board's identity, then the stream of records and the log to `out`, for `seconds` or until
    /// the user asks to stop. A file that can store them also receives parameters, statuses and events. If
    /// the board boots meanwhile, the tool asks for its records from the first tick.
    ///
    /// # Errors
    /// Silence, or `out` cannot be written.
    pub fn record<O: Write>(&mut self, seconds: f64, out: &mut RecordWriter<O>) -> Result<Recorded, CommandError> {
        let from_us = self.wire.now_us();
        let length_us = (seconds * 1e6) as u64;
        let mut recorder = LinkRecording::default();
        let mut started = false;
        while self.wire.now_us() - from_us < length_us && self.interrupts() == 0 {
            let Some(identity) = self.client.identity().copied() else {
                self.identify()?;
                started = false;
                continue;
            };
            if !started {
                recorder.begin(self, identity)?;
                started = true;
            }
            self.listen()?;
            recorder.take(self, out)?;
        }
        recorder.end(self, out)
    }

    /// Writes the board's identity and the look back to `out`.
    ///
    /// # Errors
    /// The board has no look back, because no fault has occurred since the vehicle was last armed; the board is silent; or
    /// `out` cannot be written.
    pub fn look_back<O: Write>(&mut self, out: &mut RecordWriter<O>) -> Result<Recorded, CommandError> {
        let mut unwritten = self.client.identity().copied();
        let mut recorded = Recorded::default();
        let mut from = 0;
        let since_us = self.wire.now_us();
        loop {
            match self.read_memory(Read::LookBack { from })? {
                Reading::LookBack { frozen: false, .. } => {
                    let is_new = self.wire.now_us() - since_us < FREEZES_US;
                    if is_new && !self.fresh_status()?.vehicle.faults.is_empty() {
                        continue;
                    }
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
                        out.identity(&identity)?;
                    }
                    recorded.write(block, out)?;
                }
                Reading::LookBack { block: None, .. } => return Ok(recorded),
                Reading::Log(_) | Reading::Faults(_) => return Err(strange()),
            }
        }
    }
}
