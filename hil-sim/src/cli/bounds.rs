//! `hil-sim bounds`: compares a scenario's bounds with the values of its metrics over many seeds.

use std::ops::RangeInclusive;
use std::path::PathBuf;

use clap::Args;
use report::error::CommandError;
use report::output::{print, print_coloured, print_json};

use virtual_board::scenario::metrics::{self, MetricKind};

use super::drive::seeds::{Spread, Spreads, spreads, table};
use super::{campaign, drive};

/// Flags of `bounds`.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub struct Arguments {
    /// Scenario file, or the name of a shipped scenario
    scenario: PathBuf,
    /// First and last seed
    #[arg(long, default_value = "1:24", value_parser = campaign::seeds, value_name = "FIRST:LAST")]
    seeds: RangeInclusive<u64>,
    /// Vehicle file; the scenario's, or the reference vehicle, if left out
    #[arg(long, value_name = "FILE")]
    vehicle: Option<PathBuf>,
    /// Print a `[metrics]` table to start from: what was seen, rounded outward. A bound is what a user would
    /// accept, so each line wants a reason of its own
    #[arg(long)]
    suggest: bool,
    /// Print exactly one JSON object on stdout: the spreads
    #[arg(long, conflicts_with = "suggest")]
    json: bool,
}

const EXAMPLES: &str = "\
Examples:
  hil-sim bounds kerb
  hil-sim bounds my-scenario.toml --seeds 1:50 --suggest";

/// Runs the command.
///
/// # Errors
/// [`CommandError::Input`] on a bad file or flag, [`CommandError::Checks`] when a run cannot go on to its end.
pub fn run(arguments: &Arguments) -> Result<(), CommandError> {
    let drive = drive::Arguments {
        scenario: Some(arguments.scenario.clone()),
        vehicle: arguments.vehicle.clone(),
        ..drive::Arguments::default()
    };
    let spreads = spreads(&drive, arguments.seeds.clone())?;
    if arguments.json {
        print_json(&spreads)?;
    } else if arguments.suggest {
        print(&suggestion(&spreads))?;
    } else {
        print_coloured(&table(&spreads))?;
    }
    if spreads.stopped == 0 {
        Ok(())
    } else {
        Err(CommandError::Checks(format!(
            "{} of {} runs could not be simulated to their end",
            spreads.stopped, spreads.runs
        )))
    }
}

/// A `[metrics]` table of the measured values.
fn suggestion(spreads: &Spreads) -> String {
    let mut text = format!(
        "# Seen over seeds {} to {}, rounded outward to two digits. A bound is what a user would accept:\n\
         # replace each with the value that the vehicle must reach, and say why.\n[metrics]\n",
        spreads.seeds[0], spreads.seeds[1]
    );
    for spread in &spreads.metrics {
        text.push_str(&line(spread));
        text.push('\n');
    }
    text
}

/// The line of one metric. Measured numbers are rounded outward, whole numbers are unchanged, and values with names
/// appear by name.
fn line(spread: &Spread) -> String {
    let Spread {
        name,
        least,
        most,
        named,
        ..
    } = spread;
    match (metrics::kind(name), &named[..]) {
        (Some(MetricKind::Measured) | None, _) => {
            format!("{name} = [{:?}, {:?}]", outward(*least, false), outward(*most, true))
        }
        (_, [names]) => format!("{name} = {names:?}"),
        (_, []) => format!("{name} = [{least:?}, {most:?}]"),
        // No bound allows exactly these values: it would also allow values that never occurred.
        (_, several) => {
            let several: Vec<String> = several.iter().map(|names| format!("{names:?}")).collect();
            format!(
                "# {name}: not the same with every seed, so there is no one bound: {}",
                several.join(" or ")
            )
        }
    }
}

/// `value` to two digits, rounded up or down.
fn outward(value: f64, up: bool) -> f64 {
    if value == 0.0 {
        return 0.0;
    }
    let digits = 1 - value.abs().log10().floor() as i32;
    // Powers of ten above 1 are exact; a factor below 1 would not be.
    let (scale, shrink) = (10_f64.powi(digits.max(0)), 10_f64.powi((-digits).max(0)));
    let scaled = value * scale / shrink;
    let rounded = if up { scaled.ceil() } else { scaled.floor() };
    rounded * shrink / scale
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_set_of_faults_is_suggested_by_its_names_and_counts_as_they_are() {
        let of = |name, least, most, named: &[&[&'static str]]| {
            line(&Spread {
                name,
                least,
                median: least,
                most,
                named: named.iter().map(|names| names.to_vec()).collect(),
                bounds: None,
                out_of_bounds: 0,
            })
        };
        assert_eq!(of("armed_s", 10.123, 10.123, &[]), "armed_s = [10.0, 11.0]");
        assert_eq!(
            of("late_ticks", 12_345.0, 12_345.0, &[]),
            "late_ticks = [12345.0, 12345.0]"
        );
        assert_eq!(
            of("faults", 2048.0, 2048.0, &[&["Whirl", "Slip"]]),
            r#"faults = ["Whirl", "Slip"]"#
        );
        assert_eq!(of("faults", 0.0, 0.0, &[&[]]), "faults = []");
        assert_eq!(of("final_mode", 1.0, 1.0, &[&["armed"]]), r#"final_mode = ["armed"]"#);
        let several = of("faults", 0.0, 3.0, &[&[], &["EmergencyStop", "BridgeBreak"]]);
        assert!(
            several.starts_with('#') && several.ends_with(r#"[] or ["EmergencyStop", "BridgeBreak"]"#),
            "{several}"
        );
    }

    #[test]
    fn suggestions_round_outward() {
        for (value, down, up) in [
            (0.123, 0.12, 0.13),
            (-0.123, -0.13, -0.12),
            (98_765.0, 98_000.0, 99_000.0),
            (4.0, 4.0, 4.0),
            (0.0, 0.0, 0.0),
            (0.000_999, 0.000_99, 0.001),
        ] {
            assert_eq!((outward(value, false), outward(value, true)), (down, up), "{value}");
        }
    }
}
