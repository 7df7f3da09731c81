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

use super::arguments::vehicle_f32;
use crate::cli::record_files::if_cut;

/// Time between two reads of the firmware's log while a run is recorded, ms. The file receives the log during the run.
const LOG_PERIOD_MS: u64 = 500;

/// The recording of a run: the file of `--record`. The file grows with the run, and everything written stays, whatever
/// ends the run.
pub struct RunRecord {
    writer: RunWriter<GrowingFile>,
    log_read_ms: u64,
    last_tick: u32,
    /// The first write error, after which nothing more is written.
    written: Result<(), CommandError>,
}

impl RunRecord {
    /// Begins the file before the run, so that the tool reports at once a file that it cannot write. `vehicle` is the
    /// board's vehicle.
    ///
    /// # Errors
    /// [`CommandError`]: the file cannot be written.
    pub fn begin(path: &Path, vehicle: &Vehicle<f32>) -> Result<Self, CommandError> {
        let file = GrowingFile::create("--record", path)?.if_cut(if_cut(path));
        let out = RecordWriter::new(RecordFormat::of(path), file);
        Ok(Self {
            writer: RunWriter::begin(out, vehicle, None, Narrator::Caller)?,
            log_read_ms: 0,
            last_tick: 0,
            written: Ok(()),
        })
    }

    /// Takes the next events.
    pub fn events(&mut self, events: &[StoryEvent]) {
        self.write(|writer| events.iter().try_for_each(|event| writer.event(event)));
    }

    /// Takes the records of the next ticks of a board that was switched on at `booted_us`, us since the start.
    pub fn records(&mut self, records: &[FlightRecord], booted_us: u64) {
        self.write(|writer| {
            writer.booted_at(booted_us);
            records.iter().try_for_each(|record| writer.record(record))
        });
    }

    /// Whether the log must be read before these records are taken, at `now_ms` since the start: periodically, and at
    /// the end of a boot, whose last lines precede the next boot's records.
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

    /// Takes the events in progress at the end of the run and the log's last lines, and completes the file with what it has;
    /// returns its name.
    ///
    /// # Errors
    /// [`CommandError`]: the file could not be written completely. Everything written before stays.
    pub fn ended(mut self, under_way: &[StoryEvent], log: &[String]) -> Result<PathBuf, CommandError> {
        self.events(under_way);
        self.log(log);
        let finished = self.writer.finish();
        self.written?;
        finished?.finish()
    }

    fn write(&mut self, write: impl FnOnce(&mut RunWriter<GrowingFile>) -> io::Result<()>) {
        if self.written.is_ok() {
            self.written = write(&mut self.writer).map_err(CommandError::from);
        }
    }
}

/// Replays the recorded ticks through the pure step and checks that the step repeats every actuation bit for bit;
/// returns the step's mean cost on this host, ns.
///
/// # Errors
/// [`CommandError::Checks`]: a replayed actuation differs.
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
