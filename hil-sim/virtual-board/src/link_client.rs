//! The host's end of the link: sends messages, receives statuses and answers. The client works on frames and on the time
//! that its caller gives; it does not depend on a wire. The bytes may travel over the virtual board's line, the emulated
//! board's USART or a serial port.

mod board_clock;

use std::collections::VecDeque;

use firmware::parameters;
use firmware::protocol::frame::{Decoder, Received, encode};
use firmware::protocol::message::{
    Answer, BoardMessage, BoardStatus, Envelope, HostMessage, Identity, Order, OrderId, PROTOCOL_VERSION, Reading,
    Refusal,
};
use firmware::records::codec::RecordBlock;
use model::vehicle::VehicleParameters;

use board_clock::BoardClock;

/// Time within which the board answers an order, us.
pub const ANSWER_US: u64 = 300_000;
/// Time within which the board stores a set or erases the area of an image, us. The slowest operation erases two sectors
/// of the flash, each within 4 s by the data sheet.
pub const STORE_US: u64 = 30_000_000;
/// Interval at which a host repeats a question that the board has not yet answered, us.
pub const AGAIN_US: u64 = 50_000;
/// Largest number of answers that are kept; the oldest answers are dropped first.
const ANSWERS_MAX: usize = 32;
/// Largest number of blocks of records that are kept; the oldest blocks are dropped first.
pub const RECORDS_MAX: usize = 1000;

/// The host's end of the link. Times are the host's, in us from any fixed start.
#[derive(Debug)]
pub struct LinkClient {
    decoder: Decoder,
    nonce: u32,
    sequence: u32,
    clock: BoardClock,
    identity: Option<Identity>,
    /// The last identity with another protocol.
    foreign: Option<Identity>,
    answers: VecDeque<(u32, Answer)>,
    last_status: Option<u32>,
    /// The newest status of vehicle and board; `None` before the board has identified itself.
    pub status: Option<BoardStatus>,
    /// Time at which the last bytes from the board arrived, us.
    pub heard_us: Option<u64>,
    /// Blocks of the stream of records that have not been taken, in order: the newest [`RECORDS_MAX`].
    pub records: VecDeque<RecordBlock>,
    /// Number of the unanswered order that starts a stream of records.
    stream_asked: Option<u32>,
    readings: VecDeque<(u32, Reading)>,
    /// Bytes received.
    pub bytes: u64,
    /// Good messages received.
    pub messages: u64,
    /// Frames from the board that this host could not read, for any reason.
    pub unreadable_frames: u64,
    /// Dropped statuses: repeated statuses, and statuses that a later status had overtaken.
    pub repeated_statuses: u64,
    /// Dropped statuses that arrived before the board had identified itself, or from another boot.
    pub unidentified: u64,
}

impl LinkClient {
    /// A client that has sent nothing yet. `nonce` is a number that no client has used before on this board.
    pub fn new(nonce: u32) -> Self {
        Self {
            decoder: Decoder::new(),
            nonce,
            sequence: 0,
            clock: BoardClock::default(),
            identity: None,
            foreign: None,
            answers: VecDeque::new(),
            last_status: None,
            status: None,
            heard_us: None,
            records: VecDeque::new(),
            stream_asked: None,
            readings: VecDeque::new(),
            bytes: 0,
            messages: 0,
            unreadable_frames: 0,
            repeated_statuses: 0,
            unidentified: 0,
        }
    }

    /// The board's identity, once the board has identified itself with this protocol.
    pub fn identity(&self) -> Option<&Identity> {
        self.identity.as_ref()
    }

    /// The board's identity, if the board has identified itself with another protocol.
    pub fn foreign(&self) -> Option<&Identity> {
        self.foreign.as_ref()
    }

    /// The frame that asks for the board's identity; to be repeated until the board answers.
    pub fn identify(&self) -> Vec<u8> {
        bytes(&HostMessage::Identify { nonce: self.nonce })
    }

    /// The frame that opens the bridges, with its number. It needs no identity.
    pub fn disarm(&mut self) -> (u32, Vec<u8>) {
        self.sequence += 1;
        let session = self.identity.map_or(0, |identity| identity.session);
        let sequence = self.sequence;
        (sequence, bytes(&HostMessage::Disarm(OrderId { session, sequence })))
    }

    /// The frame of an order given at `now_us`, with its number; `None` before the board has identified itself.
    pub fn order(&mut self, now_us: u64, order: Order) -> Option<(u32, Vec<u8>)> {
        let session = self.identity?.session;
        let given_at_us = self.clock.board_us(now_us)?;
        self.sequence += 1;
        let sequence = self.sequence;
        if matches!(order, Order::Recording { from: Some(_) }) {
            self.stream_asked = Some(sequence);
        }
        let envelope = Envelope {
            id: OrderId { session, sequence },
            given_at_us,
        };
        Some((sequence, bytes(&HostMessage::Order { envelope, order })))
    }

