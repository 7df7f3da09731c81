//! `hil-sim replay`: the recorded samples through the same step, bit for bit.

use std::io::Write as _;
use std::path::{Path, PathBuf};

use clap::Args;
use firmware::drive_board::SCALES;
use firmware::flight_record::FlightRecord;
use model::tick::VehicleCore;
use model::vehicle::Vehicle;
use record_file::ReadRecords;
use record_file::run::write_run;
use record_file::writer::{RecordFormat, RecordWriter};
use report::error::CommandError;
use report::files::{NewFile, refuse_existing};
use report::output::{print, print_json};
use serde::Serialize;
use virtual_board::records::first_field;

use super::drive::{load_vehicle, vehicle_f32};
use super::record_files;

/// Flags of `replay`.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub struct Arguments {
    /// File of records, of `drive --record`, `link record` or `link look-back`
    file: PathBuf,
    /// Vehicle file of the set in force when it was recorded (`link parameters dump` writes it); what the file itself
    /// says, as a .mcap file does, or the reference vehicle if left out. With another one: up to where these gains would
    /// have driven otherwise
    #[arg(long, value_name = "FILE")]
    vehicle: Option<PathBuf>,
    /// Replay only the first S seconds after the boot
    #[arg(long, value_name = "S", value_parser = seconds)]
    until: Option<f64>,
    /// Make a test of the record: NAME.records in tests/records, with NAME.toml if the vehicle is not the reference
    /// vehicle. Only a record that replays becomes one
    #[arg(long, value_name = "NAME", value_parser = test_name)]
    as_test: Option<String>,
    /// Write the replay as MCAP, for other tools: NAME.mcap; must not exist
    #[arg(long, value_name = "FILE")]
    mcap: Option<PathBuf>,
    /// Print exactly one JSON object on stdout
    #[arg(long)]
    json: bool,
}

const EXAMPLES: &str = "\
Examples:
  hil-sim drive kerb --record kerb.mcap && hil-sim replay kerb.mcap
  hil-sim link --port /dev/ttyACM0 record --out run.mcap --seconds 60
  hil-sim replay run.mcap --vehicle my-vehicle.toml
  hil-sim replay run.mcap --until 3 --as-test runs-away
  hil-sim replay console.records --mcap console.mcap";

/// The records that tests replay.
const TESTS: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../tests/records");
/// Most ticks of a record that becomes a test: 10 s, some 300 kB.
const TEST_TICKS_MAX: usize = 10_000;

fn seconds(text: &str) -> Result<f64, String> {
    match text.parse() {
        Ok(seconds) if seconds > 0.0 && f64::is_finite(seconds) => Ok(seconds),
        _ => Err("must be more than 0".to_owned()),
    }
}

fn test_name(text: &str) -> Result<String, String> {
    let good = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '-';
    if !text.is_empty() && text.chars().all(good) {
        Ok(text.to_owned())
    } else {
        Err("must be of a-z, 0-9 and -".to_owned())
    }
}

/// The first tick whose replay drives otherwise.
#[derive(Debug, PartialEq, Serialize)]
struct ReplayDifference {
    tick: u32,
    /// When, s since boot.
    at_s: f64,
    /// What differs first.
    field: &'static str,
    recorded: i32,
    replayed: i32,
}

/// What `--json` prints.
#[derive(Debug, Serialize)]
struct ReplayJson {
    ticks: usize,
    from_s: f64,
    to_s: f64,
    lost_blocks: u32,
    unreadable: u32,
    difference: Option<ReplayDifference>,
    ok: bool,
}

