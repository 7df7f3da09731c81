//! `hil-sim replay`: the recorded samples through the same step, bit for bit.

use std::path::PathBuf;

use clap::Args;
use firmware::drive_board::SCALES;
use firmware::flight_record::FlightRecord;
use model::tick::VehicleCore;
use model::vehicle::Vehicle;
use report::error::CommandError;
use report::output::{print, print_json};
use serde::Serialize;
use virtual_board::records::first_field;

use super::drive::{load_vehicle, vehicle_f32};
use super::record_file;

/// Flags of `replay`.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub struct Arguments {
    /// File of records, of `drive --record`, `link record` or `link look-back`
    file: PathBuf,
    /// Vehicle file of the set in force when it was recorded (`link parameters dump` writes it); the reference vehicle
    /// if left out. With another one: up to where these gains would have driven otherwise
    #[arg(long, value_name = "FILE")]
    vehicle: Option<PathBuf>,
    /// Print exactly one JSON object on stdout
    #[arg(long)]
    json: bool,
}

const EXAMPLES: &str = "\
Examples:
  hil-sim drive kerb --record kerb.records && hil-sim replay kerb.records
  hil-sim link --port /dev/ttyACM0 record --out run.records --seconds 60
  hil-sim replay run.records --vehicle my-vehicle.toml";

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
    let file = record_file::read(&arguments.file)?;
    let vehicle = vehicle_f32(&load_vehicle(arguments.vehicle.as_deref())?)?;
    let (Some(first), Some(last)) = (file.records.first(), file.records.last()) else {
        return Err(CommandError::Input("no records".into()));
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
        (None, None) => Ok(()),
    }
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
