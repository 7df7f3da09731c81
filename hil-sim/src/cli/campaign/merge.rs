//! `hil-sim campaign merge`: joins the results of shards.

use std::io::{BufRead as _, BufReader, Write as _};
use std::path::{Path, PathBuf};

use clap::Args;
use report::error::CommandError;
use report::files::NewFile;
use report::output::{print, print_coloured};
use serde::Deserialize;
use theory::analysis::law_search::{SearchGroup, SearchTotals};
use virtual_board::scenario::RunVerdict;

use super::results::{CampaignKind, Header, write_line};
use super::search::{results, table};

/// Flags of `campaign merge`.
#[derive(Debug, Args)]
pub(super) struct MergeArguments {
    /// Results of the shards, in any order
    #[arg(required = true, value_name = "FILE")]
    shards: Vec<PathBuf>,
    /// File for the results of the whole campaign; must not exist
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
}

/// A file of results whose first line has been read.
struct ResultsPart {
    name: String,
    header: Header,
    lines: std::io::Lines<BufReader<std::fs::File>>,
}

fn part(path: &Path) -> Result<ResultsPart, CommandError> {
    let name = path.display().to_string();
    let file = vehicle_file::open_file(path).map_err(|error| CommandError::Input(format!("{name}: {error}")))?;
    let mut lines = BufReader::new(file).lines();
    let first = lines
        .next()
        .transpose()
        .map_err(|error| CommandError::Input(format!("{name}: {error}")))?;
    let header = first
        .and_then(|line| serde_json::from_str(&line).ok())
        .ok_or_else(|| CommandError::Input(format!("{name}: no results of a campaign: the first line must tell it")))?;
    Ok(ResultsPart { name, header, lines })
}

/// Joins the results of all shards.
///
/// # Errors
/// [`CommandError::Input`] with the file that is missing, given twice, cut off, or of another campaign;
/// [`CommandError::Checks`] when a run has failed or stopped, or the arm has turned over.
pub(super) fn merge(arguments: &MergeArguments) -> Result<(), CommandError> {
    let mut parts = arguments
        .shards
        .iter()
        .map(|path| part(path))
        .collect::<Result<Vec<_>, _>>()?;
    parts.sort_by_key(|part| part.header.range);
    let Some(campaign) = parts.first().map(|part| part.header.campaign.clone()) else {
        return Err(CommandError::Input("no file to merge".to_owned()));
    };
    let mut next = 0;
    for part in &parts {
        if part.header.campaign != campaign {
            return Err(CommandError::Input(format!(
                "{}: results of another campaign than {}: files, flags, seeds or version differ",
                part.name, parts[0].name
            )));
        }
        let [start, end] = part.header.range;
        if start != next {
            return Err(CommandError::Input(format!(
                "{}: begins with run {start}, but run {next} comes next: a shard is missing or given twice",
                part.name
            )));
        }
        next = end;
    }
    if next != campaign.runs() {
        return Err(CommandError::Input(format!(
            "the last shards are missing: {next} of {} runs are there",
            campaign.runs()
        )));
    }
    let mut file = NewFile::create("--out", &arguments.out)?;
    let runs = campaign.runs();
    let mut bad = 0;
    let mut totals = matches!(campaign, CampaignKind::Search(_)).then(SearchTotals::default);
    write_line(
        &mut file,
        &Header {
            campaign,
            range: [0, runs],
        },
    )?;
    for part in parts {
        let [start, end] = part.header.range;
        let mut count = 0;
        for line in part.lines {
            let line = line.map_err(|error| CommandError::Input(format!("{}: {error}", part.name)))?;
            let told = serde_json::from_str::<RunLine>(&line).ok();
            let Some(told) = told.filter(|told| told.run == start + count) else {
                return Err(CommandError::Input(format!(
                    "{}: line {} must be the result of run {}",
                    part.name,
                    count + 2,
                    start + count
                )));
            };
            bad += u64::from(matches!(told.verdict, Some(RunVerdict::Failed | RunVerdict::Stopped)));
            if let Some(totals) = &mut totals {
                let group = serde_json::from_str::<SearchGroup>(&line)
                    .map_err(|error| CommandError::Input(format!("{}: line {}: {error}", part.name, count + 2)))?;
                totals.add(&group);
            }
            writeln!(file, "{line}")?;
            count += 1;
        }
        if count != end - start {
            return Err(CommandError::Input(format!(
                "{}: {count} of {} results are there: the run did not end",
                part.name,
                end - start
            )));
        }
    }
    let out = file.finish()?;
    let whirls = match totals {
        None => {
            print(&format!("{runs} runs in {}\n", out.display()))?;
            0
        }
        Some(totals) => {
            let totals = totals.finish();
            print_coloured(&(table(&totals) + &results(Some(&out))))?;
            totals.whirls()
        }
    };
    // As the whole campaign in one run would have ended.
    match (bad, whirls) {
        (0, 0) => Ok(()),
        (0, whirls) => Err(CommandError::Checks(format!("the arm turned over in {whirls} drives"))),
        (bad, _) => Err(CommandError::Checks(format!("{bad} of {runs} runs failed or stopped"))),
    }
}

/// The fields of a result's line that a merge reads.
#[derive(Debug, Deserialize)]
struct RunLine {
    run: u64,
    /// A search's groups have none.
    verdict: Option<RunVerdict>,
}
