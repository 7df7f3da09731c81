//! The bring-up procedure against the virtual board, with a scripted person whose hands act on the simulated vehicle.
//! The step that looks for an error of the board must report the error, before anything is armed.

use std::cell::RefCell;
use std::fmt::Write as _;
use std::path::Path;
use std::rc::Rc;
use std::sync::Arc;
use std::sync::atomic::{AtomicU32, Ordering};

use firmware::protocol::message::{HostMessage, Order};
use hil_sim::cli::bring_up::person::Person;
use hil_sim::cli::bring_up::procedure::BringUpExtent;
use hil_sim::cli::bring_up::step::StepKind;
use hil_sim::cli::bring_up::steps::STEPS;
use hil_sim::cli::bring_up::verdict::{BringUpReport, StepVerdict};
use hil_sim::cli::bring_up::{carry_out, judge, write};
use hil_sim::cli::link::console::Console;
use hil_sim::cli::link::session::Link;
use model::command::Request;
use model::sample::Motor;
use plant::analog::{AnalogFault, Following};
use plant::fault::SensorFault;
use plant::wiring::Leads;
use report::error::CommandError;

#[path = "support/hands.rs"]
mod hands;
mod support;
#[path = "support/wires.rs"]
mod wires;
use hands::{Hands, Otherwise, Script, Shared, act, at_a_bench};
use support::Bench;
use support::generated;
use wires::{BoardWire, messages, ready};

struct Done {
    report: Result<BringUpReport, CommandError>,
    arms: usize,
    console: String,
    last_is_disarm: bool,
    /// The questions, and whether the vehicle was armed before the next question.
    asked: Vec<(String, bool)>,
}

/// The whole procedure on a board that `wrong` has been done to.
fn bring_up(
    wrong: impl FnOnce(&mut Bench, &mut Shared),
    otherwise: Otherwise,
    (simulated, at_a_bench): (bool, bool),
) -> Done {
    let mut bench = ready(31);
    let mut shared = Shared {
        hands: Hands::Nothing,
        looks: 0,
        battery_v: 0.0,
        rolled_m: 0.0,
        welded: false,
        current_gain: [1.0; 2],
        current_offset_a: [0.0; 2],
        waits: false,
        asked: Vec::new(),
    };
    wrong(&mut bench, &mut shared);
    let shared = Rc::new(RefCell::new(shared));
    let mut wire = BoardWire::new(bench);
    let sent = wire.sent.clone();
    let seen = shared.clone();
    wire.world = Box::new(move |bench, _| act(bench, &mut seen.borrow_mut()));
    let mut wire = Some(wire);
    let mut reopen = || {
        let wire = wire
            .take()
            .ok_or_else(|| CommandError::Other("the wire is gone".into()))?;
        Ok(Link::new(wire, 4711, Arc::default()))
    };
    let mut console = Console(Vec::new());
    let extent = BringUpExtent {
        simulated,
        at_a_bench,
        cold_starts: 2,
        power_cuts: 1,
        firmware: None,
    };
    let person = Script {
        shared: shared.clone(),
        looks: 0,
        otherwise,
    };
    let report = carry_out(&mut reopen, person, &mut console, extent);
    let messages = messages(&sent.borrow());
    let is_arm = |message: &&HostMessage| {
        matches!(
            message,
            HostMessage::Order {
                order: Order::Request(Request::Arm),
                ..
            }
        )
    };
    Done {
        report,
        arms: messages.iter().filter(is_arm).count(),
        console: String::from_utf8(console.0).expect("text"),
        last_is_disarm: last_is_disarm(&messages),
        asked: std::mem::take(&mut shared.borrow_mut().asked),
    }
}

/// Whether the last order is a Disarm.
fn last_is_disarm(messages: &[HostMessage]) -> bool {
    let mut orders = messages.iter().rev();
    let last = orders.find(|message| !matches!(message, HostMessage::Identify { .. }));
    matches!(last, Some(HostMessage::Disarm(_)))
}

/// A simulated board, without a bench.
const SIMULATED: (bool, bool) = (true, false);

