//! Where the receiving task puts each message, and how it counts it.

use std::boxed::Box;
use std::vec::Vec;

use embassy_sync::blocking_mutex::raw::NoopRawMutex;
use model::command::DriveCommand;

use super::*;
use crate::protocol::message::{CLOCK_TOLERANCE_US, ORDER_AGE_MAX_US, ParameterRequest, Read as ReadOrder};

const ABOUT: About = About {
    version: [1, 2, 3],
    build: 4,
    schema: 5,
    boot: 6,
};
/// The board's time of every message, us.
const NOW_US: u64 = 5_000_000;

fn topics() -> Box<Topics<NoopRawMutex>> {
    Box::new(Topics::new())
}

/// A receiver, and the session that it has accepted or offered.
struct Bench<'a> {
    receiver: Receiver<'a, NoopRawMutex>,
    session: u32,
    sequence: u32,
}

impl<'a> Bench<'a> {
    fn new(topics: &'a Topics<NoopRawMutex>) -> Self {
        let mut bench = Self {
            receiver: Receiver {
                topics,
                about: ABOUT,
                sessions: Sessions::new(ABOUT.boot),
                counters: LinkCounters::default(),
            },
            session: 0,
            sequence: 0,
        };
        bench.hear(HostMessage::Identify { nonce: 11 });
        bench.session = topics.identity.try_take().expect("answered").session;
        bench
    }

    fn hear(&mut self, message: HostMessage) {
        self.receiver
            .take(Received::Message(message), Instant::from_micros(NOW_US));
    }

    /// Gives the session's next order now, and returns its number.
    fn order(&mut self, order: Order) -> OrderId {
        self.order_given_at(NOW_US, order)
    }

    fn order_given_at(&mut self, given_at_us: u64, order: Order) -> OrderId {
        self.sequence += 1;
        let id = OrderId {
            session: self.session,
            sequence: self.sequence,
        };
        self.hear(HostMessage::Order {
            envelope: Envelope { id, given_at_us },
            order,
        });
        id
    }

    fn answers(&self) -> Vec<(OrderId, Answer)> {
        let next = || self.receiver.topics.answers.try_receive().ok();
        core::iter::from_fn(next)
            .map(|answered| (answered.id, answered.answer))
            .collect()
    }
}

#[test]
fn the_board_says_who_it_is_and_offers_a_session() {
    let topics = topics();
    let mut bench = Bench::new(&topics);
    assert_eq!(
        topics.status_rate.take(),
        Some(STATUS_RATE_HZ),
        "a new host does not get the usual rate"
    );
    bench.hear(HostMessage::Identify { nonce: 11 });
    let again = topics.identity.try_take().expect("answered");
    let expected = Identity {
        protocol: PROTOCOL_VERSION,
        nonce: 11,
        session: bench.session,
        sequence: 0,
        time_us: NOW_US,
        about: ABOUT,
    };
    assert_eq!(again, expected, "the same question brings another offer");
    bench.order(Order::StatusRate { hz: 10 });
    topics.status_rate.take();
    bench.hear(HostMessage::Identify { nonce: 11 });
    assert_eq!(topics.identity.try_take().expect("answered").sequence, 1);
    assert_eq!(
        topics.status_rate.take(),
        None,
        "a known host loses the rate that it chose"
    );
}

#[test]
fn whatever_cannot_be_read_is_counted_and_does_nothing() {
    let topics = topics();
    let mut bench = Bench::new(&topics);
    let now = Instant::from_micros(NOW_US);
    bench.receiver.counters = LinkCounters::default();
    for received in [Received::Nothing, Received::Bad, Received::Bad, Received::Overlong] {
        bench.receiver.take(received, now);
    }
    let expected = LinkCounters {
        bad_frames: 2,
        overlong_frames: 1,
        ..LinkCounters::default()
    };
    assert_eq!(bench.receiver.counters, expected);
    assert_eq!(expected.unreadable_frames(), 3);
    let mut counter = u32::MAX;
    count(&mut counter);
    assert_eq!(counter, 0, "the counter does not wrap");
}

#[test]
fn a_disarm_is_taken_from_anybody_and_outdates_what_came_before() {
    let topics = topics();
    let mut bench = Bench::new(&topics);
    let stranger = OrderId {
        session: 99,
        sequence: 1,
    };
    bench.hear(HostMessage::Disarm(stranger));
    assert_eq!(topics.disarm.take(), Some(DisarmBy::Host(stranger)));
    let own = OrderId {
        session: bench.session,
        sequence: 7,
    };
    bench.hear(HostMessage::Disarm(own));
    assert_eq!(topics.disarm.take(), Some(DisarmBy::Host(own)));
    // An Arm that was given before the Disarm, but arrives after it.
    bench.sequence = 6;
    bench.order(Order::Request(Request::Arm));
    assert_eq!(topics.requests.take(Request::Arm), None);
    assert_eq!(bench.receiver.counters.repeated_frames, 1);
    // As an order, too, a Disarm opens the bridges, however late it comes.
    let id = bench.order_given_at(0, Order::Request(Request::Disarm));
    assert_eq!(topics.disarm.take(), Some(DisarmBy::Host(id)));
}

