//! `emulated-drive`: hil-sim's `drive` with the release ELF on the emulated board.

use std::cell::Cell;
use std::process::ExitCode;

use board_emulator::backend::EmulatedBackend;
use board_emulator::{Error, Firmware, MS, Settings, Work, build, flight, stored};
use clap::Parser;
use firmware::built_in;
use hil_sim::cli::drive::{self, Arguments};
use report::error::CommandError;

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
            eprintln!("error: {error}");
            ExitCode::from(error.exit_code())
        }
    }
}

fn run(arguments: &Arguments) -> Result<(), CommandError> {
    let given = arguments.firmware.as_deref().map(Firmware::read).transpose();
    let given = given.map_err(|error| input(&error))?;
    let firmware = match &given {
        Some(firmware) => firmware,
        None => build::firmware().map_err(|error| input(&error))?,
    };
    let record = flight::address(firmware).map_err(|error| input(&error))?;
    let (mut work, mut simulated_ms) = (Work::default(), 0);
    let laid = Cell::new(false);
    drive::run_on(
        arguments,
        |vehicle, plant| {
            // The ELF flies the vehicle it was built for, unless its flash holds another. What a given one was
            // built for is not known.
            let contents = if given.is_none() && vehicle.parameters().cast::<f32>() == built_in::PARAMETERS {
                Vec::new()
            } else {
                vec![stored::set(vehicle).map_err(|error| input(&error))?]
            };
            laid.set(!contents.is_empty());
            let mut backend = EmulatedBackend::power_on_with(firmware, plant, Settings::default(), &contents)
                .map_err(|error| other(&error))?;
            let emulation = backend.emulation().map_err(|error| other(&error))?;
            emulation
                .at(move |stopped| stopped.probe(record, flight::WORDS as u64))
                .map_err(|error| other(&error))?;
            Ok(backend)
        },
        |backend| {
            let (words, now);
            (words, work, now) = backend
                .emulation()
                .and_then(|emulation| emulation.at(|stopped| (stopped.take_probe(), stopped.work(), stopped.now())))
                .map_err(|error| other(&error))?;
            simulated_ms = now / MS;
            if laid.get() {
                let log = backend
                    .emulation()
                    .and_then(|emulation| emulation.at(|stopped| stopped.log_bytes()))
                    .and_then(|bytes| firmware.decode(&bytes?))
                    .map_err(|error| other(&error))?;
                stored::was_taken(&log).map_err(|error| input(&error))?;
            }
            let mut records = Vec::new();
            for words in words.chunks(flight::WORDS) {
                let record = flight::decode(words).map_err(|error| other(&error))?;
                // Until the first tick, and where two steps of the plant fall into one tick.
                if record.tick
                    != records
                        .last()
                        .map_or(0, |last: &firmware::drive::FlightRecord| last.tick)
                {
                    records.push(record);
                }
            }
            Ok(records)
        },
    )?;
    if !arguments.json {
        let each_ms = |count: u64| count / simulated_ms.max(1);
        println!(
            "each simulated ms      {} instructions, {} register accesses, {} stops",
            each_ms(work.instructions),
            each_ms(work.accesses),
            each_ms(work.stops)
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
