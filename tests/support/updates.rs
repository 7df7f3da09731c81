//! Requests of an update over the link to the virtual board.

use firmware::image::Image;
use firmware::protocol::message::{Answer, Order, UPDATE_BYTES, UpdateAnswer, UpdateRefusal, UpdateRequest};
use hil_sim::cli::link::update::Update;

use crate::support::Bench;

/// The image of an ELF, and its bytes.
pub fn image(elf: &[u8]) -> (Image, Vec<u8>) {
    let update = Update::of(elf).expect("sealed");
    (update.image(), update.bytes().to_vec())
}

pub fn ask(bench: &mut Bench, request: UpdateRequest) -> UpdateAnswer {
    match bench.ask(Order::Update(request)) {
        Some(Answer::Update(answer)) => answer,
        other => panic!("{request:?}: {other:?}"),
    }
}

pub fn refused(refusal: UpdateRefusal) -> UpdateAnswer {
    UpdateAnswer::Refused(refusal)
}

/// The piece of an image that begins at `at`.
pub fn piece(bytes: &[u8], at: usize) -> UpdateRequest {
    UpdateRequest::piece(bytes, at as u32).expect("within the image")
}

/// Sends every piece from `from` on.
pub fn send(bench: &mut Bench, bytes: &[u8], from: usize) {
    for at in (from..bytes.len()).step_by(UPDATE_BYTES) {
        let next = (at + UPDATE_BYTES).min(bytes.len()) as u32;
        assert_eq!(ask(bench, piece(bytes, at)), UpdateAnswer::Ready { next });
    }
}
