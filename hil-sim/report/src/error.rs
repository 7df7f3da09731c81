//! Failures of a command, with their exit codes.

use thiserror::Error;

/// A command's failure, with its exit code.
#[derive(Debug, Error)]
pub enum CommandError {
    /// Bad usage or bad input: the message names the value and what is allowed. Exit code 2.
    #[error("{0}")]
    Input(String),
    /// The command ran and its checks failed. Exit code 1.
    #[error("{0}")]
    Checks(String),
    /// Output could not be written, or an internal invariant did not hold. Exit code 1.
    #[error("{0}")]
    Other(String),
}

impl CommandError {
    /// The process's exit code: 2 for bad input, 1 for anything else.
    pub fn exit_code(&self) -> u8 {
        match self {
            Self::Input(_) => 2,
            Self::Checks(_) | Self::Other(_) => 1,
        }
    }
}

impl From<std::io::Error> for CommandError {
    fn from(error: std::io::Error) -> Self {
        Self::Other(error.to_string())
    }
}
