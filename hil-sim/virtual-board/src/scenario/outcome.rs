//! The result of a scenario's run.

use super::trace::Trace;

/// The result of a run.
#[derive(Debug, Default)]
pub struct DriveOutcome {
    /// One row for each state the vehicle sent.
    pub trace: Trace,
    /// The firmware's log.
    pub log: Vec<String>,
    /// States that the link could not read.
    pub bad_frames: u64,
    /// Milliseconds in which a bridge was on although the vehicle had not been armed.
    pub unarmed_drive_ms: u64,
    /// Milliseconds from an emergency stop to the bridges being off, if there was one.
    pub emergency_stop_ms: Option<u64>,
}
