//! `hil-sim completions` and `hil-sim man`: shell completions and manual pages, generated from the commands' own
//! descriptions.

use std::path::PathBuf;

use clap::{Args, Command};
use clap_complete::Shell;
use report::error::CommandError;
use report::output::{create_directory, print};

/// The tool's name on the command line.
const TOOL: &str = "hil-sim";

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
pub fn complete(arguments: &CompletionArguments, command: &mut Command) -> Result<(), CommandError> {
    let mut script = Vec::new();
    clap_complete::generate(arguments.shell, command, TOOL, &mut script);
    print(&String::from_utf8_lossy(&script))
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
