//! `hil-sim drive`: the simulated vehicle, driven by the firmware's own tasks.

use std::path::PathBuf;
use std::time::Instant;

use model::vehicle::Vehicle;
use serde::Serialize;

use crate::cli::emulated::{self, only_emulated};
use plant::Plant;
use report::error::CommandError;
use report::files::refuse_existing;
use report::output::{command_line, print_coloured, print_json};
use report::visible::visible_line;
use virtual_board::scenario::{self, Backend, Check, MetricValue, RunVerdict, Scenario, StoryEvent, VirtualBackend};

mod arguments;
mod files;
pub mod page;
mod record;
pub mod rows;
pub mod seeds;
mod table;
mod terms;
mod watched;

pub use arguments::{Arguments, BoardKind, load_vehicle};
use arguments::{file_name, load_run};
pub(super) use arguments::{load_scenario, load_vehicles, vehicle_f32};
use files::RunReport;
use page::{RunOrigin, RunSummary};
use record::{RunRecord, replay_ns};
use watched::Watched;

/// Directory of the report without `--out`.
const DEFAULT_OUT: &str = "out/drive";

/// Largest number of ticks replayed after the run, from its start: 100 s.
const REPLAY_TICKS_MAX: usize = 100_000;

/// What `--json` prints.
#[derive(Debug, Serialize)]
struct Json<'a> {
    scenario: &'a str,
    seed: u64,
    metrics: &'a [MetricValue],
    checks: &'a [Check],
    /// Whether the run met every bound; `None` for a run that is not judged.
    ok: Option<bool>,
    verdict: RunVerdict,
    events: &'a [StoryEvent],
    events_dropped: u64,
    simulated_s: f64,
}

/// Runs the command.
///
/// # Errors
/// [`CommandError::Input`] on a bad scenario or vehicle file, [`CommandError::Checks`] when a metric
/// leaves its bounds.
pub fn run(arguments: &Arguments) -> Result<(), CommandError> {
    if let (Some(seeds), BoardKind::Virtual) = (&arguments.seeds, arguments.board) {
        return seeds::run(arguments, seeds.clone());
    }
    match (arguments.board, &arguments.firmware) {
        (BoardKind::Emulated, _) if arguments.seeds.is_some() => Err(CommandError::Input(
            "--seeds: many runs at once need --board virtual".into(),
        )),
        (BoardKind::Emulated, firmware) => emulated::run(firmware.as_deref()),
        (BoardKind::Virtual, Some(_)) => Err(only_emulated()),
        (BoardKind::Virtual, None) => run_on(
            arguments,
            |vehicle, plant| {
                let backend = VirtualBackend::boot(vehicle, plant);
                backend.map_err(|error| CommandError::Input(error.to_string()))
            },
            |_backend| Ok(()),
        ),
    }
}

