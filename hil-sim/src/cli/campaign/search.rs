//! `hil-sim campaign search`: the search for a drive that a speed law does not survive.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::time::Instant;

use clap::Args;
use clap::builder::{PossibleValuesParser, TypedValueParser as _};
use firmware::drive_board::SCALES;
use model::vehicle::Vehicle;
use rayon::prelude::*;
use report::colour::{bad, good};
use report::error::CommandError;
use report::files::NewFile;
use report::output::{print_coloured, print_json, progress_bar};
use report::visible::visible_line;
use serde::Serialize;
use theory::analysis::law_search::{LawSearch, SearchGroup, SearchTotals, SwingCounts};
use theory::analysis::random_drive::SearchedLaw;
use virtual_board::scenario::trace::fnv1a;

use super::results::{CampaignKind, Header, SearchIdentity, write_line};
use super::shard::{Shard, batches, shard, threads};

/// Flags of `campaign search`.
#[derive(Debug, Args)]
pub(super) struct SearchArguments {
    /// Random drives: steps of the speed at random times, on random slopes, with parameters up to 20 % off and random supplies
    #[arg(long, default_value_t = 10_000, value_parser = clap::value_parser!(u64).range(0..=COUNT_MAX), value_name = "N")]
    drives: u64,
    /// Of each thousand drives, the worst N whose commands an optimiser moves to where the arm swings furthest, some 200
    /// drives each
    #[arg(long, default_value_t = 1, value_parser = clap::value_parser!(u16).range(0..=1000), value_name = "N")]
    climbs: u16,
    /// Vehicles with nine parameters up to 20 % off that take a step from 0 to 1
    #[arg(long, default_value_t = 0, value_parser = clap::value_parser!(u64).range(0..=COUNT_MAX), value_name = "N")]
    plants: u64,
    /// Seed of the first drive; the others follow
    #[arg(long, default_value_t = 0, value_parser = clap::value_parser!(u64).range(0..=u64::MAX - COUNT_MAX), value_name = "SEED")]
    first_seed: u64,
    /// Vehicle file; the reference vehicle if left out
    #[arg(long, value_name = "FILE")]
    vehicle: Option<PathBuf>,
    /// Law that drives, the landing law or Eq. 3.25 alone, whatever the vehicle file has
    #[arg(long, default_value = LAWS[0].0, value_parser = PossibleValuesParser::new(LAWS.map(|(name, _)| name)).map(|name| law(&name)))]
    law: SearchedLaw,
    /// Search only this part of the thousands: part I of N, counted from 1
    #[arg(long, value_parser = shard, value_name = "I/N")]
    shard: Option<Shard>,
    /// Drives at once; as many as the machine has cores if left out
    #[arg(long, value_parser = clap::value_parser!(u16).range(1..=1024))]
    jobs: Option<u16>,
    /// File for the results, which must not exist: a line of JSON for the search, then one for each thousand drives
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    /// Print exactly one JSON object on stdout: the summary
    #[arg(long)]
    json: bool,
}

pub(super) const EXAMPLES: &str = "\
Examples:
  hil-sim campaign search
  hil-sim campaign search --drives 60000 --climbs 0
  hil-sim campaign search --drives 0 --plants 1000
  hil-sim campaign search --drives 2000 --climbs 0 --law eq-3.25
  hil-sim campaign search --drives 1 --first-seed 47336
  hil-sim campaign search --drives 1000000 --shard 3/8 --out part-3.jsonl
  hil-sim campaign merge part-*.jsonl --out whole.jsonl";

/// Largest number of drives of a search.
const COUNT_MAX: u64 = 100_000_000;

/// The laws, by name.
const LAWS: [(&str, SearchedLaw); 2] = [("landing", SearchedLaw::Landing), ("eq-3.25", SearchedLaw::Eq325)];

fn law(name: &str) -> SearchedLaw {
    let found = LAWS.into_iter().find(|(law, _)| *law == name);
    found.map_or(SearchedLaw::Landing, |(_, law)| law)
}

/// What `--json` prints.
#[derive(Debug, Serialize)]
struct SearchSummary {
    #[serde(flatten)]
    totals: SearchTotals,
    wall_s: f64,
    threads: usize,
}

