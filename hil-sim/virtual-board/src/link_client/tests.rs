//! The host's end of the link: sessions, dates of orders, answers.

use super::*;
use firmware::protocol::message::{About, ParameterRequest};
use model::command::Request;

const ABOUT: About = About {
    version: [0, 1, 0],
    build: 1,
    schema: 2,
    boot: 3,
};

fn identity(nonce: u32, time_us: u64) -> Identity {
    Identity {
        protocol: PROTOCOL_VERSION,
        nonce,
        session: 77,
        sequence: 0,
        time_us,
        about: ABOUT,
    }
}

fn hear(client: &mut LinkClient, now_us: u64, message: &BoardMessage) {
    client.receive(now_us, &encode(message).expect("fits"));
}

fn answer(session: u32, sequence: u32, answer: Answer) -> BoardMessage {
    let id = OrderId { session, sequence };
    BoardMessage::Answer { id, answer }
}

/// The time that the next order would carry.
fn given_at(client: &mut LinkClient, now_us: u64) -> u64 {
    let (_, frame) = client.order(now_us, Order::Request(Request::Arm)).expect("identified");
    let mut decoder = Decoder::new();
    for byte in frame {
        if let Received::Message(HostMessage::Order { envelope, .. }) = decoder.push(byte) {
            return envelope.given_at_us;
        }
    }
    panic!("no order")
}

/// Blocks that arrive before the board answers the order to record are an earlier stream's.
#[test]
fn a_stream_begins_behind_the_answer_that_starts_it() {
    let mut client = LinkClient::new(5);
    hear(&mut client, 0, &BoardMessage::Identity(identity(5, 0)));
    let block = |number| {
        BoardMessage::Records(RecordBlock {
            number,
            ..RecordBlock::empty()
        })
    };
    let (sequence, _) = client.order(1, Order::Recording { from: Some(0) }).expect("identified");
    hear(&mut client, 2, &block(7));
    hear(&mut client, 3, &answer(77, sequence, Answer::Done));
    hear(&mut client, 4, &block(0));
    hear(&mut client, 5, &answer(77, sequence + 1, Answer::Done));
    let numbers: Vec<u32> = client.records.iter().map(|block| block.number).collect();
    assert_eq!(numbers, [0]);
}

#[test]
fn every_host_message_fits_a_frame() {
    let id = OrderId {
        session: u32::MAX,
        sequence: u32::MAX,
    };
    let envelope = Envelope {
        id,
        given_at_us: u64::MAX,
    };
    let order = Order::Parameters(ParameterRequest::Write {
        number: u16::MAX,
        value: f32::MAX,
    });
    for message in [
        HostMessage::Identify { nonce: u32::MAX },
        HostMessage::Disarm(id),
        HostMessage::Order { envelope, order },
    ] {
        assert!(bytes(&message).len() < 40);
    }
}

#[test]
fn nothing_is_ordered_before_the_board_has_said_who_it_is() {
    let mut client = LinkClient::new(5);
    assert_eq!(client.order(0, Order::Request(Request::Arm)), None);
    hear(&mut client, 10, &BoardMessage::Identity(identity(6, 1)));
    assert_eq!(
        client.order(20, Order::Request(Request::Arm)),
        None,
        "an answer to another host"
    );
    let mut old = identity(5, 1);
    old.protocol = PROTOCOL_VERSION + 1;
    hear(&mut client, 20, &BoardMessage::Identity(old));
    assert_eq!(client.order(20, Order::Request(Request::Arm)), None, "another protocol");
    assert_eq!(
        client.foreign().map(|identity| identity.protocol),
        Some(PROTOCOL_VERSION + 1)
    );
    hear(&mut client, 30, &BoardMessage::Identity(identity(5, 1)));
    assert!(client.order(40, Order::Request(Request::Arm)).is_some());
}

#[test]
fn an_order_is_dated_by_the_fastest_message_and_never_in_the_future() {
    let mut client = LinkClient::new(5);
    // True offset 1 s; the messages take 40 ms, 5 ms, 90 ms. Two fast messages show the clock's
    // rate.
    for (sent_us, took_us) in (0..6).map(|n| (n * 100_000, [40_000, 5_000, 90_000][n as usize % 3])) {
        hear(
            &mut client,
            sent_us + took_us,
            &BoardMessage::Identity(identity(5, 1_000_000 + sent_us)),
        );
    }
    let at_us = 600_000;
    let dated_us = given_at(&mut client, at_us);
    assert!(dated_us <= 1_000_000 + at_us - 5_000, "{dated_us}");
    assert!(dated_us > 1_000_000 + at_us - 5_100, "{dated_us}");
    // After ten seconds without a message the host must allow for the drift of the clocks.
    let dated_us = given_at(&mut client, at_us + 10_000_000);
    assert!(
        dated_us <= 11_000_000 + at_us - 5_000 - 2_000 && dated_us > 11_000_000 + at_us - 8_000,
        "{dated_us}"
    );
}

#[test]
fn answers_are_matched_to_orders_and_bounded() {
    let mut client = LinkClient::new(5);
    hear(&mut client, 5, &BoardMessage::Identity(identity(5, 1)));
    for sequence in 0..1000 {
        hear(&mut client, 10, &answer(77, sequence, Answer::Done));
        hear(&mut client, 10, &answer(78, sequence + 2000, Answer::Done));
    }
    assert_eq!(client.answers.len(), ANSWERS_MAX);
    assert_eq!(client.answer_to(500), None, "long forgotten");
    assert_eq!(client.answer_to(999), Some(Answer::Done));
    assert_eq!(client.answer_to(999), None, "taken once");
    assert_eq!(client.answer_to(2999), None, "another host's");
}

#[test]
fn a_refused_session_is_forgotten() {
    let mut client = LinkClient::new(5);
    hear(&mut client, 30, &BoardMessage::Identity(identity(5, 1)));
    let refused = Answer::Refused(Refusal::UnknownSession);
    hear(&mut client, 40, &answer(78, 1, refused));
    assert!(client.identity().is_some(), "another host's");
    hear(&mut client, 40, &answer(77, 1, refused));
    assert!(client.identity().is_none());
}
