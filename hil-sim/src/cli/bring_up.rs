//! `hil-sim bring-up`: the first power-up of a board, step by step over the link.
#![deny(clippy::print_stdout)] // A closed output is an error, not a panic: all output goes through the console.

use std::io::{self, Write};
use std::path::PathBuf;

use clap::Args;
use report::error::CommandError;
use report::files::write_whole;
use report::output::create_directory;

use super::link::console::Console;
use super::link::session::Link;
use super::link::update::Update;
use super::link::wire::{Port, Wire};
use super::link::{interrupts, nonce};

mod ballast;
mod imus;
mod joint_turn;
mod looks;
pub mod person;
mod powered;
mod powered_steps;
pub mod procedure;
mod restarts;
pub mod step;
pub mod steps;
mod turns;
mod unpowered;
mod unpowered_steps;
pub mod verdict;

use person::{Person, Terminal};
use procedure::{BringUpExtent, Procedure};
use verdict::{BringUpReport, StepVerdict};

const EXAMPLES: &str = "\
Examples:
  hil-sim bring-up --port /dev/ttyACM0 --firmware target/thumbv7em-none-eabihf/release/drive-board --out out/bring-up
  hil-sim bring-up --port tcp:127.0.0.1:5760 --simulated --cold-starts 1";

/// Flags of `bring-up`.
#[derive(Debug, Args)]
#[command(after_help = EXAMPLES)]
pub struct Arguments {
    /// Serial port of the board: /dev/ttyACM0, COM3, ...; or tcp:HOST:PORT or ws://HOST:PORT of a served one
    #[arg(long)]
    port: String,
    /// The board is a simulated one: what only a bench shows is not shown
    #[arg(long)]
    simulated: bool,
    /// Starts of the supply
    #[arg(long, default_value_t = 100, value_parser = clap::value_parser!(u32).range(1..=1000))]
    cold_starts: u32,
    /// Cuts of the supply while the board stores
    #[arg(long, default_value_t = 20, value_parser = clap::value_parser!(u32).range(1..=1000))]
    power_cuts: u32,
    /// The sealed ELF of a firmware to send over the link; without it the step "update" is not shown
    #[arg(long, value_name = "FILE")]
    firmware: Option<PathBuf>,
    /// Write the report into this directory, as text and as JSON
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
}

/// Runs the command.
///
/// # Errors
/// [`CommandError::Input`] for a bad port, [`CommandError::Checks`] when a step fails or is not shown, nobody answers or
/// the user asks to stop, [`CommandError::Other`] when the output is closed.
pub fn run(arguments: &Arguments) -> Result<(), CommandError> {
    let interrupts = interrupts()?;
    let mut reopen = || Ok(Link::new(Port::open(&arguments.port)?, nonce(), interrupts.clone()));
    let mut console = Console(io::stdout());
    let extent = BringUpExtent {
        simulated: arguments.simulated,
        at_a_bench: !arguments.simulated,
        cold_starts: arguments.cold_starts,
        power_cuts: arguments.power_cuts,
        firmware: arguments.firmware.as_deref().map(Update::read).transpose()?,
    };
    let report = carry_out(&mut reopen, Terminal::new(), &mut console, extent)?;
    if let Some(directory) = &arguments.out {
        write(&report, directory)?;
    }
    console.line(&report.summary())?;
    judge(&report)
}

/// Carries out the procedure over the port that `reopen` opens, now and after every loss of the port.
///
/// # Errors
/// As [`Procedure::run`].
pub fn carry_out<W: Wire, O: Write>(
    reopen: &mut dyn FnMut() -> Result<Link<W>, CommandError>,
    person: impl Person,
    console: &mut Console<O>,
    extent: BringUpExtent,
) -> Result<BringUpReport, CommandError> {
    Procedure::new(reopen, person, console, extent)?.run()
}

/// Writes `bring-up.txt` and `bring-up.json` into a directory.
///
/// # Errors
/// [`CommandError::Input`] naming the file.
pub fn write(report: &BringUpReport, directory: &std::path::Path) -> Result<(), CommandError> {
    create_directory(directory)?;
    let json = serde_json::to_string_pretty(report).map_err(|error| CommandError::Other(error.to_string()))?;
    write_whole("--out", &directory.join("bring-up.txt"), report.text().as_bytes())?;
    write_whole("--out", &directory.join("bring-up.json"), json.as_bytes())?;
    Ok(())
}

/// Whether the board is fit to drive the vehicle.
///
/// # Errors
/// [`CommandError::Checks`]: a step failed, or, on a real board, was not shown.
pub fn judge(report: &BringUpReport) -> Result<(), CommandError> {
    let open = |line: &&verdict::StepLine| match line.finding.verdict {
        StepVerdict::Passed | StepVerdict::NotNeeded => false,
        StepVerdict::Failed => true,
        // The board on the bench must show every step that a simulated board did not show.
        StepVerdict::NotShown => !report.simulated,
    };
    match report.steps.iter().find(open) {
        None => Ok(()),
        Some(line) => Err(CommandError::Checks(format!(
            "step {}, {}: {}: {}",
            line.number,
            line.title,
            line.finding.verdict.name(),
            line.finding.seen
        ))),
    }
}
