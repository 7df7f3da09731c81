//! The bring-up procedure over the link of the emulated board: what it needs of the real protocol, at the real ELF.

use std::sync::Arc;

use hil_sim::cli::bring_up::carry_out;
use hil_sim::cli::bring_up::person::Person;
use hil_sim::cli::bring_up::procedure::BringUpExtent;
use hil_sim::cli::bring_up::verdict::StepVerdict;
use hil_sim::cli::link::console::Console;
use report::error::CommandError;

#[path = "../../../../tests/support/opened_once.rs"]
mod once;
use once::opened_once;

use crate::support::ready;
use crate::wire::EmulatedWire;

/// A person at the emergency stop, whose hands reach nothing else of the emulated vehicle.
struct AtTheStop(EmulatedWire);

impl Person for AtTheStop {
    fn reply(&mut self, question: &str) -> Result<Option<String>, CommandError> {
        let asked = |part: &str| question.contains(part);
        let (first, second) = if asked("Press the emergency stop and hold") {
            (true, true)
        } else if asked("Open the first contact alone") {
            (true, false)
        } else if asked("open the second contact alone") {
            (false, true)
        } else if asked("Release the emergency stop") || asked("Close both contacts") {
            (false, false)
        } else {
            return Ok(Some("s".into()));
        };
        self.0.act(move |board, now| {
            board.set_stop(now, second);
            board.set_stop_contact(now, first);
        });
        Ok(Some(String::new()))
    }
}

/// Every step passes that needs no hands, or hands at the stop alone; the others are not shown, and the vehicle is not
/// armed.
#[test]
fn the_bring_up_procedure_runs_on_the_board() {
    let wire = EmulatedWire::new(ready().emulation);
    let person = AtTheStop(wire.clone());
    let mut reopen = opened_once(wire, 77, Arc::default());
    let extent = BringUpExtent {
        simulated: true,
        at_a_bench: false,
        cold_starts: 1,
        power_cuts: 1,
        firmware: None,
    };
    let mut console = Console(Vec::new());
    let report = carry_out(&mut reopen, person, &mut console, extent).expect("carried out");
    let passed: Vec<&str> = report
        .steps
        .iter()
        .filter(|line| line.finding.verdict == StepVerdict::Passed)
        .map(|line| line.title)
        .collect();
    assert_eq!(
        passed,
        ["identity", "clock", "contacts", "current zeros", "store"],
        "{}",
        report.text()
    );
    assert_eq!(report.count(StepVerdict::Failed), 0, "{}", report.text());
    let told = String::from_utf8(console.0).expect("text");
    assert!(!told.contains("Armed after Enter"), "{told}");
}