    /// Takes the answer to one order, if the answer has arrived.
    pub fn answer_to(&mut self, sequence: u32) -> Option<Answer> {
        let at = self.answers.iter().position(|(number, _)| *number == sequence)?;
        self.answers.remove(at).map(|(_, answer)| answer)
    }

    /// Takes the reading for one order, if the reading has arrived.
    pub fn reading_of(&mut self, sequence: u32) -> Option<Reading> {
        let at = self.readings.iter().position(|(number, _)| *number == sequence)?;
        self.readings.remove(at).map(|(_, reading)| reading)
    }

    /// Processes bytes from the board that arrived at `now_us`.
    pub fn receive(&mut self, now_us: u64, bytes: &[u8]) {
        self.bytes += bytes.len() as u64;
        let mut rest = bytes;
        while let Some(received) = self.decoder.next_of(&mut rest) {
            match received {
                Received::Nothing => {}
                Received::Bad | Received::Overlong => self.unreadable_frames += 1,
                Received::Message(message) => {
                    self.messages += 1;
                    self.take(now_us, message);
                }
            }
        }
    }

    // This function takes the message apart.
    #[allow(clippy::large_types_passed_by_value)]
    fn take(&mut self, now_us: u64, message: BoardMessage) {
        match message {
            BoardMessage::Identity(identity) if identity.nonce == self.nonce => self.meet(now_us, identity),
            // An answer to another host's question.
            BoardMessage::Identity(_) => {}
            BoardMessage::Status(ref status) => self.take_status(now_us, status),
            BoardMessage::Records(block) => {
                self.heard_us = Some(now_us);
                self.records.push_back(block);
                if self.records.len() > RECORDS_MAX {
                    self.records.pop_front();
                }
            }
            // An answer to another host's order.
            BoardMessage::Answer { id, .. } | BoardMessage::Reading { id, .. }
                if id.session != self.identity.map_or(0, |known| known.session) => {}
            BoardMessage::Reading { id, reading } => {
                self.heard_us = Some(now_us);
                self.readings.push_back((id.sequence, reading));
                if self.readings.len() > ANSWERS_MAX {
                    self.readings.pop_front();
                }
            }
            BoardMessage::Answer { id, answer } => {
                self.heard_us = Some(now_us);
                if answer == Answer::Refused(Refusal::UnknownSession) {
                    // The board has booted since, or another host has taken over.
                    self.identity = None;
                }
                if self.stream_asked == Some(id.sequence) {
                    // The board answers before it sends the first block of a stream: the blocks so far are an earlier
                    // stream's, which another host may have left behind.
                    self.stream_asked = None;
                    self.records.clear();
                }
                self.answers.push_back((id.sequence, answer));
                if self.answers.len() > ANSWERS_MAX {
                    self.answers.pop_front();
                }
            }
        }
    }

    fn meet(&mut self, now_us: u64, identity: Identity) {
        self.heard_us = Some(now_us);
        if identity.protocol != PROTOCOL_VERSION {
            self.foreign = Some(identity);
            return;
        }
        if self
            .identity
            .is_none_or(|known| known.about.boot != identity.about.boot)
        {
            self.clock = BoardClock::default();
            self.last_status = None;
            self.status = None;
        }
        self.clock.observe(now_us, identity.time_us);
        self.sequence = self.sequence.max(identity.sequence);
        self.identity = Some(identity);
    }

    fn take_status(&mut self, now_us: u64, status: &BoardStatus) {
        if self.identity.is_none_or(|identity| identity.about.boot != status.boot) {
            self.unidentified += 1;
            // A board that has rebooted knows none of this client's orders, so the client asks for the identity again.
            self.identity = None;
            return;
        }
        if self.last_status.is_some_and(|last| status.sequence <= last) {
            self.repeated_statuses += 1;
            return;
        }
        self.heard_us = Some(now_us);
        self.last_status = Some(status.sequence);
        self.clock.observe(now_us, status.vehicle.time_us);
        self.status = Some(*status);
    }
}

/// The kind of vehicle of a board's parameters, with or without a spar, from the schema in the board's identity. The
/// values are the reference vehicle's. `None` if this host does not know the parameters.
pub fn board_kind(schema: u32) -> Option<VehicleParameters<f32>> {
    let with_spar = vehicle_file::reference().ok()?.parameters().cast::<f32>();
    let without = VehicleParameters {
        spar: None,
        ..with_spar
    };
    [with_spar, without]
        .into_iter()
        .find(|kind| parameters::schema(kind) == schema)
}

/// One message as a frame.
fn bytes(message: &HostMessage) -> Vec<u8> {
    // A test of this module proves that every host message fits a frame.
    encode(message).expect("host messages are short").to_vec()
}

#[cfg(test)]
mod tests;
