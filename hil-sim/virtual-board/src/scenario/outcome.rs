//! The result of a scenario's run.

use super::trace::Trace;

/// The counts of a run, in addition to its rows.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Counts {
    /// Status frames that the host could not read.
    pub host_unreadable_frames: u64,
    /// Milliseconds in which a bridge was on although the vehicle had not been armed.
    pub unarmed_drive_ms: u64,
    /// Milliseconds from an emergency stop until the bridges are off, if there was an emergency
    /// stop.
    pub emergency_stop_ms: Option<u64>,
}

/// The result of a run.
#[derive(Debug, Default)]
pub struct DriveOutcome {
    /// One row per status that the vehicle sent.
    pub trace: Trace,
    /// The firmware's log.
    pub log: Vec<String>,
    /// The run's counts.
    pub counts: Counts,
}

/// The result of a run whose rows went to a sink.
#[derive(Debug, Default)]
pub struct RunEnd {
    /// The firmware's log.
    pub log: Vec<String>,
    /// The run's counts.
    pub counts: Counts,
}
