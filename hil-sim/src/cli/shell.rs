//! `hil-sim completions` and `hil-sim man`: shell completions and manual pages, generated from the commands' own
//! descriptions.

use std::fmt::Write as _;
use std::path::PathBuf;

use clap::builder::PossibleValuesParser;
use clap::{Args, Command};
use clap_complete::Shell;
use report::error::CommandError;
use report::output::{create_directory, print};
use virtual_board::scenario::shipped;

/// The tool's name on the command line.
const TOOL: &str = "hil-sim";

/// The commands that take a scenario, a file or the name of a shipped one, as an argument, and those that take it by a flag.
const TAKE_SCENARIO: [&str; 2] = ["bounds", "drive"];
const FLAG_SCENARIO: [&str; 1] = ["serve"];
/// The name of that argument or flag.
const SCENARIO: &str = "scenario";

/// The function that completes a scenario in zsh.
const ZSH_SCENARIO: &str = "_hil_sim_scenario";

/// Flags of `completions`.
#[derive(Debug, Args)]
#[command(after_help = COMPLETION_EXAMPLES)]
pub struct CompletionArguments {
    /// The shell
    #[arg(value_enum)]
    shell: Shell,
}

/// Flags of `man`.
#[derive(Debug, Args)]
#[command(after_help = MAN_EXAMPLES)]
pub struct ManArguments {
    /// Directory for a page of every command, in place of pages of their names: `man -l DIR/hil-sim-drive.1`
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
}

const COMPLETION_EXAMPLES: &str = "\
Examples:
  hil-sim completions bash > ~/.local/share/bash-completion/completions/hil-sim
  hil-sim completions zsh > ~/.zfunc/_hil-sim
  hil-sim completions fish > ~/.config/fish/completions/hil-sim.fish";

const MAN_EXAMPLES: &str = "\
Examples:
  hil-sim man > hil-sim.1
  hil-sim man --out ~/.local/share/man/man1";

/// Prints the completions of `command`.
///
/// # Errors
/// [`CommandError::Other`]: the output is closed.
pub fn complete(arguments: &CompletionArguments, command: Command) -> Result<(), CommandError> {
    let names: Vec<&'static str> = shipped::names().collect();
    let mut script = Vec::new();
    clap_complete::generate(arguments.shell, &mut with_scenarios(command, &names), TOOL, &mut script);
    let script = String::from_utf8_lossy(&script);
    print(&with_files(arguments.shell, &script, &names))
}

/// The command whose scenarios are these names. It serves the completions only: the tool itself takes files, too.
fn with_scenarios(command: Command, names: &[&'static str]) -> Command {
    let known = || PossibleValuesParser::new(names);
    { TAKE_SCENARIO.iter().chain(&FLAG_SCENARIO) }.fold(command, |command, name| {
        command.mut_subcommand(*name, |below| {
            below.mut_arg(SCENARIO, |scenario| scenario.value_parser(known()))
        })
    })
}

/// The script that offers files as well as these names of scenarios. The generator of zsh and fish offers either names or
/// files, and that of fish leaves arguments without a flag out. Bash turns to files by itself.
fn with_files(shell: Shell, script: &str, names: &[&str]) -> String {
    let list = names.join(" ");
    match shell {
        // The generator names the tool's own function otherwise than where it branches to its commands: with its hyphen, no
        // command of the tool would be completed.
        Shell::Bash => script.replace(&TOOL.replace('-', "__subcmd__"), &TOOL.replace('-', "__")),
        Shell::Zsh => {
            let script = script.replace(&format!(":({list})"), &format!(":{ZSH_SCENARIO}"));
            // The first line says which command the file completes.
            let (first, rest) = script.split_once('\n').unwrap_or((&script, ""));
            format!(
                "{first}\n\n{ZSH_SCENARIO}() {{\n    _alternative \"scenarios:shipped scenario:({list})\" \"files:scenario file:_files\"\n}}\n{rest}"
            )
        }
        Shell::Fish => {
            let values: Vec<String> = names.iter().map(|name| format!("{name}\\t''")).collect();
            let values = values.join("\n");
            let mut script = script.replace(&format!(" -r -f -a \"{values}\""), &format!(" -r -F -a \"{values}\""));
            for command in TAKE_SCENARIO {
                _ = writeln!(
                    script,
                    "complete -c {TOOL} -n \"__fish_hil_sim_using_subcommand {command}\" -a \"{list}\" -d 'Shipped scenario'"
                );
            }
            script
        }
        _ => script.to_owned(),
    }
}

/// Writes the manual of `command`.
///
/// # Errors
/// [`CommandError`]: a page cannot be written.
pub fn man(arguments: &ManArguments, command: Command) -> Result<(), CommandError> {
    if let Some(directory) = &arguments.out {
        create_directory(directory)?;
        return Ok(clap_mangen::generate_to(command, directory)?);
    }
    let mut page = Vec::new();
    clap_mangen::Man::new(command).render(&mut page)?;
    print(&String::from_utf8_lossy(&page))
}
