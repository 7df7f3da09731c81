//! A payload in a frame whose checksum is right, so that the fuzzer gets past it.

use firmware::protocol::frame::frame;

/// The bytes of the frame; none if the payload is too long.
pub fn framed(payload: &[u8]) -> Vec<u8> {
    frame(payload).map(|frame| frame.to_vec()).unwrap_or_default()
}