#[test]
fn only_the_session_gives_orders_each_once() {
    let topics = topics();
    let mut bench = Bench::new(&topics);
    let own = bench.session;
    bench.session = own ^ 1;
    let foreign = bench.order(Order::Request(Request::Arm));
    assert_eq!(bench.answers(), [(foreign, Answer::Refused(Refusal::UnknownSession))]);
    bench.session = own;
    let id = bench.order(Order::Request(Request::Arm));
    bench.sequence -= 1;
    assert_eq!(
        bench.order(Order::Request(Request::ClearFaults)),
        id,
        "the number again"
    );
    assert_eq!(topics.requests.take(Request::Arm), Some(id));
    assert_eq!(topics.requests.take(Request::ClearFaults), None);
    let LinkCounters {
        frames,
        foreign_frames,
        repeated_frames,
        ..
    } = bench.receiver.counters;
    assert_eq!((frames, foreign_frames, repeated_frames), (4, 1, 1));
    assert_eq!(bench.answers(), [], "the state machine answers");
}

/// A command's age counts from when it was given. The host's clock may be ahead by up to 10 ms; the board drops a command from
/// further in the future.
#[test]
fn a_drive_command_has_the_time_of_its_giving() {
    for (given_at_us, stamp_us, late) in [
        (NOW_US, Some(NOW_US), 0),
        (NOW_US - ORDER_AGE_MAX_US, Some(NOW_US - ORDER_AGE_MAX_US), 0),
        (NOW_US - ORDER_AGE_MAX_US - 1, Some(NOW_US - ORDER_AGE_MAX_US - 1), 1),
        (NOW_US + CLOCK_TOLERANCE_US, Some(NOW_US), 0),
        (NOW_US + CLOCK_TOLERANCE_US + 1, None, 1),
    ] {
        let topics = topics();
        let mut bench = Bench::new(&topics);
        let command = DriveCommand::driving(1.0, -0.5);
        bench.order_given_at(given_at_us, Order::Drive(command));
        let found = topics.command.latest();
        assert_eq!(found.map(|found| found.at.as_micros()), stamp_us, "{given_at_us}");
        assert!(found.is_none_or(|found| found.value == command));
        assert_eq!(bench.receiver.counters.late_orders, late, "{given_at_us}");
        assert_eq!(bench.receiver.counters.bad_frames, 0);
        assert_eq!(bench.answers(), []);
    }
    for command in [
        DriveCommand::driving(f32::NAN, 0.0),
        DriveCommand::driving(0.0, f32::INFINITY),
    ] {
        let topics = topics();
        let mut bench = Bench::new(&topics);
        bench.order(Order::Drive(command));
        assert!(
            topics.command.latest().is_none(),
            "the board takes a command that is no number"
        );
        assert_eq!(bench.receiver.counters.bad_frames, 1);
    }
}

#[test]
fn a_request_that_is_late_is_refused_and_one_that_waits_is_replaced() {
    let topics = topics();
    let mut bench = Bench::new(&topics);
    let late = bench.order_given_at(NOW_US - ORDER_AGE_MAX_US - 1, Order::Request(Request::Arm));
    assert_eq!(bench.answers(), [(late, Answer::Refused(Refusal::Late))]);
    assert_eq!(topics.requests.take(Request::Arm), None);
    assert_eq!(bench.receiver.counters.dropped_requests, 0);
    bench.order_given_at(NOW_US - ORDER_AGE_MAX_US, Order::Request(Request::Arm));
    let newer = bench.order(Order::Request(Request::Arm));
    assert_eq!(bench.receiver.counters.dropped_requests, 1);
    assert_eq!(topics.requests.take(Request::Arm), Some(newer));
    let none = bench.order(Order::Request(Request::None));
    assert_eq!(bench.answers(), [(none, Answer::Done)]);
}

/// The line carries at most 200 statuses per second.
#[test]
fn the_host_chooses_the_rate_of_the_status_within_what_the_line_carries() {
    let topics = topics();
    let mut bench = Bench::new(&topics);
    topics.status_rate.take();
    for (hz, taken) in [(0, true), (200, true), (201, false), (u16::MAX, false)] {
        let id = bench.order(Order::StatusRate { hz });
        let answer = if taken {
            Answer::Done
        } else {
            Answer::Refused(Refusal::StatusRate { max_hz: 200 })
        };
        assert_eq!(bench.answers(), [(id, answer)], "{hz} Hz");
        assert_eq!(topics.status_rate.take(), taken.then_some(hz));
    }
}

#[test]
fn the_stream_of_records_begins_and_ends_at_the_hosts_word() {
    let topics = topics();
    let mut bench = Bench::new(&topics);
    for from in [Some(7), None] {
        let id = bench.order(Order::Recording { from });
        assert_eq!(bench.answers(), [(id, Answer::Done)]);
        assert_eq!(topics.recording.take(), Some(from));
        // The receiving task wakes the sending task, which looks up where the stream begins.
        assert_eq!(topics.records.ready.signaled(), from.is_some());
        topics.records.ready.reset();
    }
}

/// Up to four questions wait; the board refuses and counts the fifth, about parameters and about the memory.
#[test]
fn a_flood_of_questions_is_refused() {
    let questions = [
        Order::Parameters(ParameterRequest::Read { number: 3 }),
        Order::Read(ReadOrder::Log { from: 0 }),
    ];
    for question in questions {
        let topics = topics();
        let mut bench = Bench::new(&topics);
        for _ in 0..4 {
            bench.order(question);
            assert_eq!(bench.answers(), []);
        }
        let id = bench.order(question);
        assert_eq!(bench.answers(), [(id, Answer::Refused(Refusal::Busy))]);
        assert_eq!(bench.receiver.counters.dropped_requests, 1);
    }
    // Up to eight answers wait; the board counts an answer that finds no room.
    let topics = topics();
    let mut bench = Bench::new(&topics);
    for _ in 0..9 {
        bench.order(Order::Request(Request::None));
    }
    assert_eq!(bench.receiver.counters.dropped_answers, 1);
    assert_eq!(bench.answers().len(), 8);
}
