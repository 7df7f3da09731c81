//! Which of a tick's orders takes effect, and the answer to each.

use std::boxed::Box;
use std::vec::Vec;

use embassy_sync::blocking_mutex::raw::NoopRawMutex;
use embassy_time::Instant;
use model::supervise::codes::{Blocker, BlockerSet};

use super::*;
use crate::protocol::message::LinkCounters;

fn topics() -> Box<Topics<NoopRawMutex>> {
    Box::new(Topics::new())
}

fn id(sequence: u32) -> OrderId {
    OrderId { session: 1, sequence }
}

/// The request of the tick, and every answer after the tick has produced `status`.
fn tick(topics: &Topics<NoopRawMutex>, mode: Mode, status: &Status) -> (Request, Vec<(OrderId, Answer)>) {
    let orders = Orders::take(topics, mode);
    orders.answer(topics, status);
    let next = || topics.answers.try_receive().ok();
    let answers = core::iter::from_fn(next).map(|answered| (answered.id, answered.answer));
    (orders.request(), answers.collect())
}

fn in_mode(mode: Mode) -> Status {
    let mut blockers = BlockerSet::EMPTY;
    blockers.insert(Blocker::NotAtRest);
    Status {
        mode,
        blockers,
        ..Status::default()
    }
}

#[test]
fn a_disarm_comes_first_and_takes_an_arm_with_it() {
    let topics = topics();
    topics.requests.put(Request::Arm, id(1));
    topics.requests.put(Request::ClearFaults, id(2));
    topics.disarm.put(DisarmBy::Host(id(3)));
    let status = in_mode(Mode::Disarmed);
    let (request, answers) = tick(&topics, Mode::Armed, &status);
    assert_eq!(request, Request::Disarm);
    assert_eq!(
        answers,
        [(id(3), Answer::Done), (id(1), Answer::Refused(Refusal::Disarmed)),]
    );
    // The next tick takes the other request, and the tick after that finds none.
    let (request, answers) = tick(&topics, Mode::Disarmed, &status);
    assert_eq!(
        (request, answers),
        (Request::ClearFaults, std::vec![(id(2), Answer::Done)])
    );
    assert_eq!(tick(&topics, Mode::Disarmed, &status), (Request::None, Vec::new()));
}

#[test]
fn the_button_disarms_and_is_told_nothing() {
    let topics = topics();
    topics.disarm.put(DisarmBy::Button);
    let (request, answers) = tick(&topics, Mode::Armed, &in_mode(Mode::Disarmed));
    assert_eq!((request, answers), (Request::Disarm, Vec::new()));
}

#[test]
fn clearing_faults_comes_before_arming_and_only_while_disarmed() {
    for (mode, answer) in [
        (Mode::Disarmed, Answer::Done),
        (Mode::Armed, Answer::Refused(Refusal::NotDisarmed)),
        (Mode::Stopping, Answer::Refused(Refusal::NotDisarmed)),
    ] {
        let topics = topics();
        topics.requests.put(Request::Arm, id(1));
        topics.requests.put(Request::ClearFaults, id(2));
        let (request, answers) = tick(&topics, mode, &in_mode(mode));
        assert_eq!(
            (request, answers),
            (Request::ClearFaults, std::vec![(id(2), answer)]),
            "{mode:?}"
        );
        assert_eq!(tick(&topics, mode, &in_mode(mode)).0, Request::Arm);
    }
}

#[test]
fn an_order_to_arm_is_told_what_became_of_it() {
    for (after, answer) in [
        (Mode::Armed, Answer::Done),
        (Mode::Stopping, Answer::Refused(Refusal::Stopping)),
        (
            Mode::Disarmed,
            Answer::Refused(Refusal::Blocked(in_mode(Mode::Disarmed).blockers)),
        ),
    ] {
        let topics = topics();
        topics.requests.put(Request::Arm, id(1));
        let (request, answers) = tick(&topics, Mode::Disarmed, &in_mode(after));
        assert_eq!((request, answers), (Request::Arm, std::vec![(id(1), answer)]));
    }
}

/// The status counts answers that find no room, and the answer to a Disarm that another Disarm replaces.
#[test]
fn every_answer_that_is_dropped_counts() {
    let topics = topics();
    let room = topics.answers.free_capacity();
    for n in 0..room as u32 + 3 {
        topics.ask_to_disarm(DisarmBy::Host(id(n)));
        Orders::take(&topics, Mode::Disarmed).answer(&topics, &in_mode(Mode::Disarmed));
    }
    assert_eq!(topics.link_counters().dropped_answers, 3);
    // The sum includes the count of the receiving task.
    let link = LinkCounters {
        dropped_answers: 10,
        ..LinkCounters::default()
    };
    topics.link.publish(Instant::MIN, link);
    assert_eq!(topics.link_counters().dropped_answers, 13);
    topics.ask_to_disarm(DisarmBy::Host(id(90)));
    topics.ask_to_disarm(DisarmBy::Host(id(91)));
    assert_eq!(topics.link_counters().dropped_answers, 14);
    topics.ask_to_disarm(DisarmBy::Button);
    topics.ask_to_disarm(DisarmBy::Button);
    assert_eq!(
        topics.link_counters().dropped_answers,
        15,
        "nobody waits for an answer to the button"
    );
}
