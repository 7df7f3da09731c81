//! Writes the records of a run, with the statuses and events that follow from them.

use std::io::{self, Write};

use firmware::drive_board::SCALES;
use firmware::flight_record::FlightRecord;
use firmware::protocol::message::{Identity, PROTOCOL_VERSION, STATUS_RATE_HZ};
use firmware::records::codec::{BlockEncoder, RecordBlock};
use model::sample::TICK_US;
use model::status::Status;
use model::tick::VehicleCore;
use model::vehicle::Vehicle;
use virtual_board::scenario::{EventKind, Sight, Story, StoryEvent};

use crate::ReadBoot;
use crate::log_line::LogLine;
use crate::writer::RecordWriter;

/// Ticks from status to status, as on the link.
const STATUS_TICKS: u32 = 1_000_000 / TICK_US / STATUS_RATE_HZ as u32;

/// A recording that grows with its run. The statuses come from a replay: the board computed the same from the same
/// samples.
pub struct RunWriter<W: Write> {
    out: RecordWriter<W>,
    vehicle: Vehicle<f32>,
    core: VehicleCore,
    encoder: BlockEncoder,
    identity: Identity,
    last_tick: u32,
    /// Instant at which the board was switched on for the next boot, us since the board's first boot, if known.
    booted_us: Option<u64>,
    /// Time of the log's last line, us since its boot.
    log_us: u64,
    /// Log lines of a boot that has no record yet.
    log_ahead: Vec<LogLine>,
    /// The events that the statuses show, if nobody else reports events.
    story: Option<StatusStory>,
}

/// Source of a run's events.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Narrator {
    /// The board's statuses, without any other source.
    Statuses,
    /// The caller, through [`RunWriter::event`].
    Caller,
}

impl<W: Write> RunWriter<W> {
    /// Begins the recording of a board with `vehicle` in force. `identity` is the board's identity message, if it sent
    /// one.
    ///
    /// # Errors
    /// A message does not fit into a frame, or the output cannot be written.
    pub fn begin(
        mut out: RecordWriter<W>,
        vehicle: &Vehicle<f32>,
        identity: Option<Identity>,
        narrator: Narrator,
    ) -> io::Result<Self> {
        let identity = identity.unwrap_or_else(|| Identity {
            protocol: PROTOCOL_VERSION,
            nonce: 0,
            session: 1,
            sequence: 0,
            time_us: 0,
            about: firmware::link::about(vehicle.parameters(), 0),
        });
        out.identity(&identity)?;
        out.vehicle(vehicle_file::to_toml(vehicle.parameters()))?;
        Ok(Self {
            out,
            vehicle: *vehicle,
            core: VehicleCore::new(vehicle, &SCALES),
            encoder: BlockEncoder::new(),
            identity,
            last_tick: 0,
            booted_us: None,
            log_us: 0,
            log_ahead: Vec::new(),
            story: (narrator == Narrator::Statuses).then(StatusStory::default),
        })
    }

    /// Notes that the board was switched on at `booted_us` for the following records, us since the board's first boot.
    /// No record shows how long the board was off.
    pub fn booted_at(&mut self, booted_us: u64) {
        self.booted_us = Some(booted_us);
    }

    /// Notes a boot of the board: records, statuses and log start again, with this vehicle in force. A board without
    /// an identity counts as the previous board.
    ///
    /// # Errors
    /// As [`RunWriter::begin`].
    pub fn boot(&mut self, vehicle: &Vehicle<f32>, identity: Option<Identity>) -> io::Result<()> {
        self.end_boot()?;
        let mut next = self.identity;
        next.about.boot = next.about.boot.wrapping_add(1);
        self.identity = identity.unwrap_or(next);
        self.out.boot(self.booted_us)?;
        self.out.identity(&self.identity)?;
        self.out.vehicle(vehicle_file::to_toml(vehicle.parameters()))?;
        self.vehicle = *vehicle;
        self.core = VehicleCore::new(vehicle, &SCALES);
        (self.last_tick, self.log_us) = (0, 0);
        if let Some(story) = &mut self.story {
            self.out.event(&story.restart())?;
        }
        std::mem::take(&mut self.log_ahead)
            .iter()
            .try_for_each(|line| self.log(line))
    }