/// Runs the command.
///
/// # Errors
/// [`CommandError::Input`] for a file that is none, or whose records do not begin with the board's boot;
/// [`CommandError::Checks`] if the replay drives otherwise, or ticks are missing.
pub fn run(arguments: &Arguments) -> Result<(), CommandError> {
    if let Some(path) = &arguments.mcap {
        refuse_existing("--mcap", path)?;
    }
    let mut read = record_files::read(&arguments.file)?;
    let vehicle = match (&arguments.vehicle, read.vehicle.take()) {
        (None, Some(vehicle)) => vehicle,
        (named, _) => load_vehicle(named.as_deref())?,
    };
    let vehicle = vehicle_f32(&vehicle)?;
    if let Some(until_s) = arguments.until {
        let is_before = |time_us: u64| time_us as f64 * 1e-6 <= until_s;
        read.file.records.retain(|record| is_before(record.sample.time_us));
        read.log.retain(|line| is_before(line.time_us));
    }
    let file = &read.file;
    let (Some(first), Some(last)) = (file.records.first(), file.records.last()) else {
        return Err(CommandError::Input("--until: there is no record before it".into()));
    };
    if first.tick > 1 {
        return Err(CommandError::Input(format!(
            "{}: the records begin with tick {}. What the vehicle knew by then is not in them: a replay begins with the \
             board's boot. `hil-sim link record` has it if it asks within 2 s of the boot",
            arguments.file.display(),
            first.tick
        )));
    }
    let gap = file
        .records
        .windows(2)
        .find(|pair| pair[1].tick != pair[0].tick.wrapping_add(1));
    let whole = gap.map_or(file.records.len(), |pair| (pair[0].tick - first.tick) as usize + 1);
    let difference = difference(&vehicle, &file.records[..whole]);
    let seconds = |record: &FlightRecord| record.sample.time_us as f64 * 1e-6;
    let result = ReplayJson {
        ticks: whole,
        from_s: seconds(first),
        to_s: seconds(last),
        lost_blocks: file.lost_blocks,
        unreadable: file.unreadable,
        ok: difference.is_none() && gap.is_none(),
        difference,
    };
    if arguments.json {
        print_json(&result)?;
    } else {
        print(&table(&result))?;
    }
    if let Some(path) = &arguments.mcap {
        write_mcap(path, &vehicle, &read)?;
    }
    match (&result.difference, gap) {
        (Some(found), _) => Err(CommandError::Checks(format!(
            "the replay drives otherwise from tick {} on; from there the vehicle would have moved otherwise too",
            found.tick
        ))),
        (None, Some(pair)) => Err(CommandError::Checks(format!(
            "ticks {} to {} are missing: the replay ends before them",
            pair[0].tick + 1,
            pair[1].tick.saturating_sub(1)
        ))),
        (None, None) => match &arguments.as_test {
            Some(name) => {
                make_test(name, &vehicle, &read)?;
                if arguments.json {
                    return Ok(());
                }
                print(&format!(
                    "tests/records/{name}.records: `cargo test -p hil-sim --test replay every_committed` replays it\n"
                ))
            }
            None => Ok(()),
        },
    }
}

/// Writes the records as MCAP, with the statuses and events of the replay, and the log that was recorded.
fn write_mcap(path: &Path, vehicle: &Vehicle<f32>, read: &ReadRecords) -> Result<(), CommandError> {
    let out = RecordWriter::new(RecordFormat::Mcap, NewFile::create("--mcap", path)?);
    write_run(out, vehicle, read.file.identity, &read.file.records, &read.log)?
        .finish()
        .map(|_| ())
}

/// Makes a test of records that replay.
fn make_test(name: &str, vehicle: &Vehicle<f32>, read: &ReadRecords) -> Result<(), CommandError> {
    let file = &read.file;
    let ticks = file.records.len();
    if ticks > TEST_TICKS_MAX {
        return Err(CommandError::Input(format!(
            "--as-test: {ticks} ticks; allowed are {TEST_TICKS_MAX}: with --until the first seconds alone"
        )));
    }
    let folder = Path::new(TESTS);
    if !folder.is_dir() {
        return Err(CommandError::Input(format!(
            "--as-test: {TESTS} is missing; it needs the workspace's sources"
        )));
    }
    let records = folder.join(name).with_extension("records");
    let out = RecordWriter::new(RecordFormat::Frames, NewFile::create("--as-test", &records)?);
    let out = write_run(out, vehicle, file.identity, &file.records, &read.log)?;
    if *vehicle != vehicle_f32(&load_vehicle(None)?)? {
        let mut file = NewFile::create("--as-test", &records.with_extension("toml"))?;
        file.write_all(vehicle_file::to_toml(vehicle.parameters()).as_bytes())?;
        file.finish()?;
    }
    out.finish()?;
    Ok(())
}

/// The first record whose actuation a core that starts anew does not repeat.
fn difference(vehicle: &Vehicle<f32>, records: &[FlightRecord]) -> Option<ReplayDifference> {
    let mut core = VehicleCore::new(vehicle, &SCALES);
    records.iter().find_map(|record| {
        let replayed = core.step(&record.sample, &record.command).actuation;
        let (field, recorded, replayed) = first_field(record.actuation, replayed)?;
        Some(ReplayDifference {
            tick: record.tick,
            at_s: record.sample.time_us as f64 * 1e-6,
            field,
            recorded,
            replayed,
        })
    })
}

fn table(result: &ReplayJson) -> String {
    let ReplayJson {
        ticks,
        from_s,
        to_s,
        lost_blocks,
        unreadable,
        difference,
        ..
    } = result;
    let what = match difference {
        None => "every actuation is the recorded one, bit for bit".to_owned(),
        Some(found) => format!(
            "differs first in tick {} ({:.3} s): {} is {}, the record has {}",
            found.tick, found.at_s, found.field, found.replayed, found.recorded
        ),
    };
    format!(
        "{ticks} ticks from {from_s:.3} to {to_s:.3} s, {lost_blocks} blocks lost, {unreadable} frames unreadable\n{what}\n"
    )
}
