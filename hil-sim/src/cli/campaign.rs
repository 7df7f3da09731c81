//! `hil-sim campaign`: many runs at once on all cores, in shards if one machine is too small.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::ops::RangeInclusive;
use std::path::{Path, PathBuf};
use std::time::Instant;

use clap::{Args, Subcommand};
use rayon::prelude::*;
use report::colour::bad;
use report::error::CommandError;
use report::files::NewFile;
use report::output::{print_coloured, print_json, progress_bar};
use report::visible::visible_line;
use serde::Serialize;
use virtual_board::campaign::{Axis, Campaign, RunResult};
use virtual_board::scenario::RunVerdict;

mod merge;
mod results;
mod search;
mod shard;

use merge::{MergeArguments, merge};
use results::{CampaignKind, Header, write_line};
use search::{SearchArguments, search};
use shard::{Shard, batches, shard, threads};

/// Flags of `campaign`.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub struct Arguments {
    #[command(subcommand)]
    what: What,
}

#[derive(Debug, Subcommand)]
enum What {
    /// Runs every scenario with every override and every seed
    #[command(after_help = EXAMPLES)]
    Run(RunArguments),
    /// Searches for a drive in which the arm turns over: random drives on the planar vehicle, and from the worst an optimiser
    #[command(after_help = search::EXAMPLES)]
    Search(SearchArguments),
    /// Joins the results of all shards into the file that one run of the whole campaign writes
    #[command(after_help = "Examples:\n  hil-sim campaign merge part-1.jsonl part-2.jsonl --out whole.jsonl")]
    Merge(MergeArguments),
}

