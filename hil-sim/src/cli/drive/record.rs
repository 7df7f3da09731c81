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
use virtual_board::records::boots;
use virtual_board::scenario::StoryEvent;

use super::vehicle_f32;

/// Time from one reading of the firmware's log to the next while a run is recorded, ms: the file gets it as the run goes.
const LOG_PERIOD_MS: u64 = 500;

/// The recording of a run under way: the file of `--record`. It grows with the run, and what is written stays whatever
/// ends the run.
pub struct RunRecord {
    writer: RunWriter<GrowingFile>,
    log_read_ms: u64,
    last_tick: u32,
    /// The disk's first refusal, after which nothing more is written.
    written: Result<(), CommandError>,
}

impl RunRecord {
    /// Begins the file, before the run, so that the tool reports at once a file that it cannot write. The board was
    /// given `vehicle`.
    ///
    /// # Errors
    /// [`CommandError`]: the file cannot be written.
    pub fn begin(path: &Path, vehicle: &Vehicle<f32>) -> Result<Self, CommandError> {
        let file = GrowingFile::create("--record", path)?;
        let out = RecordWriter::new(RecordFormat::of(path), file);
        Ok(Self {
            writer: RunWriter::begin(out, vehicle, None, Narrator::Caller)?,
            log_read_ms: 0,
            last_tick: 0,
            written: Ok(()),
        })
    }

    /// Takes what happened next.
    pub fn events(&mut self, events: &[StoryEvent]) {
        self.write(|writer| events.iter().try_for_each(|event| writer.event(event)));
    }

    /// Takes the records of the next ticks, of a board that was switched on `booted_us` after the start.
    pub fn records(&mut self, records: &[FlightRecord], booted_us: u64) {
        self.write(|writer| {
            writer.booted_at(booted_us);
            records.iter().try_for_each(|record| writer.record(record))
        });
    }

    /// Whether the log is to be read before these records are taken, at `now_ms` since the start: from time to time, and at the
    /// end of a boot, whose last lines stand before the records of the next one.
    pub fn wants_log(&mut self, now_ms: u64, records: &[FlightRecord]) -> bool {
        let boots = records.iter().fold((self.last_tick, false), |(last, boots), record| {
            (record.tick, boots || record.tick <= last)
        });
        self.last_tick = boots.0;
        let due = boots.1 || now_ms >= self.log_read_ms + LOG_PERIOD_MS;
        if due {
            self.log_read_ms = now_ms;
        }
        due
    }

    /// Takes the next lines of the firmware's log.
    pub fn log(&mut self, lines: &[String]) {
        self.write(|writer| lines.iter().try_for_each(|line| writer.log(&LogLine::printed(line))));
    }

    /// Takes what was under way at the end of the run and the last lines of the log, and completes the file; its name.
    ///
    /// # Errors
    /// [`CommandError`]: what could not be written. What a full disk took is kept.
    pub fn ended(mut self, under_way: &[StoryEvent], log: &[String]) -> Result<PathBuf, CommandError> {
        self.events(under_way);
        self.log(log);
        self.written?;
        self.writer.finish()?.finish()
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
    let started = Instant::now();
    let wrong = boots(records).find_map(|boot| {
        let mut core = VehicleCore::new(&vehicle, &SCALES);
        { boot.iter() }.find(|record| core.step(&record.sample, &record.command).actuation != record.actuation)
    });
    let ns = started.elapsed().as_nanos() as f64 / records.len().max(1) as f64;
    match wrong {
        None => Ok(ns),
        Some(record) => Err(CommandError::Checks(format!(
            "tick {}: the replay drives otherwise",
            record.tick
        ))),
    }
}
