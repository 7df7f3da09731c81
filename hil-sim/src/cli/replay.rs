//! `hil-sim replay`: runs the recorded samples through the same step, and compares bit for bit.

use std::io::Write as _;
use std::path::{Path, PathBuf};

use clap::Args;
use firmware::flight_record::FlightRecord;
use model::vehicle::Vehicle;
use record_file::mcap_repair::repair;
use record_file::replay::{BootToReplay, Replay, ReplayDifference};
use record_file::run::write_run;
use record_file::writer::{RecordFormat, RecordWriter};
use record_file::{ReadBoot, ReadRecords};
use report::error::CommandError;
use report::files::{NewFile, refuse_existing};
use report::output::{print, print_json};
use report::visible::visible_line;
use serde::Serialize;

use super::drive::{load_vehicle, vehicle_f32};
use super::record_files::{self, REPAIR_MCAP};

mod tick_table;

use tick_table::write_ticks;

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
    /// Replay only the first S seconds after the first boot
    #[arg(long, value_name = "S", value_parser = seconds)]
    until: Option<f64>,
    /// Make a test of the record: NAME.records in tests/records, with NAME.toml if the vehicle is not the reference
    /// vehicle. Only a record that replays becomes one
    #[arg(long, value_name = "NAME", value_parser = test_name)]
    as_test: Option<String>,
    /// Write the replay as MCAP, for other tools: NAME.mcap; must not exist
    #[arg(long, value_name = "FILE")]
    mcap: Option<PathBuf>,
    /// Write every tick as a row of a table, in SI units: what was sensed, commanded and done. Also of records that cannot be
    /// replayed, as those of `link look-back`; must not exist
    #[arg(long, value_name = "FILE")]
    csv: Option<PathBuf>,
    /// Rewrite a truncated .mcap record, as a killed tool or a full disk leaves it, with its index, even if it cannot be
    /// replayed: NAME.mcap; must not exist
    #[arg(long, value_name = "FILE", conflicts_with_all = ["vehicle", "until", "as_test", "mcap", "csv", "json"])]
    repair: Option<PathBuf>,
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
  hil-sim replay console.records --mcap console.mcap
  hil-sim replay fault.rec --csv fault.csv
  hil-sim replay cut.mcap --repair whole.mcap";

/// Folder of the records that tests replay.
const TESTS: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../tests/records");
/// Largest number of ticks of a record that becomes a test: 10 s, about 300 kB.
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

/// The first tick whose replayed actuation differs.
#[derive(Debug, PartialEq, Serialize)]
struct DifferenceJson {
    /// Number of the boot, from 1.
    boot: usize,
    tick: u32,
    /// When, s since boot.
    at_s: f64,
    /// The first field that differs.
    field: &'static str,
    recorded: i32,
    replayed: i32,
}

/// A boot of the board in the `--json` output.
#[derive(Debug, Serialize)]
struct BootJson {
    /// Number of replayed ticks.
    ticks: usize,
    /// Times of the first and the last record, s since the boot.
    from_s: f64,
    to_s: f64,
}

/// What `--json` prints.
#[derive(Debug, Serialize)]
struct ReplayJson {
    /// Number of replayed ticks of all boots.
    ticks: usize,
    boots: Vec<BootJson>,
    lost_blocks: u32,
    unreadable: u32,
    /// Whether the file has its end; a truncated one may lack the last ticks.
    ends: bool,
    difference: Option<DifferenceJson>,
    ok: bool,
}

