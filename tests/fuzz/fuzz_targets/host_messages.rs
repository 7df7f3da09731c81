//! Any payload in a good frame: what decodes as a message of the host encodes to the same message again.
#![no_main]

use firmware::protocol::frame::{Decoder, Received, encode};
use firmware::protocol::message::HostMessage;
use libfuzzer_sys::fuzz_target;

#[path = "framed.rs"]
mod framed;

fuzz_target!(|payload: &[u8]| {
    let mut decoder = Decoder::new();
    for byte in framed::framed(payload) {
        if let Received::Message(message) = decoder.push::<HostMessage>(byte) {
            let frame = encode(&message).expect("what came in a frame fits a frame");
            let again = frame
                .iter()
                .fold(Received::Nothing, |_: Received<HostMessage>, byte| decoder.push(*byte));
            let Received::Message(again) = again else {
                panic!("{again:?}")
            };
            // Compared as text, because NaN equals nothing.
            assert_eq!(format!("{again:?}"), format!("{message:?}"));
        }
    }
});
