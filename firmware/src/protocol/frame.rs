//! Frames: `COBS(postcard(message) ++ CRC-16) ++ 0`.

use core::ffi::CStr;

use crc::{CRC_16_IBM_3740, Crc, Table};
use serde::Serialize;
use serde::de::DeserializeOwned;

use super::stuffing::{stuff, unstuff};

/// Longest frame on the wire, final zero included.
pub const FRAME_MAX: usize = 512;
/// Longest encoded message with its checksum: a frame less its zero and the bytes that COBS adds, one per started 254
/// bytes.
const PAYLOAD_MAX: usize = FRAME_MAX - 1 - FRAME_MAX.div_ceil(255);
/// Bytes that the checksum processes at once. On the board this is one, because each further byte needs 512 bytes of
/// flash.
const CHECKSUM_BYTES: usize = if cfg!(target_os = "none") { 1 } else { 16 };
static FRAME_CHECKSUM: Crc<u16, Table<CHECKSUM_BYTES>> = Crc::<u16, Table<CHECKSUM_BYTES>>::new(&CRC_16_IBM_3740);
const CHECKSUM_LEN: usize = 2;

/// A frame ready for the wire.
pub type Frame = heapless::Vec<u8, FRAME_MAX>;

/// The message does not fit a frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct TooLong;

/// Encodes a message.
///
/// # Errors
/// [`TooLong`] if the message does not fit.
pub fn encode(message: &impl Serialize) -> Result<Frame, TooLong> {
    framed(|room| Some(postcard::to_slice(message, room).ok()?.len()))
}

/// Wraps the bytes of a message in a frame.
///
/// # Errors
/// [`TooLong`] if the bytes do not fit.
pub fn frame(message: &[u8]) -> Result<Frame, TooLong> {
    framed(|room| {
        room.get_mut(..message.len())?.copy_from_slice(message);
        Some(message.len())
    })
}

/// The frame of the message that `write` writes into the given buffer; `write` returns the message's length.
fn framed(write: impl FnOnce(&mut [u8]) -> Option<usize>) -> Result<Frame, TooLong> {
    let mut frame = Frame::from_array([0; FRAME_MAX]);
    let length = fill(&mut frame, write).ok_or(TooLong)?;
    frame.truncate(length);
    Ok(frame)
}

/// Fills `wire` with a frame, as [`framed`]; returns the frame's length.
fn fill(wire: &mut [u8], write: impl FnOnce(&mut [u8]) -> Option<usize>) -> Option<usize> {
    // The byte before the message is the stuffing's.
    let payload = wire.get_mut(1..=PAYLOAD_MAX)?;
    let length = write(payload.get_mut(..PAYLOAD_MAX - CHECKSUM_LEN)?)?;
    let (message, rest) = payload.split_at_mut_checked(length)?;
    let checksum = FRAME_CHECKSUM.checksum(message).to_le_bytes();
    *rest.first_chunk_mut()? = checksum;
    let end = stuff(wire, length + CHECKSUM_LEN)?;
    *wire.get_mut(end)? = 0;
    Some(end + 1)
}

/// The result of a byte.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Received<T> {
    /// Nothing yet.
    Nothing,
    /// A good message.
    Message(T),
    /// A frame with wrong stuffing, checksum or content.
    Bad,
    /// A frame longer than any message; its rest is skipped.
    Overlong,
}

/// Puts frames together from a stream of bytes.
#[derive(Debug, Clone)]
pub struct Decoder {
    buffer: heapless::Vec<u8, FRAME_MAX>,
    skipping: bool,
}

impl Decoder {
    /// Waits for the first frame.
    pub const fn new() -> Self {
        Self {
            buffer: heapless::Vec::new(),
            skipping: false,
        }
    }

    /// Discards a partial frame, because the bytes after a gap in the stream are not its rest.
    pub fn resync(&mut self) {
        self.buffer.clear();
        self.skipping = true;
    }

    /// Processes one byte.
    ///
    /// ```
    /// use firmware::protocol::frame::{Decoder, Received, encode};
    /// use firmware::protocol::message::HostMessage;
    /// let sent = HostMessage::Identify { nonce: 7 };
    /// let mut decoder = Decoder::new();
    /// let received = encode(&sent).unwrap().iter().fold(Received::Nothing, |_, byte| decoder.push(*byte));
    /// assert_eq!(received, Received::Message(sent));
    /// ```
    pub fn push<T: DeserializeOwned>(&mut self, byte: u8) -> Received<T> {
        if byte == 0 { self.finish() } else { self.begin(&[byte]) }
    }

    /// Processes bytes up to the first byte that completes a frame, and returns the result; the rest stays in `bytes`.
    /// Returns `None` once every byte has been processed.
    ///
    /// ```
    /// use firmware::protocol::frame::{Decoder, Received, encode};
    /// use firmware::protocol::message::HostMessage;
    /// let sent = HostMessage::Identify { nonce: 7 };
    /// let frame = encode(&sent).unwrap();
    /// let bytes = [&frame[..], &frame[..], &[1, 2, 0]].concat();
    /// let (mut decoder, rest) = (Decoder::new(), &mut &bytes[..]);
    /// assert_eq!(decoder.next_of(rest), Some(Received::Message(sent)));
    /// assert_eq!(decoder.next_of(rest), Some(Received::Message(sent)));
    /// assert_eq!(decoder.next_of::<HostMessage>(rest), Some(Received::Bad));
    /// assert_eq!(decoder.next_of::<HostMessage>(rest), None);
    /// ```
    pub fn next_of<T: DeserializeOwned>(&mut self, bytes: &mut &[u8]) -> Option<Received<T>> {
        loop {
            if bytes.is_empty() {
                return None;
            }
            // A C string also ends with a zero, and its search processes whole words.
            let part = CStr::from_bytes_until_nul(bytes).map_or(*bytes, CStr::to_bytes_with_nul);
            *bytes = bytes.get(part.len()..).unwrap_or_default();
            let (begun, finished) = match part {
                [begun @ .., 0] => (begun, true),
                begun => (begun, false),
            };
            let begun = self.begin(begun);
            let completed = if finished { self.finish() } else { Received::Nothing };
            match (begun, completed) {
                (Received::Nothing, Received::Nothing) => {}
                // For a frame that is too long the receiver reports nothing else.
                (Received::Nothing, received) | (received, _) => return Some(received),
            }
        }
    }

