//! Colour by meaning in a terminal. A pipe, a terminal without colours, and a user who sets `NO_COLOR` get plain text.
//! The text is complete without colour.

use std::fmt::Display;

use console::style;

/// Good: passed, within bounds.
pub fn good(text: impl Display) -> String {
    style(text).green().to_string()
}

/// Bad: failed, a fault, an error.
pub fn bad(text: impl Display) -> String {
    style(text).red().bold().to_string()
}

/// Needs attention: not judged, not shown, a limit, a warning.
pub fn doubtful(text: impl Display) -> String {
    style(text).yellow().to_string()
}

/// As [`bad`], on standard error.
pub fn bad_on_stderr(text: impl Display) -> String {
    style(text).for_stderr().red().bold().to_string()
}
