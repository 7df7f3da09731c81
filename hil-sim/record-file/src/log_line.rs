//! A line of the board's log, as files of records store it.

use firmware::events::Line;
use virtual_board::words::{event_words, is_trouble};

/// Severity of a line of the log.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum LogLevel {
    /// Normal progress.
    Info,
    /// A problem.
    Warning,
    /// Something failed.
    Error,
}

impl LogLevel {
    /// The level that the firmware's log calls `name`.
    pub fn named(name: &str) -> Self {
        match name {
            "ERROR" => Self::Error,
            "WARN" => Self::Warning,
            _ => Self::Info,
        }
    }
}

/// A line of the board's log.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct LogLine {
    /// Time of the line, us since the board's boot.
    pub time_us: u64,
    /// Severity.
    pub level: LogLevel,
    /// Text of the line.
    pub text: String,
}

impl LogLine {
    /// A line as the link delivers it.
    pub fn of(line: &Line) -> Self {
        Self {
            time_us: line.time_us,
            level: if is_trouble(line.event) {
                LogLevel::Warning
            } else {
                LogLevel::Info
            },
            text: event_words(line.event),
        }
    }

    /// A line as the firmware's own log prints it: time in s since boot, level and text.
    pub fn printed(line: &str) -> Self {
        let (time, rest) = line.trim_start().split_once(' ').unwrap_or(("", line));
        let (level, text) = rest.trim_start().split_once(' ').unwrap_or(("", rest));
        let at_s: f64 = time.parse().unwrap_or(0.0);
        Self {
            time_us: (at_s * 1e6).round() as u64,
            level: LogLevel::named(level),
            text: text.trim_start().to_owned(),
        }
    }
}