    /// Writes the rest of the boot that ends.
    fn end_boot(&mut self) -> io::Result<()> {
        let mut last = None;
        self.encoder.flush(|block| last = Some(block.clone()));
        last.map_or(Ok(()), |block| self.out.block(block))?;
        let events = self.story.as_mut().map(StatusStory::end).unwrap_or_default();
        events.iter().try_for_each(|event| self.out.event(event))
    }

    /// Takes the record of the next tick. A tick number that goes back belongs to the next boot.
    ///
    /// # Errors
    /// As [`RunWriter::begin`].
    pub fn record(&mut self, record: &FlightRecord) -> io::Result<()> {
        if self.last_tick > 0 && record.tick <= self.last_tick {
            let vehicle = self.vehicle;
            self.boot(&vehicle, None)?;
        }
        self.last_tick = record.tick;
        let mut full: Option<RecordBlock> = None;
        self.encoder.push(record, |block| full = Some(block.clone()));
        full.map_or(Ok(()), |block| self.out.block(block))?;
        if !self.out.keeps_all() {
            return Ok(());
        }
        let status = self.core.step(&record.sample, &record.command).status;
        if !record.tick.is_multiple_of(STATUS_TICKS) {
            return Ok(());
        }
        self.out.status(&status)?;
        let Some(story) = &mut self.story else {
            return Ok(());
        };
        story.add(&status).iter().try_for_each(|event| self.out.event(event))
    }

    /// Takes an event, with its time since the first boot.
    ///
    /// # Errors
    /// As [`RunWriter::begin`].
    pub fn event(&mut self, event: &StoryEvent) -> io::Result<()> {
        self.out.event_of_run(event)
    }

    /// Takes a line of the firmware's log. A line whose time goes back belongs to the next boot, and waits for that
    /// boot's records.
    ///
    /// # Errors
    /// As [`RunWriter::begin`].
    pub fn log(&mut self, line: &LogLine) -> io::Result<()> {
        if !self.log_ahead.is_empty() || line.time_us < self.log_us {
            self.log_ahead.push(line.clone());
            return Ok(());
        }
        self.log_us = line.time_us;
        self.out.log(line)
    }

    /// Completes the recording; returns the output.
    ///
    /// # Errors
    /// As [`RunWriter::begin`].
    pub fn finish(mut self) -> io::Result<W> {
        while !self.log_ahead.is_empty() {
            // The run ended before its first record.
            let vehicle = self.vehicle;
            self.boot(&vehicle, None)?;
        }
        self.end_boot()?;
        self.out.finish()
    }
}

/// Writes a whole run to `out`, boot by boot; returns the output. Each boot has the vehicle at its index in
/// `vehicles`; the last vehicle applies to all further boots. Each log line is written with the ticks of its time.
///
/// # Errors
/// As [`RunWriter::begin`].
pub fn write_run<W: Write>(out: RecordWriter<W>, vehicles: &[Vehicle<f32>], boots: &[ReadBoot]) -> io::Result<W> {
    let (Some(first), Some(vehicle)) = (boots.first(), vehicles.first()) else {
        return Err(io::Error::other("a run without a boot"));
    };
    let mut writer = RunWriter::begin(out, vehicle, first.identity, Narrator::Statuses)?;
    for (n, boot) in boots.iter().enumerate() {
        if n > 0 {
            writer.boot(vehicles.get(n).or(vehicles.last()).unwrap_or(vehicle), boot.identity)?;
        }
        let mut lines = boot.log.iter().peekable();
        for record in &boot.records {
            while let Some(line) = lines.next_if(|line| line.time_us <= record.sample.time_us) {
                writer.log(line)?;
            }
            writer.record(record)?;
        }
        lines.try_for_each(|line| writer.log(line))?;
    }
    writer.finish()
}

/// The events that a board's statuses show, without any other source.
#[derive(Debug, Default)]
pub struct StatusStory(Story);

impl StatusStory {
    /// Takes the next status; returns the events that it shows.
    pub fn add(&mut self, status: &Status) -> &[StoryEvent] {
        self.0.add(Sight { status, truth: None });
        self.0.new_events()
    }

    /// Ends the events in progress at the end of a boot, or of the recording, and returns them.
    pub fn end(&mut self) -> Vec<StoryEvent> {
        std::mem::take(&mut self.0).under_way()
    }

    /// The event of a board that has restarted.
    pub fn restart(&self) -> StoryEvent {
        StoryEvent {
            at_s: 0.0,
            for_s: None,
            kind: EventKind::Restart,
            text: "the board restarts".to_owned(),
        }
    }
}
