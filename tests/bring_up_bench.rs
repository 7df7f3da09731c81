//! The bring-up procedure with somebody at a bench: looks at an armed board, steps left out, persons who leave.

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicU32, Ordering};

use hil_sim::cli::bring_up::person::Person;
use hil_sim::cli::bring_up::procedure::BringUpExtent;
use hil_sim::cli::bring_up::step::StepKind;
use hil_sim::cli::bring_up::steps::STEPS;
use hil_sim::cli::bring_up::verdict::StepVerdict;
use hil_sim::cli::bring_up::{carry_out, judge, write};
use hil_sim::cli::link::console::Console;
use report::error::CommandError;

#[path = "support/hands.rs"]
mod hands;
#[path = "support/procedure.rs"]
mod procedure;
mod support;
#[path = "support/wires.rs"]
mod wires;
use hands::{Otherwise, at_a_bench};
use procedure::{bring_up, last_is_disarm, opened_once, verdict};
use wires::{BoardWire, messages, ready};

/// On a board that is not simulated, a step that was left out counts as *not shown* and blocks arming. The test cuts
/// the supply while the board stores.
#[test]
fn a_step_left_out_keeps_a_board_from_being_armed() {
    let otherwise: Otherwise = |question| match question {
        question if question.contains("PE9") => Some("s"),
        question => at_a_bench(question),
    };
    let done = bring_up(|_, _| {}, otherwise, (false, true));
    let report = done.report.expect("carried out");
    assert_eq!(verdict(&report, "3.3 V"), StepVerdict::Passed, "{}", report.text());
    assert_eq!(verdict(&report, "power cuts"), StepVerdict::Passed, "{}", report.text());
    assert_eq!(
        verdict(&report, "reset button"),
        StepVerdict::Passed,
        "{}",
        report.text()
    );
    assert_eq!(verdict(&report, "supply off"), StepVerdict::NotShown);
    assert_eq!(report.count(StepVerdict::Failed), 0, "{}", report.text());
    for (line, _) in report.steps.iter().zip(STEPS).filter(|(_, step)| step.powered) {
        assert_eq!(line.finding.verdict, StepVerdict::NotShown, "{}", line.title);
    }
    assert_eq!(done.arms, 0);
    assert!(judge(&report).is_err());
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("bring-up");
    write(&report, &folder).expect("written");
    let json = std::fs::read_to_string(folder.join("bring-up.json")).expect("readable");
    let json: serde_json::Value = serde_json::from_str(&json).expect("JSON");
    assert_eq!(json["steps"][1]["verdict"], "passed");
    let text = std::fs::read_to_string(folder.join("bring-up.txt")).expect("readable");
    assert!(text.contains("supply off: not shown: left out"), "{text}");
}

/// The tool holds the serial port, so a step that needs an armed vehicle must arm the vehicle itself.
#[test]
fn the_tool_arms_for_every_look_at_an_armed_board() {
    let done = bring_up(|_, _| {}, at_a_bench, (true, true));
    let report = done.report.expect("carried out");
    let told = format!("{}\n{}", report.text(), done.console);
    let mut looks = Vec::new();
    for step in STEPS {
        let StepKind::ArmedLook(look) = step.kind else {
            continue;
        };
        looks.push(step.title);
        let mut asked = done.asked.iter();
        let found = asked.find(|(question, _)| question.contains(look.act));
        assert!(
            found.is_some_and(|(_, armed)| *armed),
            "{}: not armed\n{told}",
            step.title
        );
        assert_eq!(verdict(&report, step.title), StepVerdict::Passed, "{told}");
    }
    for title in [
        "currents in step",
        "supply ramped down",
        "halted core",
        "watchdog",
        "clock stops",
    ] {
        assert!(looks.contains(&title), "{title} is not in {looks:?}");
    }
    for cause in ["brown-out", "watchdog", "software"] {
        assert!(told.contains(&format!("reset by {cause}")), "{told}");
    }
    assert!(done.last_is_disarm);
    for told in STEPS
        .iter()
        .map(|step| step.does)
        .chain(done.asked.iter().map(|(question, _)| question.as_str()))
    {
        assert!(!told.contains("hil-sim link"), "the port is taken: {told}");
    }
}

/// A look at an armed board fails if the person's act does not open the bridges, and if the board starts again by
/// another cause than the step's.
#[test]
fn a_board_that_stays_armed_or_starts_by_another_cause_fails_its_look() {
    let unmoved: [(&str, Otherwise, bool, &str); 3] = [
        ("supply ramped down", ramps_nothing, false, "still armed"),
        ("watchdog", halts_nothing, false, "still armed"),
        ("clock stops", at_a_bench, true, "reset by brown-out"),
    ];
    for (title, otherwise, plug_is_supply, seen) in unmoved {
        let done = bring_up(
            |_, shared| shared.plug_is_supply = plug_is_supply,
            otherwise,
            (true, true),
        );
        let report = done.report.expect("carried out");
        let line = report.steps.iter().find(|line| line.title == title).expect("a step");
        assert_eq!(line.finding.verdict, StepVerdict::Failed, "{}", report.text());
        assert!(line.finding.seen.contains(seen), "{}", line.finding.seen);
        assert!(done.last_is_disarm);
    }
}

/// A person at the bench whose ramp does not reach the board.
fn ramps_nothing(question: &str) -> Option<&'static str> {
    if question.contains("then ramp") {
        return Some("");
    }
    at_a_bench(question)
}

/// A person at the bench whose debugger does not halt the core.
fn halts_nothing(question: &str) -> Option<&'static str> {
    if question.contains("has cleared bit 18") {
        return Some("");
    }
    at_a_bench(question)
}

/// Nobody answers: the procedure ends with a Disarm, as it does for a user who asks to stop.
#[test]
fn a_person_who_leaves_ends_it_with_a_disarm() {
    struct Gone;
    impl Person for Gone {
        fn reply(&mut self, question: &str) -> Result<Option<String>, CommandError> {
            Err(CommandError::Checks(format!("nobody answers: {question}")))
        }
    }
    struct Stops(Arc<AtomicU32>);
    impl Person for Stops {
        fn reply(&mut self, _: &str) -> Result<Option<String>, CommandError> {
            self.0.fetch_add(1, Ordering::Relaxed);
            Ok(None)
        }
    }
    let interrupts = Arc::new(AtomicU32::new(0));
    let persons: [(&str, Box<dyn Person>); 2] = [
        ("nobody answers", Box::new(Gone)),
        ("interrupted", Box::new(Stops(interrupts.clone()))),
    ];
    for (expected, person) in persons {
        let wire = BoardWire::new(ready(32));
        let sent = wire.sent.clone();
        let mut reopen = opened_once(wire, 4711, interrupts.clone());
        let extent = BringUpExtent {
            simulated: true,
            at_a_bench: false,
            cold_starts: 1,
            power_cuts: 1,
            firmware: None,
        };
        let mut console = Console(Vec::new());
        let told = carry_out(&mut reopen, person, &mut console, extent).expect_err("ended");
        assert!(told.to_string().contains(expected), "{told}");
        let sent = messages(&sent.borrow());
        assert!(last_is_disarm(&sent), "{sent:?}");
    }
}
