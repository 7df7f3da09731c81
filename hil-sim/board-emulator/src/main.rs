//! `emulated-board`: hil-sim's `drive` and `serve` with the release ELF on the emulated board.

use std::cell::Cell;
use std::path::Path;
use std::process::ExitCode;

use board_emulator::Error;
use board_emulator::elf::{Firmware, build};
use board_emulator::run::{EmulatedBackend, EmulationSettings, Work, takes_stored};
use board_emulator::time::MS;
use board_emulator::vehicle::stored;
use clap::{Parser, Subcommand};
use firmware::built_in;
use hil_sim::cli::{drive, serve};
use model::vehicle::Vehicle;
use plant::Plant;
use report::error::CommandError;
use report::output::tell;
use virtual_board::scenario::Backend as _;

/// The command line of `hil-sim`, as far as an emulated board runs it.
#[derive(Debug, Parser)]
#[command(about = "The release ELF on an emulated drive board, with the simulated vehicle around it")]
struct CommandLine {
    #[command(subcommand)]
    command: BoardCommand,
}

/// What the board is for.
#[derive(Debug, Subcommand)]
enum BoardCommand {
    /// Drives a scenario
    Drive(drive::Arguments),
    /// Is served on ports
    Serve(serve::Arguments),
}

/// Shortest simulated time for which a served board runs without a stop, ms. Starting and stopping the emulator costs
/// as much as half a simulated millisecond.
const SERVED_GO_MS: u64 = 5;
/// Time for which a served board runs before its ports open, us. The emulator translates the firmware on its first run,
/// and the board would seem silent meanwhile. The board's records of this time are kept.
const STARTED_US: u64 = 300_000;

fn main() -> ExitCode {
    let result = match &CommandLine::parse().command {
        BoardCommand::Drive(arguments) => drive(arguments),
        BoardCommand::Serve(arguments) => serve(arguments),
    };
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            tell(&error);
            ExitCode::from(error.exit_code())
        }
    }
}

/// The ELF that runs, and whether the workspace built it.
struct ChosenElf {
    given: Option<Firmware>,
}

impl ChosenElf {
    fn read(path: Option<&Path>) -> Result<Self, CommandError> {
        let given = path.map(Firmware::read).transpose();
        Ok(Self {
            given: given.map_err(|error| input(&error))?,
        })
    }

    fn firmware(&self) -> Result<&Firmware, CommandError> {
        match &self.given {
            Some(firmware) => Ok(firmware),
            None => build::firmware().map_err(input),
        }
    }

    /// Flash contents with which the firmware uses the parameters of `vehicle`. The workspace's own firmware needs none
    /// for the vehicle for which it was built. For which vehicle another ELF was built is not known.
    fn contents(&self, vehicle: &Vehicle<f64>) -> Result<Vec<(u64, Vec<u8>)>, CommandError> {
        if self.given.is_none() && vehicle.parameters().cast::<f32>() == built_in::PARAMETERS {
            return Ok(Vec::new());
        }
        Ok(vec![stored::set(vehicle).map_err(|error| input(&error))?])
    }
}

fn drive(arguments: &drive::Arguments) -> Result<(), CommandError> {
    let elf = ChosenElf::read(arguments.firmware.as_deref())?;
    let firmware = elf.firmware()?;
    let (mut work, mut simulated_ms) = (Work::default(), 0);
    let stores_vehicle = Cell::new(false);
    drive::run_on(
        arguments,
        |vehicle, plant| {
            let contents = elf.contents(vehicle)?;
            stores_vehicle.set(!contents.is_empty());
            power_on(firmware, plant, &contents)
        },
        |backend| {
            let emulation = backend.emulation().map_err(|error| other(&error))?;
            (work, simulated_ms) = emulation
                .at(|stopped| (stopped.work(), stopped.now() / MS))
                .map_err(|error| other(&error))?;
            if stores_vehicle.get() {
                let log = emulation.at(|stopped| stopped.log_bytes(0));
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

fn serve(arguments: &serve::Arguments) -> Result<(), CommandError> {
    let elf = ChosenElf::read(arguments.firmware.as_deref())?;
    let firmware = elf.firmware()?;
    serve::run_on(
        arguments,
        SERVED_GO_MS,
        |vehicle, plant| {
            let contents = elf.contents(vehicle)?;
            if !contents.is_empty() {
                // This check precedes every connection: the firmware must not use another vehicle's parameters than
                // those of the vehicle around it.
                takes_stored(firmware, &contents).map_err(|error| input(&error))?;
            }
            let mut backend = power_on(firmware, plant, &contents)?;
            backend.run_through(&[STARTED_US], &mut |_| {});
            backend.emulation().map_err(|error| other(&error))?;
            Ok(backend)
        },
        |backend| backend.emulation().map(|_| ()).map_err(|error| other(&error)),
    )
}

fn power_on<'a>(
    firmware: &'a Firmware,
    plant: Plant,
    contents: &[(u64, Vec<u8>)],
) -> Result<EmulatedBackend<'a>, CommandError> {
    EmulatedBackend::power_on_with(firmware, plant, EmulationSettings::default(), contents)
        .map_err(|error| other(&error))
}

fn input(error: &Error) -> CommandError {
    CommandError::Input(error.to_string())
}

fn other(error: &Error) -> CommandError {
    CommandError::Other(error.to_string())
}
