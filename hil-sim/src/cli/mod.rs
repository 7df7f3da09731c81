//! The command line: one module per subcommand.

use std::process::ExitCode;

use clap::{CommandFactory as _, Parser, Subcommand};
use report::output::tell;
use theory::commands::{
    camera, coupled, critical, envelope, equilibrium, figures, kernel, lqr, simulate, slip_limit, spatial,
};

pub mod bounds;
pub mod bring_up;
pub mod campaign;
pub mod check;
pub mod compare;
pub mod console;
pub mod drive;
pub mod emulated;
pub mod link;
pub mod record_files;
pub mod replay;
pub mod serve;
pub mod shell;

/// The biplanar bicycle, simulated and analysed.
#[derive(Debug, Parser)]
#[command(name = "hil-sim", version, about, after_help = EXAMPLES)]
struct Arguments {
    #[command(subcommand)]
    command: Option<HostCommand>,
}

const EXAMPLES: &str = "\
Without a command, the vehicle drives the slope drive, as `hil-sim drive` does.

Examples:
  hil-sim
  hil-sim drive kerb --out out/kerb
  hil-sim check my-vehicle.toml
  hil-sim serve
  hil-sim link --port tcp:127.0.0.1:5760 status";

/// The subcommand; without a subcommand, `drive` runs the default scenario.
#[derive(Debug, Subcommand)]
enum HostCommand {
    /// The vehicle, simulated, driven by the firmware's own tasks
    Drive(drive::Arguments),
    /// Spread of a scenario's metrics over many seeds, beside its bounds
    Bounds(bounds::Arguments),
    /// The first power-up of a board, step by step: asks, measures over the link, and reports what passed
    BringUp(bring_up::Arguments),
    /// Many runs at once: scenarios, overrides and seeds, on all cores and in shards
    Campaign(campaign::Arguments),
    /// The camera spar alone: tilted, shaken, with a limited motor (ch. 7)
    Camera(camera::Arguments),
    /// The vehicle that carries a camera spar, and its step limits (ch. 8)
    Coupled(coupled::Arguments),
    /// The laws side by side: steps, slopes, kerbs, ice, pushes, vehicles 20 % off, and the best step found
    Compare(compare::Arguments),
    /// What a vehicle file means in SI, and whether such a vehicle can be built and driven
    Check(check::Arguments),
    /// The vehicle in a browser: drives, shows and records a simulated, a served or the real one
    Console(console::Arguments),
    /// The smallest final voltage or reference speed that turns the arm over
    Critical(critical::Arguments),
    /// Critical voltages over the slope, for several waveforms
    Envelope(envelope::Arguments),
    /// The equilibrium on a slope, and its poles
    Equilibrium(equilibrium::Arguments),
    /// The arm's viability kernel, and the share of it that the flown barrier keeps
    Kernel(kernel::Arguments),
    /// Talks to a drive board over its serial port: status, driving, log, faults, records, parameters
    Link(link::Arguments),
    /// Replays a recorded drive, and checks every actuation, bit for bit
    Replay(replay::Arguments),
    /// A simulated board on a port, in real time: any program made for the real board can connect
    Serve(serve::Arguments),
    /// The optimal regulator of the camera spar (ch. 7)
    Lqr(lqr::Arguments),
    /// Writes the completions of a shell to stdout: commands and flags by the tab key
    Completions(shell::CompletionArguments),
    /// Writes the manual page to stdout, or a page for every command into a directory
    Man(shell::ManArguments),
    /// Every figure of the thesis and one page that shows them
    Figures(figures::Arguments),
    /// One run of the planar vehicle
    Simulate(simulate::Arguments),
    /// The largest voltage step that the grip allows
    SlipLimit(slip_limit::Arguments),
    /// The vehicle in space, on a plane inclined two ways (ch. 6)
    Spatial(spatial::Arguments),
}

