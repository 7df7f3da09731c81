//! The records of a whole run, with what follows from them.

use std::io::Write;

use firmware::drive_board::SCALES;
use firmware::flight_record::FlightRecord;
use firmware::protocol::message::{Identity, LinkCounters, PROTOCOL_VERSION, STATUS_RATE_HZ};
use firmware::records::codec::{BlockEncoder, RecordBlock};
use model::sample::TICK_US;
use model::status::Status;
use model::tick::VehicleCore;
use model::vehicle::Vehicle;
use plant::Truth;
use report::error::CommandError;
use virtual_board::scenario::trace::TraceRow;
use virtual_board::scenario::{Story, StoryEvent};

use super::writer::RecordWriter;

/// Ticks from status to status, as on the link.
const STATUS_TICKS: u32 = 1_000_000 / TICK_US / STATUS_RATE_HZ as u32;

/// A run that is recorded.
#[derive(Debug, Clone, Copy)]
pub struct RecordedRun<'a> {
    /// The vehicle that the board was told of.
    pub vehicle: &'a Vehicle<f32>,
    /// The board, if it has said who it is.
    pub identity: Option<Identity>,
    /// The record of every tick.
    pub records: &'a [FlightRecord],
    /// The firmware's log: each line its time in s since boot, its level and its words.
    pub log: &'a [String],
    /// What happened, if it is known better than from the board's statuses.
    pub events: Option<&'a [StoryEvent]>,
}

/// Writes a run. The statuses are those of a replay, and so are the events if nothing else is known of them.
///
/// # Errors
/// [`CommandError::Other`]: a message fits no frame, or the output takes no more.
pub fn write_run<W: Write>(out: &mut RecordWriter<W>, run: &RecordedRun<'_>) -> Result<(), CommandError> {
    out.identity(&run.identity.unwrap_or_else(|| Identity {
        protocol: PROTOCOL_VERSION,
        nonce: 0,
        session: 1,
        sequence: 0,
        time_us: 0,
        about: firmware::link::about(run.vehicle.parameters(), 0),
    }))?;
    out.vehicle(vehicle_file::to_toml(run.vehicle.parameters()))?;
    let mut log = run.log.iter().map(|line| log_line(line)).peekable();
    let mut events = run.events.unwrap_or_default().iter().peekable();
    let mut story = StatusStory::default();
    let mut core = VehicleCore::new(run.vehicle, &SCALES);
    let mut encoder = BlockEncoder::new();
    let mut last_tick = 0;
    for record in run.records {
        let mut full: Option<RecordBlock> = None;
        encoder.push(record, |block| full = Some(block.clone()));
        full.map_or(Ok(()), |block| out.block(block))?;
        if !out.keeps_all() {
            continue;
        }
        if record.tick <= last_tick {
            // The board has booted anew.
            core = VehicleCore::new(run.vehicle, &SCALES);
        }
        last_tick = record.tick;
        let status = core.step(&record.sample, &record.command).status;
        if record.tick % STATUS_TICKS == 0 {
            out.status(&status)?;
            if run.events.is_none() {
                story.add(&status).iter().try_for_each(|event| out.event(event))?;
            }
        }
        while let Some((at_us, level, text)) = log.next_if(|(at_us, ..)| *at_us <= record.sample.time_us) {
            out.log(at_us, level, text)?;
        }
        while let Some(event) = events.next_if(|event| event.at_s * 1e6 <= record.sample.time_us as f64) {
            out.event(event)?;
        }
    }
    let mut last = None;
    encoder.flush(|block| last = Some(block.clone()));
    last.map_or(Ok(()), |block| out.block(block))?;
    log.try_for_each(|(at_us, level, text)| out.log(at_us, level, text))?;
    events.try_for_each(|event| out.event(event))?;
    story.ended().iter().try_for_each(|event| out.event(event))
}

/// The story that a board's statuses tell: nothing in it is known but from them.
#[derive(Debug, Default)]
pub struct StatusStory(Story);

impl StatusStory {
    /// Takes the next status; what is over by then.
    pub fn add(&mut self, status: &Status) -> Vec<StoryEvent> {
        self.0.add(&TraceRow {
            commanded: [0.0; 2],
            status: *status,
            link: LinkCounters::default(),
            truth: Truth::default(),
            bridges_on: false,
        });
        self.0.take()
    }

    /// What was under way to the end.
    pub fn ended(self) -> Vec<StoryEvent> {
        self.0.told().events
    }
}

/// Time in us, level and words of a line of the firmware's log.
fn log_line(line: &str) -> (u64, &str, &str) {
    let (time, rest) = line.trim_start().split_once(' ').unwrap_or(("", line));
    let (level, text) = rest.trim_start().split_once(' ').unwrap_or(("", rest));
    let at_s: f64 = time.parse().unwrap_or(0.0);
    ((at_s * 1e6).round() as u64, level, text.trim_start())
}
