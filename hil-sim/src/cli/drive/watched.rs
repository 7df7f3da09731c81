//! The data of a run that are collected during the run.

use std::cell::RefCell;

use firmware::flight_record::FlightRecord;
use report::error::CommandError;
use report::output::progress_bar;
use virtual_board::scenario::trace::TraceRow;
use virtual_board::scenario::{self, Backend, Metrics, RunEnd, RunError, Scenario, Story};

use super::files::RunReport;
use super::record::RunRecord;

/// The data of a run that are collected during the run.
pub struct Watched {
    /// The run's metrics.
    pub measured: Metrics,
    /// The run's events.
    pub story: Story,
    /// The files of `--out`, if requested.
    pub report: Option<RunReport>,
    /// The file of `--record`, if requested.
    pub record: Option<RunRecord>,
    /// The first ticks, at most `replayed_max`, for the replay after the run.
    pub first_records: Vec<FlightRecord>,
    /// Largest number of replayed ticks.
    pub replayed_max: usize,
    /// The part of the log that was read for the record.
    pub log: Vec<String>,
    /// Whether everything was written to the report's files.
    pub written: Result<(), CommandError>,
}

impl Default for Watched {
    fn default() -> Self {
        Self {
            measured: Metrics::default(),
            story: Story::default(),
            report: None,
            record: None,
            first_records: Vec::new(),
            replayed_max: 0,
            log: Vec::new(),
            written: Ok(()),
        }
    }
}

impl Watched {
    /// Runs the scenario with a progress bar.
    ///
    /// # Errors
    /// [`RunError`]: the run could not continue.
    pub fn drive(&mut self, scenario: &Scenario, backend: &mut dyn Backend) -> Result<RunEnd, RunError> {
        if self.replayed_max > 0 || self.record.is_some() {
            backend.keep_records();
        }
        let bar = progress_bar((scenario.duration_s * 1000.0) as usize, "driving");
        let watched = RefCell::new(self);
        let end = scenario::run_watched(
            scenario,
            backend,
            |row| watched.borrow_mut().row(row),
            |ms| {
                if ms % 100 == 0 {
                    bar.set_position(ms);
                }
            },
            |backend| watched.borrow_mut().records(backend),
        );
        bar.finish_and_clear();
        end
    }

    fn row(&mut self, row: &TraceRow) {
        self.measured.add(row);
        self.story.add(row.sight());
        if let Some(record) = &mut self.record {
            record.events(self.story.new_events());
        }
        if let (Some(report), Ok(())) = (&mut self.report, &self.written) {
            self.written = report.add(row);
        }
    }

    fn records(&mut self, backend: &mut dyn Backend) {
        let records = backend.take_records();
        let room = self.replayed_max - self.first_records.len();
        self.first_records.extend(records.iter().take(room));
        if let Some(record) = &mut self.record {
            if record.wants_log(backend.now_us() / 1000, &records) {
                let lines = backend.log();
                record.log(&lines);
                self.log.extend(lines);
            }
            record.records(&records, backend.booted_us());
        }
    }
}
