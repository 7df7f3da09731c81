//! The record of a run: its file, and its replay after the run.

use std::io;
use std::path::{Path, PathBuf};
use std::time::Instant;

use firmware::drive_board::SCALES;
use firmware::flight_record::FlightRecord;
use model::tick::VehicleCore;
use model::vehicle::Vehicle;
use record_file::log_line::LogLine;
use record_file::run::{Narrator, RunWriter};
use record_file::writer::{RecordFormat, RecordWriter};
use report::error::CommandError;
use report::files::GrowingFile;
use virtual_board::scenario::Story;
use virtual_board::scenario::trace::TraceRow;

use super::vehicle_f32;

/// Time from one reading of the firmware's log to the next while a run is recorded, ms: the file gets it as the run goes.
const LOG_PERIOD_MS: u64 = 500;

/// The recording of a run under way: the file of `--record`. It grows with the run, and what is written stays whatever
/// ends the run.
pub struct RunRecord {
    writer: RunWriter<GrowingFile>,
    story: Story,
    log_read_ms: u64,
    /// The disk's first refusal, after which nothing more is written.
    written: Result<(), CommandError>,
}

impl RunRecord {
    /// Begins the file, before the run: one that cannot be written is told at once. The board was told of `vehicle`.
    ///
    /// # Errors
    /// [`CommandError`]: the file cannot be written.
    pub fn begin(path: &Path, vehicle: &Vehicle<f32>) -> Result<Self, CommandError> {
        let file = GrowingFile::create("--record", path)?;
        let out = RecordWriter::new(RecordFormat::of(path), file);
        Ok(Self {
            writer: RunWriter::begin(out, vehicle, None, Narrator::Caller)?,
            story: Story::default(),
            log_read_ms: 0,
            written: Ok(()),
        })
    }

    /// Takes the next row of the run, for what happened by then.
    pub fn row(&mut self, row: &TraceRow) {
        self.story.add(row.sight());
        let events = self.story.take();
        self.write(|writer| events.iter().try_for_each(|event| writer.event(event)));
    }

    /// Takes the records of the next ticks.
    pub fn records(&mut self, records: &[FlightRecord]) {
        self.write(|writer| records.iter().try_for_each(|record| writer.record(record)));
    }

    /// Whether the log is to be read at `now_ms` since the start.
    pub fn wants_log(&mut self, now_ms: u64) -> bool {
        let due = now_ms >= self.log_read_ms + LOG_PERIOD_MS;
        if due {
            self.log_read_ms = now_ms;
        }
        due
    }

    /// Takes the next lines of the firmware's log.
    pub fn log(&mut self, lines: &[String]) {
        self.write(|writer| lines.iter().try_for_each(|line| writer.log(&LogLine::printed(line))));
    }

    /// Completes the file; its name.
    ///
    /// # Errors
    /// [`CommandError`]: what could not be written. What a full disk took is kept.
    pub fn finish(self) -> Result<PathBuf, CommandError> {
        let Self {
            mut writer,
            story,
            written,
            ..
        } = self;
        written?;
        story.told().events.iter().try_for_each(|event| writer.event(event))?;
        writer.finish()?.finish()
    }

    fn write(&mut self, write: impl FnOnce(&mut RunWriter<GrowingFile>) -> io::Result<()>) {
        if self.written.is_ok() {
            self.written = write(&mut self.writer).map_err(CommandError::from);
        }
    }
}

/// Replays the recorded ticks through the pure step: its mean cost on this host, ns, and the proof that
/// it repeats every actuation bit for bit.
///
/// # Errors
/// [`CommandError::Checks`]: the replay drives otherwise.
pub fn replay_ns(vehicle: &Vehicle<f64>, records: &[FlightRecord]) -> Result<f64, CommandError> {
    let vehicle = vehicle_f32(vehicle)?;
    let mut core = VehicleCore::new(&vehicle, &SCALES);
    let started = Instant::now();
    let wrong = records
        .iter()
        .find(|record| core.step(&record.sample, &record.command).actuation != record.actuation);
    let ns = started.elapsed().as_nanos() as f64 / records.len().max(1) as f64;
    match wrong {
        None => Ok(ns),
        Some(record) => Err(CommandError::Checks(format!(
            "tick {}: the replay drives otherwise",
            record.tick
        ))),
    }
}
