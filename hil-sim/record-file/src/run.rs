//! The records of a run, with what follows from them.

use std::io::{self, Write};

use firmware::drive_board::SCALES;
use firmware::flight_record::FlightRecord;
use firmware::protocol::message::{Identity, PROTOCOL_VERSION, STATUS_RATE_HZ};
use firmware::records::codec::{BlockEncoder, RecordBlock};
use model::sample::TICK_US;
use model::status::Status;
use model::tick::VehicleCore;
use model::vehicle::Vehicle;
use virtual_board::scenario::{Sight, Story, StoryEvent};

use crate::log_line::LogLine;
use crate::writer::RecordWriter;

/// Ticks from status to status, as on the link.
const STATUS_TICKS: u32 = 1_000_000 / TICK_US / STATUS_RATE_HZ as u32;

/// The recording of a run that grows with the run. The statuses are those of a replay: what the board computed from the
/// same samples.
pub struct RunWriter<W: Write> {
    out: RecordWriter<W>,
    vehicle: Vehicle<f32>,
    core: VehicleCore,
    encoder: BlockEncoder,
    last_tick: u32,
    /// What the statuses tell, where nobody else tells what happened.
    story: Option<StatusStory>,
}

/// Who tells what happened in a run.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Narrator {
    /// The board's statuses: no more is known.
    Statuses,
    /// The caller, by [`RunWriter::event`].
    Caller,
}

impl<W: Write> RunWriter<W> {
    /// Begins the recording of a board that was told of `vehicle`, and that has said who it is if there is an `identity`.
    ///
    /// # Errors
    /// A message fits no frame, or the output takes no more.
    pub fn begin(
        mut out: RecordWriter<W>,
        vehicle: &Vehicle<f32>,
        identity: Option<Identity>,
        narrator: Narrator,
    ) -> io::Result<Self> {
        out.identity(&identity.unwrap_or_else(|| Identity {
            protocol: PROTOCOL_VERSION,
            nonce: 0,
            session: 1,
            sequence: 0,
            time_us: 0,
            about: firmware::link::about(vehicle.parameters(), 0),
        }))?;
        out.vehicle(vehicle_file::to_toml(vehicle.parameters()))?;
        Ok(Self {
            out,
            vehicle: *vehicle,
            core: VehicleCore::new(vehicle, &SCALES),
            encoder: BlockEncoder::new(),
            last_tick: 0,
            story: (narrator == Narrator::Statuses).then(StatusStory::default),
        })
    }

    /// Takes the record of the next tick.
    ///
    /// # Errors
    /// As [`RunWriter::begin`].
    pub fn record(&mut self, record: &FlightRecord) -> io::Result<()> {
        let mut full: Option<RecordBlock> = None;
        self.encoder.push(record, |block| full = Some(block.clone()));
        full.map_or(Ok(()), |block| self.out.block(block))?;
        if !self.out.keeps_all() {
            return Ok(());
        }
        if record.tick <= self.last_tick {
            // The board has booted anew.
            self.core = VehicleCore::new(&self.vehicle, &SCALES);
        }
        self.last_tick = record.tick;
        let status = self.core.step(&record.sample, &record.command).status;
        if !record.tick.is_multiple_of(STATUS_TICKS) {
            return Ok(());
        }
        self.out.status(&status)?;
        let events = self.story.as_mut().map(|story| story.add(&status)).unwrap_or_default();
        events.iter().try_for_each(|event| self.out.event(event))
    }

    /// Takes something that happened.
    ///
    /// # Errors
    /// As [`RunWriter::begin`].
    pub fn event(&mut self, event: &StoryEvent) -> io::Result<()> {
        self.out.event(event)
    }

    /// Takes a line of the firmware's log.
    ///
    /// # Errors
    /// As [`RunWriter::begin`].
    pub fn log(&mut self, line: &LogLine) -> io::Result<()> {
        self.out.log(line)
    }

    /// Completes the recording; its output.
    ///
    /// # Errors
    /// As [`RunWriter::begin`].
    pub fn finish(mut self) -> io::Result<W> {
        let mut last = None;
        self.encoder.flush(|block| last = Some(block.clone()));
        last.map_or(Ok(()), |block| self.out.block(block))?;
        let events = self.story.take().map(StatusStory::ended).unwrap_or_default();
        events.iter().try_for_each(|event| self.out.event(event))?;
        self.out.finish()
    }
}

/// Writes a whole run into `out`, each line of its log with the ticks of its time; its output.
///
/// # Errors
/// As [`RunWriter::begin`].
pub fn write_run<W: Write>(
    out: RecordWriter<W>,
    vehicle: &Vehicle<f32>,
    identity: Option<Identity>,
    records: &[FlightRecord],
    log: &[LogLine],
) -> io::Result<W> {
    let mut writer = RunWriter::begin(out, vehicle, identity, Narrator::Statuses)?;
    let mut lines = log.iter().peekable();
    for record in records {
        while let Some(line) = lines.next_if(|line| line.time_us <= record.sample.time_us) {
            writer.log(line)?;
        }
        writer.record(record)?;
    }
    lines.try_for_each(|line| writer.log(line))?;
    writer.finish()
}

/// The story that a board's statuses tell: nothing in it is known but from them.
#[derive(Debug, Default)]
pub struct StatusStory(Story);

impl StatusStory {
    /// Takes the next status; what is over by then.
    pub fn add(&mut self, status: &Status) -> Vec<StoryEvent> {
        self.0.add(Sight { status, truth: None });
        self.0.take()
    }

    /// What was under way to the end.
    pub fn ended(self) -> Vec<StoryEvent> {
        self.0.told().events
    }
}
