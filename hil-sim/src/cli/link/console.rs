//! Where the link tool's lines go: one writer that is checked, so that a closed pipe is an error and no panic.

use std::io::{ErrorKind, Write};

use report::error::CommandError;
use report::visible::visible_line;

/// A checked writer of lines.
#[derive(Debug)]
pub struct Console<O>(pub O);

impl<O: Write> Console<O> {
    /// Writes one line; what a board or a file says acts on no terminal.
    ///
    /// # Errors
    /// The output is closed or full.
    pub fn line(&mut self, text: &str) -> Result<(), CommandError> {
        self.coloured_line(&visible_line(text))
    }

    /// Writes one line of the tool's own with its colours: what a board or a file says must have been made visible.
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
