//! `hil-sim compare`: the laws side by side, on the planar and on the whole vehicle.

use std::fmt::Write as _;
use std::path::PathBuf;

use clap::Args;
use rayon::prelude::*;
use report::error::CommandError;
use report::output::{create_directory, print, print_json, progress_bar, write_file};
use serde::Serialize;

use self::contenders::contenders;
use self::cost::costs;
use self::courses::courses;
use self::flight::{Flight, fly};
use self::planar::{PlanarSteps, steps};
use super::drive::load_vehicle;

mod contenders;
mod cost;
mod courses;
mod flight;
mod planar;
mod tables;

/// Flags of `compare`.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub struct Arguments {
    /// Vehicle file; the reference vehicle if left out
    #[arg(long, value_name = "FILE.toml")]
    vehicle: Option<PathBuf>,
    /// Print exactly one JSON object on stdout
    #[arg(long)]
    json: bool,
    /// Write the page, `index.html`, into this directory
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
}

const EXAMPLES: &str = "\
Examples:
  hil-sim compare
  hil-sim compare --vehicle vehicles/small.toml --out out/compare
  hil-sim compare --json";

/// What `--json` prints.
#[derive(Debug, Serialize)]
struct ComparisonJson {
    planar: PlanarSteps,
    flights: Vec<Flight>,
}

/// Runs the command.
///
/// # Errors
/// [`CommandError::Input`] on a bad file, or a directory that cannot be written; [`CommandError::Other`] for a vehicle on
/// which a law or a course cannot be flown.
pub fn run(arguments: &Arguments) -> Result<(), CommandError> {
    let vehicle = load_vehicle(arguments.vehicle.as_deref())?;
    if let Some(directory) = &arguments.out {
        create_directory(directory)?;
    }
    let laws = contenders(&vehicle).map_err(CommandError::Other)?;
    let courses = courses(&vehicle).map_err(CommandError::Other)?;
    let bar = progress_bar(courses.len() * laws.len() + 1, "comparing");
    let planar = steps(&vehicle, &laws);
    bar.inc(1);
    let pairs: Vec<_> = courses
        .iter()
        .flat_map(|course| laws.iter().map(move |law| (course, law)))
        .collect();
    let flights = pairs
        .par_iter()
        .map(|(course, law)| {
            let flight = fly(course, law);
            bar.inc(1);
            flight
        })
        .collect::<Result<Vec<_>, _>>()
        .map_err(CommandError::Other)?;
    bar.finish_and_clear();
    let comparison = ComparisonJson { planar, flights };
    let page = match &arguments.out {
        Some(directory) => {
            let text = tables::page(&laws, &comparison.planar, &comparison.flights).map_err(CommandError::Other)?;
            Some(write_file(directory, "index.html", &text)?)
        }
        None => None,
    };
    if arguments.json {
        return print_json(&comparison);
    }
    let costs = costs(&courses[0], &laws)?;
    let mut text = tables::text(&laws, &comparison.planar, &comparison.flights);
    text.push_str(&tables::costs(&laws, &costs));
    if let Some(page) = page {
        _ = writeln!(text, "\nwrote {}", page.display());
    }
    print(&text)
}