/// Runs the command.
///
/// # Errors
/// [`CommandError::Input`] for a file without records, or whose records do not begin with the board's boot;
/// [`CommandError::Checks`] if the replay differs, or ticks are missing.
pub fn run(arguments: &Arguments) -> Result<(), CommandError> {
    if let Some(path) = &arguments.mcap {
        refuse_existing("--mcap", path)?;
    }
    if let Some(path) = &arguments.csv {
        refuse_existing("--csv", path)?;
    }
    if let Some(path) = &arguments.repair {
        return write_repaired(&arguments.file, path);
    }
    let mut read = record_files::read(&arguments.file)?;
    if let Some(until_s) = arguments.until {
        let is_before = |time_us: u64| time_us as f64 * 1e-6 <= until_s;
        read.boots.truncate(1);
        for boot in &mut read.boots {
            boot.records.retain(|record| is_before(record.sample.time_us));
            boot.log.retain(|line| is_before(line.time_us));
        }
        if read.records().next().is_none() {
            return Err(CommandError::Input("--until: there is no record before it".into()));
        }
    }
    // A boot whose records were all lost has nothing to replay.
    read.boots.retain(|boot| !boot.records.is_empty());
    let vehicles = vehicles(arguments.vehicle.as_deref(), &read)?;
    let boots = read.boots.iter().zip(&vehicles);
    let mut replay = Replay::new(
        boots
            .map(|(boot, vehicle)| BootToReplay {
                vehicle: *vehicle,
                records: &boot.records[..],
            })
            .collect(),
    );
    if let Some(path) = &arguments.csv {
        let mut out = NewFile::create("--csv", path)?;
        write_ticks(&mut out, &read.boots)?;
        out.finish()?;
    }
    if replay.next_boot().is_none() {
        let first = read.records().next().map_or(0, |first| first.tick);
        if let (Some(path), None, None, false) = (&arguments.csv, &arguments.mcap, &arguments.as_test, arguments.json) {
            let ticks = read.records().count();
            return print(&format!(
                "{ticks} ticks in {}; not replayed, because they begin with tick {first}, not with the board's boot\n",
                visible_line(&path.display().to_string())
            ));
        }
        return Err(CommandError::Input(format!(
            "{}: the records begin with tick {first}. What the vehicle knew by then is not in them: a replay begins with the \
             board's boot. `hil-sim link record` has it if it asks within 2 s of the boot. `--csv FILE` writes the ticks \
             that are there as a table",
            arguments.file.display()
        )));
    }
    let difference = std::iter::from_fn(|| replay.step()).find_map(|tick| tick.difference);
    let result = ReplayJson {
        ticks: replay.ticks().iter().sum(),
        boots: { read.boots.iter() }
            .zip(replay.ticks())
            .map(|(boot, ticks)| BootJson::of(&boot.records, *ticks))
            .collect(),
        lost_blocks: read.lost_blocks,
        unreadable: read.unreadable,
        ends: read.ends,
        ok: difference.is_none() && replay.missing().is_empty(),
        difference: difference.map(DifferenceJson::from),
    };
    if arguments.json {
        print_json(&result)?;
    } else {
        print(&table(&result))?;
    }
    if let Some(path) = &arguments.mcap {
        write_mcap(path, &vehicles, &read)?;
    }
    match (difference, replay.missing().first()) {
        (Some(found), _) => Err(CommandError::Checks(format!(
            "the replay drives otherwise from tick {}{} on; from there the vehicle would have moved otherwise too",
            found.tick,
            of_boot(found.boot, result.boots.len())
        ))),
        (None, Some(missing)) => Err(CommandError::Checks(missing.to_string())),
        (None, None) => match &arguments.as_test {
            Some(name) => {
                make_test(name, &vehicles, &read)?;
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

/// The vehicle of each boot: from `named`, else from the file, else the reference vehicle.
fn vehicles(named: Option<&Path>, read: &ReadRecords) -> Result<Vec<Vehicle<f32>>, CommandError> {
    let named = named.map(|path| load_vehicle(Some(path))).transpose()?;
    let of_boot = |boot: &ReadBoot| match named.or(boot.vehicle) {
        Some(vehicle) => vehicle_f32(&vehicle),
        None => vehicle_f32(&load_vehicle(None)?),
    };
    read.boots.iter().map(of_boot).collect()
}

/// " of boot 2", if the file has several boots.
fn of_boot(boot: usize, boots: usize) -> String {
    if boots > 1 {
        format!(" of boot {boot}")
    } else {
        String::new()
    }
}

/// Writes the records as MCAP, with the statuses and events of the replay, and the recorded log.
fn write_mcap(path: &Path, vehicles: &[Vehicle<f32>], read: &ReadRecords) -> Result<(), CommandError> {
    let out = RecordWriter::new(RecordFormat::Mcap, NewFile::create("--mcap", path)?);
    write_run(out, vehicles, &read.boots)?.finish().map(|_| ())
}

/// Writes the MCAP file `file`, which may break off, anew with its index.
fn write_repaired(file: &Path, path: &Path) -> Result<(), CommandError> {
    refuse_existing("--repair", path)?;
    let Some((out, messages)) = repair(&record_files::bytes(file)?, NewFile::create("--repair", path)?)? else {
        return Err(CommandError::Input(format!(
            "--repair: {}: not an MCAP file of this tool; a file of the link's frames alone needs no index",
            file.display()
        )));
    };
    out.finish()?;
    print(&format!(
        "{messages} messages in {}, with an index\n",
        visible_line(&path.display().to_string())
    ))
}

/// Makes a test from records that replay.
fn make_test(name: &str, vehicles: &[Vehicle<f32>], read: &ReadRecords) -> Result<(), CommandError> {
    let ticks = read.records().count();
    let (Some(vehicle), [_]) = (vehicles.first(), &read.boots[..]) else {
        return Err(CommandError::Input(format!(
            "--as-test: {} boots; a test has one: with --until the first boot alone",
            read.boots.len()
        )));
    };
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
    let out = write_run(out, vehicles, &read.boots)?;
    if *vehicle != vehicle_f32(&load_vehicle(None)?)? {
        let mut file = NewFile::create("--as-test", &records.with_extension("toml"))?;
        file.write_all(vehicle_file::to_toml(vehicle.parameters()).as_bytes())?;
        file.finish()?;
    }
    out.finish()?;
    Ok(())
}

impl BootJson {
    fn of(records: &[FlightRecord], ticks: usize) -> Self {
        let seconds = |record: Option<&FlightRecord>| record.map_or(0.0, |record| record.sample.time_us as f64 * 1e-6);
        Self {
            ticks,
            from_s: seconds(records.first()),
            to_s: seconds(records.last()),
        }
    }
}

impl From<ReplayDifference> for DifferenceJson {
    fn from(found: ReplayDifference) -> Self {
        Self {
            boot: found.boot,
            tick: found.tick,
            at_s: found.time_us as f64 * 1e-6,
            field: found.field,
            recorded: found.recorded,
            replayed: found.replayed,
        }
    }
}

fn table(result: &ReplayJson) -> String {
    let boots = result.boots.len();
    let mut lines: Vec<String> = { result.boots.iter().zip(1..) }
        .map(|(boot, number)| {
            let name = if boots > 1 {
                format!("boot {number}: ")
            } else {
                String::new()
            };
            let BootJson { ticks, from_s, to_s } = boot;
            format!("{name}{ticks} ticks from {from_s:.3} to {to_s:.3} s")
        })
        .collect();
    let lost = format!(
        "{} blocks lost, {} frames unreadable",
        result.lost_blocks, result.unreadable
    );
    match &mut lines[..] {
        [one] => *one = format!("{one}, {lost}"),
        _ => lines.push(lost),
    }
    if !result.ends {
        lines.push(format!(
            "the file is truncated: what the vehicle did last may be missing; {REPAIR_MCAP}"
        ));
    }
    lines.push(match &result.difference {
        None => "every actuation is the recorded one, bit for bit".to_owned(),
        Some(found) => format!(
            "differs first in tick {}{} ({:.3} s): {} is {}, the record has {}",
            found.tick,
            of_boot(found.boot, boots),
            found.at_s,
            found.field,
            found.replayed,
            found.recorded
        ),
    });
    lines.join("\n") + "\n"
}
