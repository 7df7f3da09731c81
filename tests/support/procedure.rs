//! The whole bring-up procedure on the virtual board, with a scripted person.
#![allow(dead_code)] // Each test binary uses its part.

use std::cell::RefCell;
use std::rc::Rc;
use std::sync::Arc;

use firmware::protocol::message::{HostMessage, Order};
use hil_sim::cli::bring_up::carry_out;
use hil_sim::cli::bring_up::procedure::BringUpExtent;
use hil_sim::cli::bring_up::verdict::{BringUpReport, StepVerdict};
use hil_sim::cli::link::console::Console;
use model::command::Request;
use model::supervise::arming::Mode;
use report::error::CommandError;
use virtual_board::board::hardware::{SecondContact, World};

#[path = "opened_once.rs"]
mod once;
pub use once::opened_once;

use crate::hands::{self, LOOK_US, Otherwise, Script, Shared};
use crate::support::Bench;
use crate::wires::{BoardWire, READ_US, messages, ready};

const _: () = assert!(LOOK_US == READ_US);

/// Puts the stop's contacts so; a welded second one stays closed.
fn put_contacts(world: &mut World, welded: bool, first: bool, second: bool) {
    let second_contact = match (first, second) {
        _ if welded => SecondContact::Welded,
        (true, true) | (false, false) => SecondContact::Follows,
        (true, false) => SecondContact::Welded,
        (false, true) => SecondContact::Open,
    };
    world.set_stop(first, second_contact);
}

/// Lets the hands act on the bench.
fn act(bench: &mut Bench, shared: &mut Shared) {
    let armed = bench.board.status().is_some_and(|status| status.mode == Mode::Armed);
    let deeds = bench.board.world(|world| hands::act(&mut world.plant, shared, armed));
    if let Some((first, second)) = deeds.contacts {
        let welded = shared.welded;
        bench.board.world(|world| put_contacts(world, welded, first, second));
    }
    if deeds.button == Some(true) {
        bench.board.press_button();
    }
    if let Some(cause) = deeds.reset {
        bench.board.reset(cause).expect("boots again");
    }
}

/// What the procedure left behind.
pub struct Done {
    pub report: Result<BringUpReport, CommandError>,
    pub arms: usize,
    pub console: String,
    pub last_is_disarm: bool,
    /// The questions, and whether the vehicle was armed before the next question.
    pub asked: Vec<(String, bool)>,
}

/// The whole procedure on a board that `wrong` has been done to.
pub fn bring_up(wrong: impl FnOnce(&mut Bench, &mut Shared), otherwise: Otherwise, extent: (bool, bool)) -> Done {
    bring_up_on(ready(31), wrong, otherwise, extent)
}

/// The whole procedure on the board of a bench.
pub fn bring_up_on(
    mut bench: Bench,
    wrong: impl FnOnce(&mut Bench, &mut Shared),
    otherwise: Otherwise,
    (simulated, at_a_bench): (bool, bool),
) -> Done {
    let mut shared = Shared::default();
    wrong(&mut bench, &mut shared);
    let shared = Rc::new(RefCell::new(shared));
    let mut wire = BoardWire::new(bench);
    let sent = wire.sent.clone();
    let seen = shared.clone();
    wire.world = Box::new(move |bench, _| act(bench, &mut seen.borrow_mut()));
    let mut reopen = opened_once(wire, 4711, Arc::default());
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
pub fn last_is_disarm(messages: &[HostMessage]) -> bool {
    let mut orders = messages.iter().rev();
    let last = orders.find(|message| !matches!(message, HostMessage::Identify { .. }));
    matches!(last, Some(HostMessage::Disarm(_)))
}

/// A simulated board, without a bench.
pub const SIMULATED: (bool, bool) = (true, false);

pub fn good(_: &str) -> Option<&'static str> {
    None
}

pub fn verdict(report: &BringUpReport, title: &str) -> StepVerdict {
    let line = report.steps.iter().find(|line| line.title == title).expect(title);
    line.finding.verdict
}