fn good(_: &str) -> Option<&'static str> {
    None
}

fn verdict(report: &BringUpReport, title: &str) -> StepVerdict {
    let line = report.steps.iter().find(|line| line.title == title).expect(title);
    line.finding.verdict
}

#[test]
fn a_good_board_passes_every_step_that_it_can_show() {
    let done = bring_up(|_, _| {}, good, SIMULATED);
    let report = done.report.expect("carried out");
    for (line, step) in report.steps.iter().zip(STEPS) {
        let expected = if step.bench_only {
            StepVerdict::NotShown
        } else {
            StepVerdict::Passed
        };
        assert_eq!(line.finding.verdict, expected, "{}\n{}", report.text(), done.console);
    }
    assert!(done.last_is_disarm);
    judge(&report).expect("nothing failed");
}

/// A board without the bridges' supply refuses an image as it refuses one on an empty battery.
#[test]
fn an_image_is_sent_once_the_supply_is_on() {
    let at = |title: &str| STEPS.iter().position(|step| step.title == title).expect(title);
    assert!(at("supply on") < at("update") && STEPS[at("update")].powered);
}

/// What is wrong with a board, the step that reports it, and whether that is before anything is armed.
#[test]
fn what_is_wrong_is_told_by_its_step() {
    type Wrong = fn(&mut Bench, &mut Shared);
    let cases: [(&str, bool, Wrong); 8] = [
        ("contacts", true, |_, shared| shared.welded = true),
        ("current zeros", true, |_, shared| shared.current_offset_a = [0.0, 1.0]),
        ("current gain", true, |_, shared| shared.current_gain = [1.0, 0.8]),
        ("current gain", true, |_, shared| shared.current_gain = [-1.0, 1.0]),
        ("arm IMU", true, |bench, _| {
            bench
                .board
                .world(|world| world.plant.arm_imu().sensor_mut().set_fault(SensorFault::WrongSign));
        }),
        ("wheels", true, |bench, _| {
            bench
                .board
                .world(|world| world.plant.encoder_mut(Motor::Left).set_fault(SensorFault::WrongSign));
        }),
        ("supply on", true, |bench, _| {
            let fault = AnalogFault {
                following: Following::Dead,
                ..AnalogFault::default()
            };
            bench
                .board
                .world(|world| world.plant.set_analog_fault("battery_voltage", fault));
        }),
        ("armed", false, |bench, _| {
            bench
                .board
                .world(|world| world.plant.set_leads(Motor::Right as usize, Leads::Open));
        }),
    ];
    for (title, unarmed, wrong) in cases {
        let done = bring_up(wrong, good, SIMULATED);
        let report = done.report.expect("carried out");
        assert_eq!(
            verdict(&report, title),
            StepVerdict::Failed,
            "{title}: {}",
            report.text()
        );
        assert_eq!(report.count(StepVerdict::Failed), 1, "{}", report.text());
        assert_eq!(done.arms == 0, unarmed, "{title}: {} arms", done.arms);
        let look_at = STEPS.iter().find(|step| step.title == title).expect(title).look_at;
        assert!(done.console.contains(look_at), "{}", done.console);
        assert!(judge(&report).expect_err("failed").to_string().contains(title));
        assert!(done.last_is_disarm);
    }
}

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
    assert_eq!(verdict(&report, "reset button"), StepVerdict::NotShown);
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
    assert!(text.contains("reset button: not shown: left out"), "{text}");
}

