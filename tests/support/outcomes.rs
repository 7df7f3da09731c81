//! Checks of a run's outcome, for the virtual board and the flashed ELF.

use model::supervise::arming::Mode;
use model::supervise::codes::FaultSet;
use virtual_board::scenario::DriveOutcome;
use virtual_board::scenario::trace::TraceRow;

/// The last row.
pub fn last(outcome: &DriveOutcome) -> &TraceRow {
    outcome.trace.rows.last().expect("rows")
}

/// Nothing if `right`; otherwise a text that says what was found.
pub fn unless<T: core::fmt::Debug>(right: bool, what: &str, found: T) -> Option<String> {
    (!right).then(|| format!("{what}: {found:?}"))
}

/// Nothing if the vehicle is armed without a fault at the end.
pub fn sound(outcome: &DriveOutcome) -> Option<String> {
    let status = &last(outcome).status;
    let sound = (status.mode, status.faults) == (Mode::Armed, FaultSet::EMPTY);
    unless(sound, "not armed and sound", (status.mode, status.faults))
}
