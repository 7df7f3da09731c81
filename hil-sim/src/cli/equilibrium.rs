//! `hil-sim equilibrium`.

use clap::Args;

use crate::error::CommandError;

/// Flags of `equilibrium`.
#[derive(Debug, Args)]
pub struct Arguments {}

/// Runs the command.
///
/// # Errors
/// [`CommandError::Input`] on bad parameters.
pub fn run(_: &Arguments) -> Result<(), CommandError> {
    Ok(())
}
