//! Scenarios that tests fly with the reference vehicle.

use firmware::flight_record::FlightRecord;
use model::supervise::codes::{Fault, FaultSet};
use virtual_board::scenario::trace::TraceRow;
use virtual_board::scenario::{self, Backend, DriveOutcome, Scenario, VirtualBackend};

use super::reference;

/// A drive that arms at 2 s: `tables` and `steps` in TOML, the steps as inline tables.
pub fn scenario(seconds: f64, seed: u64, tables: &str, steps: &str) -> Scenario {
    let text = format!(
        "title = \"t\"\nduration_s = {seconds:?}\nseed = {seed}\n{tables}\n\
         step = [{{ at_s = 2.0, action = \"arm\" }}, {steps}]\n"
    );
    Scenario::parse("case.toml", &text).unwrap_or_else(|error| panic!("{error}\n{text}"))
}

/// Runs a scenario with the reference vehicle on the virtual board.
pub fn drive(scenario: &Scenario) -> DriveOutcome {
    let vehicle = reference();
    let plant = scenario.plant(&vehicle).expect("a plant");
    let mut backend = VirtualBackend::boot(&vehicle, plant).expect("boots");
    let outcome = scenario::run(scenario, &mut backend, |_| {}).expect("valid");
    assert!(!backend.board.watchdog_bitten(), "nothing feeds the watchdog");
    outcome
}

/// Every tick of a scenario with the reference vehicle on the virtual board.
pub fn recorded(scenario: &Scenario) -> Vec<FlightRecord> {
    let vehicle = reference();
    let plant = scenario.plant(&vehicle).expect("a plant");
    let mut backend = VirtualBackend::boot(&vehicle, plant).expect("boots");
    backend.keep_records();
    scenario::run(scenario, &mut backend, |_| {}).expect("valid");
    backend.take_records()
}

/// [`drive`] of a [`scenario`].
pub fn fly(seconds: f64, seed: u64, tables: &str, steps: &str) -> DriveOutcome {
    drive(&scenario(seconds, seed, tables, steps))
}

/// The step that commands `speed_m_s` from 4 s on.
pub fn at_speed(speed_m_s: f64) -> String {
    format!("{{ at_s = 4.0, action = \"drive\", speed_m_s = {speed_m_s:?} }}")
}

/// The last row.
pub fn last(outcome: &DriveOutcome) -> &TraceRow {
    outcome.trace.rows.last().expect("rows")
}

/// The time from `from_s` until the first row for which `shows` holds, s.
pub fn first(outcome: &DriveOutcome, from_s: f64, shows: impl Fn(&TraceRow) -> bool) -> Option<f64> {
    let mut rows = outcome.trace.rows.iter().filter(|row| row.time_s() >= from_s);
    rows.find(|row| shows(row)).map(|row| row.time_s() - from_s)
}

/// The set of these faults.
pub fn only(faults: &[Fault]) -> FaultSet {
    let mut set = FaultSet::EMPTY;
    for fault in faults {
        set.insert(*fault);
    }
    set
}
