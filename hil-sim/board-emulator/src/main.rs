//! `emulated-drive`: hil-sim's `drive` with the release ELF on the emulated board.

use std::cell::Cell;
use std::process::ExitCode;

use board_emulator::Error;
use board_emulator::elf::{Firmware, build};
use board_emulator::run::{EmulatedBackend, EmulationSettings, Work};
use board_emulator::time::MS;
use board_emulator::vehicle::stored;
use clap::Parser;
use firmware::built_in;
use hil_sim::cli::drive::{self, Arguments};
use report::error::CommandError;
use report::output::tell;

/// The command line of `hil-sim drive`.
#[derive(Debug, Parser)]
#[command(about = "The vehicle, simulated, driven by the release ELF on an emulated drive board")]
struct CommandLine {
    #[command(flatten)]
    arguments: Arguments,
}

fn main() -> ExitCode {
    match run(&CommandLine::parse().arguments) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            tell(&error);
            ExitCode::from(error.exit_code())
        }
    }
}

fn run(arguments: &Arguments) -> Result<(), CommandError> {
    let given = arguments.firmware.as_deref().map(Firmware::read).transpose();
    let given = given.map_err(|error| input(&error))?;
    let firmware = match &given {
        Some(firmware) => firmware,
        None => build::firmware().map_err(input)?,
    };
    let (mut work, mut simulated_ms) = (Work::default(), 0);
    let stores_vehicle = Cell::new(false);
    drive::run_on(
        arguments,
        |vehicle, plant| {
            // The workspace's ELF flies the vehicle it was built for without stored parameters. Which vehicle a
            // given ELF was built for is not known.
            let built_for = given.is_none() && vehicle.parameters().cast::<f32>() == built_in::PARAMETERS;
            stores_vehicle.set(!built_for);
            let contents = if built_for {
                Vec::new()
            } else {
                vec![stored::set(vehicle).map_err(|error| input(&error))?]
            };
            EmulatedBackend::power_on_with(firmware, plant, EmulationSettings::default(), &contents)
                .map_err(|error| other(&error))
        },
        |backend| {
            let emulation = backend.emulation().map_err(|error| other(&error))?;
            (work, simulated_ms) = emulation
                .at(|stopped| (stopped.work(), stopped.now() / MS))
                .map_err(|error| other(&error))?;
            if stores_vehicle.get() {
                let log = emulation.at(|stopped| stopped.log_bytes());
                let log = log.and_then(|bytes| firmware.decode(&bytes?));
                stored::was_taken(&log.map_err(|error| other(&error))?).map_err(|error| input(&error))?;
            }
            Ok(())
        },
    )?;
    if !arguments.json {
        let per_ms = |count: u64| count / simulated_ms.max(1);
        println!(
            "each simulated ms      {} instructions, {} register accesses, {} stops",
            per_ms(work.instructions),
            per_ms(work.accesses),
            per_ms(work.stops)
        );
    }
    Ok(())
}

fn input(error: &Error) -> CommandError {
    CommandError::Input(error.to_string())
}

fn other(error: &Error) -> CommandError {
    CommandError::Other(error.to_string())
}