/// Parses the command line and runs the command: exit code 0 ok, 1 failed checks, 2 bad usage or input.
pub fn main() -> ExitCode {
    let arguments = Arguments::parse();
    let result = match arguments.command {
        Some(HostCommand::Bounds(a)) => bounds::run(&a),
        Some(HostCommand::BringUp(a)) => bring_up::run(&a),
        Some(HostCommand::Campaign(a)) => campaign::run(&a),
        Some(HostCommand::Camera(a)) => camera::run(&a),
        Some(HostCommand::Coupled(a)) => coupled::run(&a),
        Some(HostCommand::Check(a)) => check::run(&a),
        Some(HostCommand::Console(a)) => console::run(&a),
        Some(HostCommand::Compare(a)) => compare::run(&a),
        Some(HostCommand::Completions(a)) => shell::complete(&a, Arguments::command()),
        Some(HostCommand::Man(a)) => shell::man(&a, Arguments::command()),
        Some(HostCommand::Critical(a)) => critical::run(&a),
        Some(HostCommand::Envelope(a)) => envelope::run(&a),
        Some(HostCommand::Equilibrium(a)) => equilibrium::run(&a),
        Some(HostCommand::Drive(a)) => drive::run(&a),
        None => drive::run(&drive::Arguments::default()),
        Some(HostCommand::Kernel(a)) => kernel::run(&a),
        Some(HostCommand::Link(a)) => link::run(&a),
        Some(HostCommand::Replay(a)) => replay::run(&a),
        Some(HostCommand::Serve(a)) => serve::run(&a),
        Some(HostCommand::Lqr(a)) => lqr::run(&a),
        Some(HostCommand::Figures(a)) => figures::run(&a),
        Some(HostCommand::Simulate(a)) => simulate::run(&a),
        Some(HostCommand::SlipLimit(a)) => slip_limit::run(&a),
        Some(HostCommand::Spatial(a)) => spatial::run(&a),
    };
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            tell(&error);
            ExitCode::from(error.exit_code())
        }
    }
}

#[cfg(test)]
mod tests {
    use clap::Command;
    use clap::builder::ValueParser;
    use clap::error::ErrorKind;

    use super::*;

    /// Every command, with the names that lead to it.
    fn commands<'a>(command: &'a Command, names: &str, all: &mut Vec<(String, &'a Command)>) {
        for below in command.get_subcommands().filter(|below| below.get_name() != "help") {
            let names = format!("{names} {}", below.get_name());
            commands(below, &names, all);
            all.push((names, below));
        }
    }

    /// The examples of a command: what its help shows below "Examples:".
    fn examples(command: &Command) -> Vec<String> {
        let help = command.get_after_help().map(ToString::to_string).unwrap_or_default();
        let (_, examples) = help.split_once("Examples:\n").unwrap_or_default();
        examples.lines().map(|line| line.trim().to_owned()).collect()
    }

    #[test]
    fn every_help_has_examples_and_every_example_is_a_command_line() {
        let root = Arguments::command();
        let mut all = vec![("hil-sim".to_owned(), &root)];
        commands(&root, "hil-sim", &mut all);
        assert!(all.len() > 30, "{}", all.len());
        let bare: Vec<&String> = all
            .iter()
            .filter(|(name, command)| {
                !examples(command)
                    .iter()
                    .any(|line| line.contains(name.rsplit(' ').next().unwrap_or_default()))
            })
            .map(|(name, _)| name)
            .collect();
        assert!(bare.is_empty(), "their --help shows no example of them: {bare:?}");
        for (name, command) in all {
            let examples = examples(command);
            for line in examples.iter().flat_map(|line| line.split(" && ")) {
                // A shell removes quotes, and takes a redirection and its file out of the arguments.
                let line = line.split(" > ").next().unwrap_or_default().replace(['\'', '"'], "");
                let parsed = Arguments::command().try_get_matches_from(line.split_whitespace());
                assert!(
                    parsed.is_ok(),
                    "{name}: {line}: {}",
                    parsed.err().map_or(String::new(), |e| e.to_string())
                );
            }
        }
    }

    /// No numeric flag of any command accepts a value that is no number. The test leaves out `link`, which checks its flags and
    /// their ranges before it opens the port.
    #[test]
    fn every_flag_for_a_number_refuses_what_is_none() {
        let root = Arguments::command();
        let mut all = Vec::new();
        commands(&root, "hil-sim", &mut all);
        let number: ValueParser = clap::value_parser!(f64).into();
        let mut tried = 0;
        for (name, command) in all.iter().filter(|(name, _)| !name.contains(" link ")) {
            let flags = command
                .get_arguments()
                .filter(|flag| flag.get_value_parser().type_id() == number.type_id());
            for flag in flags.filter_map(|flag| flag.get_long()) {
                tried += 1;
                for value in [
                    "NaN", "-nan", "inf", "-inf", "1e400", "-1e400", "", "one", "1,5", "0x10",
                ] {
                    let line = name.split(' ').map(str::to_owned).chain([format!("--{flag}={value}")]);
                    let error = Arguments::command().try_get_matches_from(line).expect_err(value);
                    assert_eq!(
                        error.kind(),
                        ErrorKind::ValueValidation,
                        "{name} --{flag}={value}: {error}"
                    );
                }
            }
        }
        assert!(tried > 80, "{tried}");
    }
}