/// The tool holds the serial port, so a step that needs an armed vehicle must arm the vehicle itself.
#[test]
fn the_tool_arms_for_every_look_at_an_armed_board() {
    let done = bring_up(|_, _| {}, at_a_bench, (true, true));
    let report = done.report.expect("carried out");
    for step in STEPS {
        let StepKind::ArmedLook(look) = step.kind else {
            continue;
        };
        let (_, armed) = done
            .asked
            .iter()
            .find(|(question, _)| question.contains(look.act))
            .unwrap_or_else(|| panic!("{}: not asked\n{}\n{}", step.title, report.text(), done.console));
        assert!(armed, "{}: not armed\n{}", step.title, report.text());
        // The virtual board's only restart is by its supply, as of a board that feeds on the debugger's plug.
        let expected = if step.title == "clock stops" {
            StepVerdict::Failed
        } else {
            StepVerdict::Passed
        };
        assert_eq!(
            verdict(&report, step.title),
            expected,
            "{}\n{}",
            report.text(),
            done.console
        );
    }
    let looks = STEPS.iter().filter(|step| matches!(step.kind, StepKind::ArmedLook(_)));
    assert_eq!(
        looks.count(),
        6,
        "the two at the bridges' lines, and four that end the armed state or drive"
    );
    assert!(done.console.contains("reset by brown-out"), "{}", done.console);
    assert!(done.last_is_disarm);
    for told in STEPS
        .iter()
        .map(|step| step.does)
        .chain(done.asked.iter().map(|(question, _)| question.as_str()))
    {
        assert!(!told.contains("hil-sim link"), "the port is taken: {told}");
    }
}

/// A look at an armed board fails if the person's act does not open the bridges.
#[test]
fn a_board_that_stays_armed_fails_its_look() {
    let otherwise: Otherwise = |question| {
        if question.contains("then ramp") {
            Some("")
        } else {
            at_a_bench(question)
        }
    };
    let done = bring_up(|_, _| {}, otherwise, (true, true));
    let report = done.report.expect("carried out");
    let line = report
        .steps
        .iter()
        .find(|line| line.title == "supply ramped down")
        .expect("a step");
    assert_eq!(line.finding.verdict, StepVerdict::Failed, "{}", report.text());
    assert!(line.finding.seen.contains("still armed"), "{}", line.finding.seen);
    assert!(done.last_is_disarm);
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
        let (mut wire, interrupts) = (Some(wire), interrupts.clone());
        let mut reopen = || {
            let wire = wire
                .take()
                .ok_or_else(|| CommandError::Other("the wire is gone".into()))?;
            Ok(Link::new(wire, 4711, interrupts.clone()))
        };
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

/// The page's table is the tool's.
#[test]
fn the_bring_up_page_has_every_step() {
    let mut text = String::from("| No. | Step | Do | Passes | Fails: look at |\n|---|---|---|---|---|\n");
    for (number, step) in (1..).zip(STEPS) {
        let mark = if step.bench_only { " (b)" } else { "" };
        let _ = writeln!(
            text,
            "| {number} | {}{mark} | {} | {} | {} |",
            step.title, step.does, step.passes, step.look_at
        );
    }
    generated::check("bring-up.md", "steps", &text);
    // Nothing is armed before every step without the bridges' supply is over.
    assert!(STEPS.is_sorted_by_key(|step| step.powered));
}

/// What the emulated board cannot show has a step that shows it, or the reason why none can.
#[test]
fn what_no_emulator_shows_a_step_shows_or_a_reason_stands_there() {
    let page = std::fs::read_to_string(generated::root().join("docs/bring-up.md")).expect("readable");
    let (_, table) = page
        .split_once("| Item | Test | The emulator cannot show | Step |\n")
        .expect("the table");
    let rows: Vec<Vec<&str>> = table
        .lines()
        .skip(1)
        .take_while(|line| line.starts_with('|'))
        .map(|line| line.trim_matches('|').split('|').map(str::trim).collect())
        .collect();
    assert!(rows.len() > 30, "{}", rows.len());
    for row in rows {
        let [item, test, hidden, step] = row[..] else {
            panic!("{row:?}")
        };
        // That each of the commands runs a test, tests/docs.rs sees to.
        assert!(test.contains("`cargo hil-elf "), "{item}: {test}");
        if step.is_empty() {
            assert_eq!(hidden, "", "{item}: no step, and no reason");
        } else if step != "all" && !step.starts_with("none: ") {
            for title in step.split("; ") {
                assert!(STEPS.iter().any(|step| step.title == title), "{item}: no step {title}");
            }
        }
    }
}
