//! The command line: one module a subcommand.

use std::process::ExitCode;

use clap::{Parser, Subcommand};

pub mod drive;
pub mod equilibrium;
pub mod output;
pub mod planar_arguments;
pub mod values;

/// The biplanar bicycle, simulated and analysed.
#[derive(Debug, Parser)]
#[command(name = "hil-sim", version, about)]
struct Arguments {
    #[command(subcommand)]
    command: Option<Command>,
}

/// What to do; without one, `drive` on the default scenario.
#[derive(Debug, Subcommand)]
enum Command {
    /// The vehicle, simulated, driven by the firmware's own tasks
    Drive(drive::Arguments),
    /// Equilibrium, poles
    Equilibrium(equilibrium::Arguments),
}

/// Parses the command line and runs the command: exit code 0 ok, 1 failed checks, 2 bad usage or input.
pub fn main() -> ExitCode {
    let arguments = Arguments::parse();
    let result = match arguments.command {
        Some(Command::Equilibrium(a)) => equilibrium::run(&a),
        Some(Command::Drive(a)) => drive::run(&a),
        None => drive::run(&drive::Arguments::default()),
    };
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::from(error.exit_code())
        }
    }
}
