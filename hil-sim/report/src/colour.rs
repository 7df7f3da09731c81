//! Colour by meaning in a terminal. A pipe, `NO_COLOR` and a terminal that knows no colours get the plain text; the words
//! say everything without it.

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

/// To be looked at: not judged, not shown, a limit, a warning.
pub fn doubtful(text: impl Display) -> String {
    style(text).yellow().to_string()
}

/// As [`bad`], on standard error.
pub fn bad_on_stderr(text: impl Display) -> String {
    style(text).for_stderr().red().bold().to_string()
}
