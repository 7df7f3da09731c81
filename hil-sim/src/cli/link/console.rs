//! Output of the link tool: one checked writer, so that a closed pipe is an error and not a panic.

use std::io::{ErrorKind, Write};

use report::error::CommandError;
use report::visible::visible_line;

/// A checked writer of lines.
#[derive(Debug)]
pub struct Console<O>(pub O);

impl<O: Write> Console<O> {
    /// Writes one line. Text from a board or a file cannot act on the terminal.
    ///
    /// # Errors
    /// The output is closed or full.
    pub fn line(&mut self, text: &str) -> Result<(), CommandError> {
        self.coloured_line(&visible_line(text))
    }

    /// Writes one line of the tool's own, with colours. Text from a board or a file must have been made visible
    /// before.
    ///
    /// # Errors
    /// The output is closed or full.
    pub fn coloured_line(&mut self, text: &str) -> Result<(), CommandError> {
        writeln!(self.0, "{text}")
            .and_then(|()| self.0.flush())
            .map_err(|error| {
                CommandError::Other(match error.kind() {
                    ErrorKind::BrokenPipe => "standard output: nobody reads it any more".to_owned(),
                    _ => format!("standard output: {error}"),
                })
            })
    }
}
