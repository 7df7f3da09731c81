//! Any bytes on the wire: the decoder never panics, and after a zero byte it reads the next good frame.
#![no_main]

use firmware::protocol::frame::{Decoder, Received, encode};
use firmware::protocol::message::HostMessage;
use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    let mut decoder = Decoder::new();
    for byte in bytes {
        let _: Received<HostMessage> = decoder.push(*byte);
    }
    let _: Received<HostMessage> = decoder.push(0);
    let sent = HostMessage::Identify { nonce: 7 };
    let frame = encode(&sent).expect("fits");
    let last = frame.iter().fold(Received::Nothing, |_, byte| decoder.push(*byte));
    assert_eq!(last, Received::Message(sent));
});