/// Runs the command on the board that `boot` creates; `ended` inspects the board after the run.
///
/// # Errors
/// As [`run`], and the errors of `boot` and `ended`.
pub fn run_on<B: Backend>(
    arguments: &Arguments,
    boot: impl FnOnce(&Vehicle<f64>, Plant) -> Result<B, CommandError>,
    ended: impl FnOnce(&mut B) -> Result<(), CommandError>,
) -> Result<(), CommandError> {
    let (scenario, vehicle, simulated) = load_run(arguments)?;
    if let Some(path) = &arguments.record {
        refuse_existing("--record", path)?;
    }
    let plant = scenario
        .plant(&simulated)
        .map_err(|error| CommandError::Input(error.to_string()))?;
    let mut backend = boot(&vehicle, plant)?;
    let mut watched = Watched {
        replayed_max: if arguments.json { 0 } else { REPLAY_TICKS_MAX },
        ..Watched::default()
    };
    if arguments.out.is_some() || !arguments.json {
        let out = arguments.out.clone().unwrap_or_else(|| PathBuf::from(DEFAULT_OUT));
        watched.report = Some(RunReport::create(out)?);
    }
    // Last, so that a drive that cannot begin leaves no record file.
    let record = arguments.record.as_deref();
    let record = record.map(|path| RunRecord::begin(path, &vehicle_f32(&vehicle)?));
    watched.record = record.transpose()?;

    let started = Instant::now();
    let end = watched
        .drive(&scenario, &mut backend)
        .map_err(|error| CommandError::Checks(format!("{} (seed {}): {error}", file_name(arguments), scenario.seed)));
    let wall_s = started.elapsed().as_secs_f64();
    let Watched {
        measured,
        story,
        report,
        record,
        first_records,
        mut log,
        written,
        ..
    } = watched;
    // The record matters most for a run that could not continue.
    let last_lines = end.as_ref().map_or(&[][..], |end| &end.log);
    // The tool reports the drive even if the disk could not store the whole record.
    let (record, recorded) = match record.map(|record| record.ended(&story.under_way(), last_lines)) {
        Some(Ok(path)) => {
            let path = path.display().to_string();
            (format!("\nrecord                 {}", visible_line(&path)), Ok(()))
        }
        Some(Err(error)) => (String::new(), Err(error)),
        None => (String::new(), Ok(())),
    };
    let told = story.told();
    written?;
    ended(&mut backend)?;
    let end = end?;
    log.extend(end.log);
    let values = measured.values(&end.counts);
    let checks = scenario::judge(&scenario, &values);
    let verdict = RunVerdict::of(&scenario, &checks);
    let address = { arguments.record.as_deref() }
        .zip(report.as_ref())
        .and_then(|(file, report)| report.address(file));
    let summary = RunSummary {
        scenario: &scenario,
        vehicle: &simulated,
        origin: &origin(arguments, &scenario),
        values: &values,
        checks: &checks,
        told: &told,
        log: &log,
        record: address.as_deref(),
    };
    let out = report
        .map(|report| report.finish(&summary))
        .transpose()?
        .unwrap_or_default();
    if arguments.json {
        print_json(&Json {
            scenario: &scenario.title,
            seed: scenario.seed,
            metrics: &values,
            checks: &checks,
            ok: (verdict != RunVerdict::NotJudged).then_some(verdict == RunVerdict::Passed),
            verdict,
            events: &told.events,
            events_dropped: told.dropped,
            simulated_s: scenario.duration_s,
        })?;
    } else {
        let tick_ns = replay_ns(&vehicle, &first_records)?;
        print_coloured(&format!(
            "{}\ntick on this host      {tick_ns:.0} ns (replaying {} recorded ticks)\n\
             simulated              {} s in {wall_s:.2} s, {:.1} times real time\n\
             page, plots, trace, log {}{record}\n",
            table::table(&summary),
            first_records.len(),
            scenario.duration_s,
            scenario.duration_s / wall_s,
            visible_line(&out.display().to_string())
        ))?;
    }
    recorded?;
    if verdict == RunVerdict::Failed {
        return Err(failed(arguments, &scenario, &checks));
    }
    Ok(())
}

/// The error that names the metrics out of bounds.
fn failed(arguments: &Arguments, scenario: &Scenario, checks: &[Check]) -> CommandError {
    CommandError::Checks(format!(
        "{} (seed {}): {}",
        file_name(arguments),
        scenario.seed,
        scenario::failures(checks).join("; ")
    ))
}

/// A run's origin, for its page.
fn origin(arguments: &Arguments, scenario: &Scenario) -> RunOrigin {
    let named = [&arguments.plant_vehicle, &arguments.vehicle, &scenario.vehicle];
    let vehicle = named.into_iter().flatten().next();
    RunOrigin {
        scenario: file_name(arguments).to_string(),
        vehicle: vehicle.map_or_else(
            || vehicle_file::REFERENCE_NAME.to_owned(),
            |path| path.display().to_string(),
        ),
        command: command_line(),
    }
}