/// Runs the command.
///
/// # Errors
/// [`CommandError::Input`] on a bad file or flag, [`CommandError::Checks`] when an arm turns over.
pub(super) fn search(arguments: &SearchArguments) -> Result<(), CommandError> {
    let (search, identity) = prepare(arguments)?;
    let range = arguments.shard.unwrap_or(Shard::WHOLE).of(search.groups());
    let mut file = arguments
        .out
        .as_deref()
        .map(|path| NewFile::create("--out", path))
        .transpose()?;
    if let Some(file) = &mut file {
        let campaign = CampaignKind::Search(identity);
        let range = [range.start, range.end];
        write_line(file, &Header { campaign, range })?;
    }
    let pool = threads(arguments.jobs)?;
    let bar = progress_bar((range.end - range.start) as usize, "thousands of drives");
    let started = Instant::now();
    let mut totals = SearchTotals::default();
    // Batches keep the results in order and the memory bounded.
    for batch in batches(range, 4 * pool.current_num_threads() as u64) {
        let groups: Vec<SearchGroup> = pool.install(|| {
            let searched = batch.into_par_iter().map(|run| {
                let group = search.group(run);
                bar.inc(1);
                group
            });
            searched.collect()
        });
        for group in groups {
            if let Some(file) = &mut file {
                write_line(file, &group)?;
            }
            totals.add(&group);
        }
    }
    let wall_s = started.elapsed().as_secs_f64();
    bar.finish_and_clear();
    let out = file.map(NewFile::finish).transpose()?;
    let summary = SearchSummary {
        totals: totals.finish(),
        wall_s,
        threads: pool.current_num_threads(),
    };
    if arguments.json {
        print_json(&summary)?;
    } else {
        let mut text = table(&summary.totals);
        _ = writeln!(text, "{wall_s:.1} s on {} threads", summary.threads);
        text.push_str(&results(out.as_deref()));
        print_coloured(&text)?;
    }
    match summary.totals.whirls() {
        0 => Ok(()),
        whirls => Err(CommandError::Checks(format!(
            "the arm turned over in {whirls} drives; `hil-sim campaign search --drives 1 --first-seed SEED` repeats one"
        ))),
    }
}

/// The search of these flags, and its identity.
fn prepare(arguments: &SearchArguments) -> Result<(LawSearch, SearchIdentity), CommandError> {
    let (name, text) = match &arguments.vehicle {
        None => (
            vehicle_file::REFERENCE_NAME.to_owned(),
            vehicle_file::REFERENCE.to_owned(),
        ),
        Some(path) => (
            path.display().to_string(),
            vehicle_file::read_text(path)
                .map_err(|reason| CommandError::Input(format!("{}: {reason}", path.display())))?,
        ),
    };
    let vehicle = vehicle_file::parse_vehicle_for(&name, &text, &SCALES.sensor_ranges())
        .map_err(|error| CommandError::Input(error.to_string()))?;
    let flown = Vehicle::new(arguments.law.flown(vehicle.parameters()))
        .map_err(|error| CommandError::Input(format!("{name}: {error}")))?;
    let search = LawSearch {
        vehicle: flown,
        first_seed: arguments.first_seed,
        drives: arguments.drives,
        climbs: usize::from(arguments.climbs),
        plants: arguments.plants,
    };
    let identity = SearchIdentity {
        version: env!("CARGO_PKG_VERSION").to_owned(),
        vehicle: name,
        files: format!("{:016x}", fnv1a(text.bytes())),
        law: arguments.law,
        first_seed: search.first_seed,
        drives: search.drives,
        climbs: arguments.climbs,
        plants: search.plants,
        runs: search.groups(),
    };
    Ok((search, identity))
}

/// A line that names the file of the results.
pub(super) fn results(out: Option<&Path>) -> String {
    out.map_or(String::new(), |out| {
        format!("results {}\n", visible_line(&out.display().to_string()))
    })
}

/// The search's result as text.
pub(super) fn table(totals: &SearchTotals) -> String {
    let mut text = String::new();
    for (what, counts) in [("random drives", &totals.random), ("optimised", &totals.climbed)] {
        text.push_str(&counted(what, counts));
    }
    if totals.random.drives > 0 {
        let sliding = 100.0 * totals.sliding;
        _ = writeln!(
            text,
            "{:>9} % of the time of the random drives over the file's grip",
            format!("{sliding:.3}")
        );
    }
    if let Some(plants) = &totals.plants {
        let time = |time: Option<f64>| time.map_or_else(|| "never".to_owned(), |time| format!("{time:.2}"));
        let percent = |values: [f64; 3]| values.map(|value| format!("{:.1}", 100.0 * value));
        _ = writeln!(
            text,
            "{:>9} vehicles of +-20 % take a step: {} turn over; median, 95 %, worst:",
            plants.plants, plants.whirls
        );
        for (what, values) in [
            ("settling, time units", plants.settling.map(time)),
            ("overshoot, %", percent(plants.overshoot)),
            ("undershoot, %", percent(plants.undershoot)),
            (
                "largest arm angle, deg",
                plants.phi_max_deg.map(|value| format!("{value:.1}")),
            ),
            (
                "distance from the speed at the end, % of the unit",
                plants.ripple.map(|value| format!("{:.2}", 100.0 * value)),
            ),
        ] {
            _ = writeln!(text, "          {what}: {}", values.join(", "));
        }
        if !plants.slow.is_empty() {
            _ = writeln!(
                text,
                "          not settled after 18 time units: seeds {:?}",
                plants.slow
            );
        }
    }
    text
}

fn counted(what: &str, counts: &SwingCounts) -> String {
    let Some(worst) = counts.worst else {
        return String::new();
    };
    let whirls = if counts.whirls == 0 {
        good("none turns over")
    } else {
        bad(format!("{} turn over", counts.whirls))
    };
    format!(
        "{:>9} {what}: {whirls}, {} beyond 1.4 rad; worst seed {}, {:.3} rad\n",
        counts.drives, counts.far, worst.seed, worst.phi_max_rad
    )
}