const EXAMPLES: &str = "\
Examples:
  hil-sim campaign run tests/scenarios/*.toml --seeds 1:50
  hil-sim campaign run tests/scenarios/kerb.toml --seeds 1:24 --set scenario.terrain.profile.0.height_m=0.01,0.02,0.03
  hil-sim campaign run tests/scenarios/slope-drive.toml --set plant-vehicle.body.arm_mass_kg=9.6,12,14.4 --out mass.jsonl
  hil-sim campaign run tests/scenarios/*.toml --seeds 1:1000 --shard 3/8 --out part-3.jsonl
  hil-sim campaign search --drives 100000
  hil-sim campaign merge part-*.jsonl --out whole.jsonl";

#[derive(Debug, Args)]
struct RunArguments {
    /// Scenario files
    #[arg(required = true, value_name = "SCENARIO")]
    scenarios: Vec<PathBuf>,
    /// First and last seed
    #[arg(long, default_value = "1:24", value_parser = seeds, value_name = "FIRST:LAST")]
    seeds: RangeInclusive<u64>,
    /// Values of a field of the scenario or the vehicle; given several times, every combination runs
    #[arg(long, value_name = "KEY=VALUE[,VALUE...]")]
    set: Vec<String>,
    /// Vehicle file, instead of the scenarios'
    #[arg(long, value_name = "FILE")]
    vehicle: Option<PathBuf>,
    /// Vehicle file of the simulated vehicle, where it is another than the one that the firmware is given
    #[arg(long, value_name = "FILE")]
    plant_vehicle: Option<PathBuf>,
    /// Run only this part of the runs: part I of N, counted from 1
    #[arg(long, value_parser = shard, value_name = "I/N")]
    shard: Option<Shard>,
    /// Runs at once; as many as the machine has cores if left out
    #[arg(long, value_parser = clap::value_parser!(u16).range(1..=1024))]
    jobs: Option<u16>,
    /// File for the results, which must not exist: a line of JSON for the campaign, then one for each run
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    /// Print exactly one JSON object on stdout: the summary
    #[arg(long)]
    json: bool,
}

/// First and last seed of `FIRST:LAST`, or of a single one.
///
/// # Errors
/// The allowed values.
pub fn seeds(text: &str) -> Result<RangeInclusive<u64>, String> {
    let wrong = || "must be FIRST:LAST, two whole numbers, the first not above the last".to_owned();
    let (first, last) = text.split_once(':').unwrap_or((text, text));
    let (first, last) = (first.parse().map_err(|_| wrong())?, last.parse().map_err(|_| wrong())?);
    if first <= last { Ok(first..=last) } else { Err(wrong()) }
}

/// A seed.
///
/// # Errors
/// The allowed values.
pub fn seed(text: &str) -> Result<u64, String> {
    text.parse()
        .map_err(|_| format!("must be a whole number from 0 to {}", u64::MAX))
}

/// Counts of the runs of one scenario with one set of overrides.
#[derive(Debug, Clone, Default, Serialize)]
struct SummaryGroup {
    runs: u64,
    passed: u64,
    failed: u64,
    stopped: u64,
    not_judged: u64,
    /// The first run that failed or stopped: its seed, and why.
    first_failure: Option<(u64, String)>,
}

/// What `--json` prints.
#[derive(Debug, Serialize)]
struct Summary {
    runs: u64,
    passed: u64,
    failed: u64,
    stopped: u64,
    not_judged: u64,
    simulated_s: f64,
    wall_s: f64,
    threads: usize,
    simulated_s_per_wall_s: f64,
    groups: BTreeMap<String, SummaryGroup>,
}

/// Runs the command.
///
/// # Errors
/// [`CommandError::Input`] on a bad file or flag, [`CommandError::Checks`] when a run fails its checks or stops.
pub fn run(arguments: &Arguments) -> Result<(), CommandError> {
    match &arguments.what {
        What::Run(arguments) => run_campaign(arguments),
        What::Search(arguments) => search(arguments),
        What::Merge(arguments) => merge(arguments),
    }
}

fn input(error: impl std::fmt::Display) -> CommandError {
    CommandError::Input(error.to_string())
}

fn run_campaign(arguments: &RunArguments) -> Result<(), CommandError> {
    let axes = arguments.set.iter().map(|text| Axis::parse(text));
    let campaign = Campaign::new(
        &arguments.scenarios,
        arguments.vehicle.as_deref(),
        arguments.plant_vehicle.as_deref(),
        axes.collect::<Result<_, _>>().map_err(input)?,
        arguments.seeds.clone(),
    )
    .map_err(input)?;
    let range = arguments.shard.unwrap_or(Shard::WHOLE).of(campaign.runs());
    let mut file = arguments
        .out
        .as_deref()
        .map(|path| NewFile::create("--out", path))
        .transpose()?;
    let header = Header {
        campaign: CampaignKind::Scenarios(campaign.identity()),
        range: [range.start, range.end],
    };
    if let Some(file) = &mut file {
        write_line(file, &header)?;
    }
    let pool = threads(arguments.jobs)?;

    let bar = progress_bar((range.end - range.start) as usize, "runs");
    let started = Instant::now();
    let mut groups: BTreeMap<String, SummaryGroup> = BTreeMap::new();
    let mut simulated_s = 0.0;
    // Batches keep the results in order and the memory bounded.
    for batch in batches(range, 64 * pool.current_num_threads() as u64) {
        let results: Result<Vec<RunResult>, _> = pool.install(|| {
            batch
                .into_par_iter()
                .map(|run| {
                    let result = campaign.run(run);
                    bar.inc(1);
                    result
                })
                .collect()
        });
        for result in results.map_err(|error| CommandError::Other(error.to_string()))? {
            if let Some(file) = &mut file {
                write_line(file, &result)?;
            }
            simulated_s += result.simulated_s;
            groups.entry(group_name(&result)).or_default().add(&result);
        }
    }
    let wall_s = started.elapsed().as_secs_f64();
    bar.finish_and_clear();
    let out = file.map(NewFile::finish).transpose()?;

    let total = |of: fn(&SummaryGroup) -> u64| groups.values().map(of).sum::<u64>();
    let summary = Summary {
        runs: total(|group| group.runs),
        passed: total(|group| group.passed),
        failed: total(|group| group.failed),
        stopped: total(|group| group.stopped),
        not_judged: total(|group| group.not_judged),
        simulated_s,
        wall_s,
        threads: pool.current_num_threads(),
        simulated_s_per_wall_s: simulated_s / wall_s,
        groups,
    };
    if arguments.json {
        print_json(&summary)?;
    } else {
        print_coloured(&table(&summary, out.as_deref()))?;
    }
    match summary.failed + summary.stopped {
        0 => Ok(()),
        bad => Err(CommandError::Checks(format!(
            "{bad} of {} runs failed or stopped; `hil-sim drive SCENARIO --seed SEED` repeats a run without overrides",
            summary.runs
        ))),
    }
}

impl SummaryGroup {
    fn add(&mut self, result: &RunResult) {
        self.runs += 1;
        match result.verdict {
            RunVerdict::Passed => self.passed += 1,
            RunVerdict::NotJudged => self.not_judged += 1,
            RunVerdict::Failed => self.failed += 1,
            RunVerdict::Stopped => self.stopped += 1,
        }
        if self.first_failure.is_none() && matches!(result.verdict, RunVerdict::Failed | RunVerdict::Stopped) {
            self.first_failure = Some((result.seed, result.reasons.join("; ")));
        }
    }
}

/// The scenario and the overrides of a run.
fn group_name(result: &RunResult) -> String {
    let set = result.set.iter().map(|(key, value)| format!(" {key}={value}"));
    result.scenario.clone() + &set.collect::<String>()
}

fn table(summary: &Summary, out: Option<&Path>) -> String {
    let mut text = String::new();
    for (name, group) in &summary.groups {
        _ = write!(text, "{:>6} of {:<6} {}", group.passed, group.runs, visible_line(name));
        if group.not_judged > 0 {
            _ = write!(text, "   not judged: {}", group.not_judged);
        }
        if let Some((seed, reasons)) = &group.first_failure {
            _ = write!(
                text,
                "   {}, first with seed {seed}: {}",
                bad("FAILED"),
                visible_line(reasons)
            );
        }
        text.push('\n');
    }
    _ = writeln!(
        text,
        "\n{} runs: {} passed, {} failed, {} stopped, {} not judged\n\
         {:.0} s simulated in {:.1} s on {} threads: {:.0} simulated seconds per second",
        summary.runs,
        summary.passed,
        summary.failed,
        summary.stopped,
        summary.not_judged,
        summary.simulated_s,
        summary.wall_s,
        summary.threads,
        summary.simulated_s_per_wall_s,
    );
    if let Some(out) = out {
        _ = writeln!(text, "results {}", visible_line(&out.display().to_string()));
    }
    text
}
