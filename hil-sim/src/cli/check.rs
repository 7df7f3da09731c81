//! `hil-sim check`: what a vehicle file means, and whether such a vehicle can be built and driven.

use std::fmt::Write as _;
use std::path::PathBuf;

use clap::Args;
use model::vehicle::SpeedLawChoice;
use report::colour::{bad, doubtful};
use report::error::CommandError;
use report::output::{print_coloured, print_json};
use serde::Serialize;
use theory::analysis::design_check::{DesignCheck, Severity, are_stable, check};

use super::drive::load_vehicle;

/// Flags of `check`.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub struct Arguments {
    /// Vehicle file; the reference vehicle if left out
    vehicle: Option<PathBuf>,
    /// Print exactly one JSON object on stdout
    #[arg(long)]
    json: bool,
}

const EXAMPLES: &str = "\
Examples:
  hil-sim check vehicles/reference.toml
  hil-sim check my-vehicle.toml --json";

/// What `--json` prints.
#[derive(Debug, Serialize)]
struct CheckJson<'a> {
    #[serde(flatten)]
    check: &'a DesignCheck,
    ok: bool,
}

/// Runs the command.
///
/// # Errors
/// [`CommandError::Input`] on a bad file, [`CommandError::Checks`] for a design that cannot be built or driven.
pub fn run(arguments: &Arguments) -> Result<(), CommandError> {
    let vehicle = load_vehicle(arguments.vehicle.as_deref())?;
    let checked = check(&vehicle);
    let errors: Vec<&str> = checked.of(Severity::Error).map(|finding| finding.field).collect();
    if arguments.json {
        print_json(&CheckJson {
            check: &checked,
            ok: errors.is_empty(),
        })?;
    } else {
        print_coloured(&table(&checked, vehicle.speed_law()))?;
    }
    if errors.is_empty() {
        Ok(())
    } else {
        Err(CommandError::Checks(format!(
            "such a vehicle cannot be built or driven: {}",
            errors.join(", ")
        )))
    }
}

/// Poles in words, and whether they are unstable.
fn poles(poles: &[[f64; 2]]) -> String {
    let each: Vec<String> = poles
        .iter()
        .map(|[re, im]| {
            if *im == 0.0 {
                format!("{re:.3}")
            } else {
                format!("{re:.3}{im:+.3}i")
            }
        })
        .collect();
    let stable = if are_stable(poles) {
        String::new()
    } else {
        format!(", {}", bad("unstable"))
    };
    format!("{} 1/s{stable}", each.join(", "))
}

fn table(checked: &DesignCheck, law: SpeedLawChoice) -> String {
    let [of_landing, of_eq_3_25] = [SpeedLawChoice::Landing, SpeedLawChoice::SwingDamped].map(|of| {
        if of == law {
            ""
        } else {
            " that this file's `law` leaves unused"
        }
    });
    let mut text = String::new();
    for number in &checked.numbers {
        let value = if number.value.is_finite() {
            format!("{:.4}", number.value)
        } else {
            "none".to_owned()
        };
        _ = writeln!(text, "{:<32} {value:>12}   {}", number.name, number.meaning);
    }
    let landing = checked.poles_landing_per_s.as_deref();
    let designed: Vec<[f64; 2]> = checked
        .poles_landing_designed_per_s
        .iter()
        .map(|re| [*re, 0.0])
        .collect();
    _ = write!(
        text,
        "\npoles of the landing law{of_landing}, driving on the level: {}\n\
         \x20   designed for, but for filter, tick and delay: {}\n\
         poles of Eq. 3.25 with kp and kd{of_eq_3_25}, on the level: {}\n",
        landing.map_or_else(|| bad("none that are numbers"), poles),
        poles(&designed),
        poles(&checked.poles_eq_3_25_per_s)
    );
    let both = [
        (Severity::Error, bad("error:")),
        (Severity::Warning, doubtful("warning:")),
    ];
    for (severity, name) in both {
        for finding in checked.of(severity) {
            _ = writeln!(text, "\n{name} {}: {}", finding.field, finding.text);
        }
    }
    if checked.findings.is_empty() {
        text.push_str("\nnothing wrong found\n");
    }
    text
}
