//! The record of a run: its file, and its replay after the run.

use std::path::{Path, PathBuf};
use std::time::Instant;

use firmware::drive_board::SCALES;
use firmware::flight_record::FlightRecord;
use model::tick::VehicleCore;
use model::vehicle::Vehicle;
use report::error::CommandError;
use report::files::NewFile;
use virtual_board::scenario::{Scenario, StoryEvent};

use super::vehicle_f32;
use crate::cli::record_file::run::{RecordedRun, write_run};
use crate::cli::record_file::writer::{RecordFormat, RecordWriter};

/// Most ticks that are recorded: 600 s, which is 120 MB until they are written.
pub const RECORD_TICKS_MAX: usize = 600_000;

/// The file of `--record`.
pub struct RunRecord {
    file: NewFile,
    format: RecordFormat,
}

impl RunRecord {
    /// Begins the file, before the run: one that cannot be written is told at once.
    ///
    /// # Errors
    /// [`CommandError::Input`]: the file cannot be written, or the scenario is too long for a record.
    pub fn begin(path: Option<&Path>, scenario: &Scenario) -> Result<Option<Self>, CommandError> {
        let Some(path) = path else {
            return Ok(None);
        };
        if scenario.duration_s * 1000.0 > RECORD_TICKS_MAX as f64 {
            return Err(CommandError::Input(format!(
                "--record: the scenario lasts {} s, at most {} s are recorded",
                scenario.duration_s,
                RECORD_TICKS_MAX / 1000
            )));
        }
        let file = NewFile::create("--record", path)?;
        let format = RecordFormat::of(path);
        Ok(Some(Self { file, format }))
    }

    /// Writes the whole record of a board that was told of `vehicle`; the file. What a full disk took of it is kept.
    ///
    /// # Errors
    /// [`CommandError`]: what cannot be written.
    pub fn write(
        mut self,
        vehicle: &Vehicle<f32>,
        records: &[FlightRecord],
        log: &[String],
        events: &[StoryEvent],
    ) -> Result<PathBuf, CommandError> {
        let run = RecordedRun {
            vehicle,
            identity: None,
            records,
            log,
            events: Some(events),
        };
        let mut out = RecordWriter::new(self.format, &mut self.file);
        let written = write_run(&mut out, &run);
        let finished = out.finish().map(|_| ());
        match written.and(finished) {
            Ok(()) => self.file.finish(),
            Err(error) => {
                self.file.keep();
                Err(error)
            }
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
