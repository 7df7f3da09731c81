//! Which messages the link tool accepts as the answer to its question: wires in memory to scripted boards that answer late, answer
//! another question, echo another value or flood the wire, and a wire that loses frames. Time is virtual.

use std::cell::RefCell;
use std::io;
use std::rc::Rc;
use std::sync::Arc;

use firmware::protocol::message::{
    Answer, BoardMessage, Order, OrderId, PROTOCOL_VERSION, ParameterAnswer, ParameterRequest,
};
use hil_sim::cli::link::session::Link;
use hil_sim::cli::link::wire::Wire;
use model::command::Request;
use record_file::writer::{RecordFormat, RecordWriter};

mod support;
#[path = "support/wires.rs"]
mod wires;
use support::Bench;
use wires::{BoardWire, Flood, Scripted, link};

fn value(number: u16, value: f32) -> Answer {
    Answer::Parameters(ParameterAnswer::Value {
        number,
        count: 9,
        value,
        schema: 0,
    })
}

/// The tool names the protocol of an older or a newer board, and sends that board no order.
#[test]
fn a_board_of_another_protocol_is_told() {
    for protocol in [0, PROTOCOL_VERSION - 1, PROTOCOL_VERSION + 1, u16::MAX] {
        let orders = Rc::new(RefCell::new(0));
        let counted = orders.clone();
        let mut board = Scripted::new(move |_, _| {
            *counted.borrow_mut() += 1;
            vec![]
        });
        board.protocol = protocol;
        let (mut link, _) = link(board);
        let told = link.identify().expect_err("another protocol").to_string();
        assert_eq!(
            told,
            format!("the board speaks protocol {protocol}, this tool {PROTOCOL_VERSION}")
        );
        assert_eq!(*orders.borrow(), 0);
    }
}

#[test]
fn a_late_answer_is_not_taken_for_the_next_questions() {
    // The first answer comes after 0.4 s, too late, and every later answer after 0.15 s.
    let mut asked = 0;
    let (mut link, _) = link(Scripted::new(move |id, order| {
        let Order::Parameters(ParameterRequest::Read { number }) = order else {
            return vec![];
        };
        asked += 1;
        let answer = value(number, f32::from(number));
        let after_us = if asked == 1 { 400_000 } else { 150_000 };
        vec![(after_us, BoardMessage::Answer { id, answer })]
    }));
    link.identify().expect("answers");
    let late = link.ask(ParameterRequest::Read { number: 1 }).expect_err("late");
    assert!(late.to_string().contains("did not answer"), "{late}");
    for number in 2..5 {
        let answer = link.ask(ParameterRequest::Read { number }).expect("in time");
        assert!(
            matches!(answer, ParameterAnswer::Value { number: n, value, .. } if n == number && value == f32::from(number)),
            "{answer:?}"
        );
    }
}

#[test]
fn a_write_that_echoes_something_else_stores_nothing() {
    // The board answers the write with another parameter's number, another value, or NaN.
    for (other, echoed) in [(1, 0.05), (0, 0.06), (0, f32::NAN)] {
        let stores = Rc::new(RefCell::new(0));
        let counted = stores.clone();
        let schema = firmware::parameters::schema(&support::reference().parameters().cast());
        let (mut link, _) = link(Scripted::of(schema, move |id, order| {
            let answer = match order {
                Order::Parameters(ParameterRequest::Discard) => Answer::Parameters(ParameterAnswer::Discarded),
                Order::Parameters(ParameterRequest::Write { number, .. }) => value(number + other, echoed),
                Order::Parameters(ParameterRequest::Store) => {
                    *counted.borrow_mut() += 1;
                    Answer::Parameters(ParameterAnswer::Stored)
                }
                _ => return vec![],
            };
            vec![(0, BoardMessage::Answer { id, answer })]
        }));
        link.identify().expect("answers");
        let told = link.set(&["control.ki=0.05".to_owned()]).expect_err("not echoed");
        assert!(told.to_string().contains("echoed another number or value"), "{told}");
        assert_eq!(*stores.borrow(), 0, "{other} {echoed}");
    }
}