    /// Processes bytes within a frame.
    fn begin<T>(&mut self, bytes: &[u8]) -> Received<T> {
        if !self.skipping && self.buffer.extend_from_slice(bytes).is_err() {
            self.buffer.clear();
            self.skipping = true;
            return Received::Overlong;
        }
        Received::Nothing
    }

    /// Ends the frame.
    fn finish<T: DeserializeOwned>(&mut self) -> Received<T> {
        let skipped = core::mem::take(&mut self.skipping);
        let received = if skipped || self.buffer.is_empty() {
            Received::Nothing
        } else {
            decode(&mut self.buffer).map_or(Received::Bad, Received::Message)
        };
        self.buffer.clear();
        received
    }
}

impl Default for Decoder {
    fn default() -> Self {
        Self::new()
    }
}

/// The message of one frame (without its final zero), if it is good: right stuffing, right checksum,
/// and nothing left over.
fn decode<T: DeserializeOwned>(frame: &mut [u8]) -> Option<T> {
    let payload = unstuff(frame)?;
    let (message, checksum) = payload.split_at_checked(payload.len().checked_sub(CHECKSUM_LEN)?)?;
    if FRAME_CHECKSUM.checksum(message).to_le_bytes() != checksum {
        return None;
    }
    match postcard::take_from_bytes(message) {
        Ok((message, [])) => Some(message),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use model::command::DriveCommand;
    use proptest::prelude::*;

    use super::*;
    use crate::protocol::message::{Envelope, HostMessage, Order, OrderId};

    const IDENTIFY: HostMessage = HostMessage::Identify { nonce: 7 };

    fn feed(decoder: &mut Decoder, bytes: &[u8]) -> std::vec::Vec<Received<HostMessage>> {
        bytes
            .iter()
            .map(|byte| decoder.push(*byte))
            .filter(|r| *r != Received::Nothing)
            .collect()
    }

    #[test]
    fn a_frame_after_an_overlong_one_is_read() {
        let mut decoder = Decoder::new();
        assert_eq!(feed(&mut decoder, &[1; 1000]), [Received::Overlong]);
        assert_eq!(feed(&mut decoder, &[0]), []);
        let frame = encode(&IDENTIFY).expect("fits");
        assert_eq!(feed(&mut decoder, &frame), [Received::Message(IDENTIFY)]);
    }

    /// The largest message fits whatever its bytes are. One byte more is refused, also where zeros would leave room for it.
    #[test]
    fn the_largest_message_fits_whatever_its_bytes_are() {
        const LARGEST: usize = 506;
        for byte in [0, 7] {
            assert!(frame(&[byte; LARGEST]).is_ok(), "{byte}");
            assert_eq!(frame(&[byte; LARGEST + 1]), Err(TooLong), "{byte}");
        }
    }

    #[test]
    fn a_resync_drops_only_the_frame_that_was_cut() {
        let frame = encode(&IDENTIFY).expect("fits");
        let mut decoder = Decoder::new();
        feed(&mut decoder, &frame[..2]);
        decoder.resync();
        assert_eq!(feed(&mut decoder, &frame[2..]), []);
        assert_eq!(feed(&mut decoder, &frame), [Received::Message(IDENTIFY)]);
    }

    proptest! {
        /// One flipped bit anywhere never gives another message.
        #[test]
        fn a_flipped_bit_is_found(speed in -3.0_f32..3.0, yaw in -3.0_f32..3.0, bit in 0_usize..1000) {
            let sent = HostMessage::Order {
                envelope: Envelope {
                    id: OrderId { session: 0x1234_5678, sequence: 300 },
                    given_at_us: 1_234_567,
                },
                order: Order::Drive(DriveCommand::driving(speed, yaw)),
            };
            let mut frame = encode(&sent).expect("fits");
            let bit = bit % (8 * frame.len());
            frame[bit / 8] ^= 1 << (bit % 8);
            let mut decoder = Decoder::new();
            let mut received = feed(&mut decoder, &frame);
            received.extend(feed(&mut decoder, &[0]));
            prop_assert!(received.iter().all(|r| !matches!(r, Received::Message(_))), "{:?}", received);
        }

        /// Noise never panics, and a good frame after it (and a zero) is always read.
        #[test]
        fn noise_is_survived(noise in proptest::collection::vec(any::<u8>(), 0..2000)) {
            let mut decoder = Decoder::new();
            feed(&mut decoder, &noise);
            feed(&mut decoder, &[0]);
            let frame = encode(&IDENTIFY).expect("fits");
            prop_assert_eq!(feed(&mut decoder, &frame), [Received::Message(IDENTIFY)]);
        }
    }
}