#[test]
fn an_answer_of_another_number_is_no_answer() {
    let (mut link, _) = link(Scripted::new(|id, _| {
        let answer = Answer::Done;
        vec![(
            0,
            BoardMessage::Answer {
                id: OrderId {
                    sequence: id.sequence + 1,
                    ..id
                },
                answer,
            },
        )]
    }));
    link.identify().expect("answers");
    let told = link.order(Order::Request(Request::ClearFaults)).expect_err("no answer");
    assert!(told.to_string().contains("did not answer ClearFaults"), "{told}");
}

#[test]
fn the_slowest_store_is_waited_for() {
    let (mut link, _) = link(Scripted::new(|id, _| {
        let answer = Answer::Parameters(ParameterAnswer::Stored);
        vec![(20_000_000, BoardMessage::Answer { id, answer })]
    }));
    link.identify().expect("answers");
    let answer = link.ask(ParameterRequest::Store).expect("in time");
    assert_eq!(answer, ParameterAnswer::Stored);
}

#[test]
fn a_flood_of_nonsense_is_silence() {
    let (mut link, _) = link(Flood { now_us: 0, byte: 1 });
    let told = link.identify().expect_err("nothing readable").to_string();
    assert!(told.contains("no identity"), "{told}");
    assert!(link.disarm().is_err());
}

/// A wire that loses every 20th frame of the tool.
struct LossyWire {
    wire: BoardWire,
    sent: u32,
}

impl Wire for LossyWire {
    fn send(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.sent += 1;
        if self.sent.is_multiple_of(20) {
            return Ok(());
        }
        self.wire.send(bytes)
    }

    fn receive(&mut self, bytes: &mut [u8]) -> io::Result<usize> {
        self.wire.receive(bytes)
    }

    fn now_us(&self) -> u64 {
        self.wire.now_us()
    }
}

/// The look back takes many questions: the tool repeats a question that the wire loses.
#[test]
fn the_look_back_comes_whole_over_a_wire_that_loses() {
    let mut bench = Bench::driving(41, 1.0);
    bench.press_emergency_stop();
    bench.run(1000);
    let wire = LossyWire {
        wire: BoardWire::new(bench),
        sent: 0,
    };
    let mut link = Link::new(wire, 42, Arc::default());
    link.identify().expect("answers");
    let mut file = RecordWriter::new(RecordFormat::Frames, Vec::new());
    let recorded = link.look_back(&mut file).expect("a fault");
    assert!(recorded.lost == 0 && recorded.ticks > 2000, "{recorded:?}");
    assert!(
        recorded.blocks > 40,
        "{recorded:?}: the wire loses fewer than two questions"
    );
}

/// The board keeps recording for 0.2 s after the fault: asked at once, the tool waits for the end of the look back.
#[test]
fn the_look_back_is_there_for_who_asks_as_soon_as_the_fault_is_told() {
    let mut bench = Bench::driving(41, 1.0);
    bench.press_emergency_stop();
    bench.run(30);
    let mut link = Link::new(BoardWire::new(bench), 43, Arc::default());
    link.identify().expect("answers");
    let mut file = RecordWriter::new(RecordFormat::Frames, Vec::new());
    let recorded = link.look_back(&mut file).expect("a fault");
    assert!(recorded.lost == 0 && recorded.ticks > 2000, "{recorded:?}");
    // A vehicle that drives has no look back.
    drop(link);
    let mut link = Link::new(BoardWire::new(Bench::driving(44, 1.0)), 45, Arc::default());
    link.identify().expect("answers");
    let mut file = RecordWriter::new(RecordFormat::Frames, Vec::new());
    let error = link.look_back(&mut file).expect_err("no fault").to_string();
    assert!(error.contains("no fault has occurred"), "{error}");
}
