//! Wires in memory for the link tool: to the virtual board, to scripted boards, and to a board that sends nonsense.
#![allow(dead_code)] // Each test binary uses part of it.

use std::cell::RefCell;
use std::io;
use std::rc::Rc;
use std::sync::Arc;
use std::sync::atomic::AtomicU32;

use firmware::hardware::ClockSource;
use firmware::protocol::frame::{Decoder, Received, encode};
use firmware::protocol::message::{
    About, BoardMessage, BoardStatus, HostMessage, Identity, LinkCounters, Order, OrderId, PROTOCOL_VERSION, TickCycles,
};
use hil_sim::cli::link::session::Link;
use hil_sim::cli::link::wire::Wire;
use model::supervise::arming::Mode;
use model::supervise::codes::FaultSet;

use crate::support::Bench;

/// How long one read of the tool waits, us.
pub const READ_US: u64 = 5_000;
/// What the host's clock shows when the board boots, us.
pub const HOST_START_US: u64 = 777_000_000;

/// Every message of the host in these bytes.
pub fn messages(bytes: &[u8]) -> Vec<HostMessage> {
    let mut decoder = Decoder::new();
    bytes
        .iter()
        .filter_map(|byte| match decoder.push(*byte) {
            Received::Message(message) => Some(message),
            _ => None,
        })
        .collect()
}

/// Events beside the wire: called with the bench and the time since the wire was made, us.
pub type Scenery = Box<dyn FnMut(&mut Bench, u64)>;

/// The virtual board at the end of a wire that may be cut.
pub struct BoardWire {
    bench: Bench,
    waiting: Vec<u8>,
    pub sent: Rc<RefCell<Vec<u8>>>,
    pub cut_at_us: u64,
    pub world: Scenery,
    /// Seconds of the host's clock per second of the board's.
    pub host_rate: f64,
    started_us: u64,
}

impl BoardWire {
    pub fn new(mut bench: Bench) -> Self {
        bench.drive = None;
        bench.board.receive();
        let started_us = bench.now_ms() * 1000;
        Self {
            bench,
            waiting: Vec::new(),
            sent: Rc::default(),
            cut_at_us: u64::MAX,
            world: Box::new(|_, _| {}),
            host_rate: 1.0,
            started_us,
        }
    }

    pub fn elapsed_us(&self) -> u64 {
        self.bench.now_ms() * 1000 - self.started_us
    }
}

impl Wire for BoardWire {
    fn send(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.sent.borrow_mut().extend(bytes);
        if self.elapsed_us() < self.cut_at_us {
            self.bench.board.send(bytes);
        }
        Ok(())
    }

    fn receive(&mut self, bytes: &mut [u8]) -> io::Result<usize> {
        self.bench.run_raw(READ_US / 1000);
        let elapsed_us = self.elapsed_us();
        (self.world)(&mut self.bench, elapsed_us);
        let received = self.bench.board.receive();
        if elapsed_us < self.cut_at_us {
            self.waiting.extend(received);
        }
        let length = bytes.len().min(self.waiting.len());
        for (slot, byte) in bytes.iter_mut().zip(self.waiting.drain(..length)) {
            *slot = byte;
        }
        Ok(length)
    }

    fn now_us(&self) -> u64 {
        HOST_START_US + ((self.bench.now_ms() * 1000) as f64 * self.host_rate) as u64
    }
}

/// A scripted board: it identifies itself, sends its status, and answers as its script says.
pub struct Scripted<S> {
    pub now_us: u64,
    decoder: Decoder,
    waiting: Vec<u8>,
    sequence: u32,
    /// The messages to send after an order, each with its delay, us.
    script: S,
    later: Vec<(u64, BoardMessage)>,
    about: About,
    /// The protocol version of its identity.
    pub protocol: u16,
}

pub const ABOUT: About = About {
    version: [0, 1, 0],
    build: 1,
    schema: 0,
    boot: 9,
};

impl<S: FnMut(OrderId, Order) -> Vec<(u64, BoardMessage)>> Scripted<S> {
    pub fn new(script: S) -> Self {
        Self::of(ABOUT.schema, script)
    }

    /// A board whose parameters are of this schema.
    pub fn of(schema: u32, script: S) -> Self {
        Self {
            about: About { schema, ..ABOUT },
            protocol: PROTOCOL_VERSION,
            now_us: HOST_START_US,
            decoder: Decoder::new(),
            waiting: Vec::new(),
            sequence: 0,
            script,
            later: Vec::new(),
        }
    }

    fn status(&mut self) -> BoardMessage {
        self.sequence += 1;
        let mut vehicle = Bench::new(1).first_status();
        vehicle.time_us = self.now_us;
        vehicle.mode = Mode::Disarmed;
        vehicle.faults = FaultSet::EMPTY;
        BoardMessage::Status(BoardStatus {
            boot: ABOUT.boot,
            sequence: self.sequence,
            vehicle,
            link: LinkCounters::default(),
            cycles: TickCycles::default(),
            clock: ClockSource::External,
        })
    }
}

impl<S: FnMut(OrderId, Order) -> Vec<(u64, BoardMessage)>> Wire for Scripted<S> {
    fn send(&mut self, bytes: &[u8]) -> io::Result<()> {
        for byte in bytes {
            match self.decoder.push(*byte) {
                Received::Message(HostMessage::Identify { nonce }) => {
                    let identity = Identity {
                        protocol: self.protocol,
                        nonce,
                        session: 1,
                        sequence: 0,
                        time_us: self.now_us,
                        about: self.about,
                    };
                    self.later.push((self.now_us, BoardMessage::Identity(identity)));
                }
                Received::Message(HostMessage::Order { envelope, order }) => {
                    let now_us = self.now_us;
                    let answers = (self.script)(envelope.id, order);
                    self.later.extend(
                        answers
                            .into_iter()
                            .map(|(after_us, message)| (now_us + after_us, message)),
                    );
                }
                _ => {}
            }
        }
        Ok(())
    }

    fn receive(&mut self, bytes: &mut [u8]) -> io::Result<usize> {
        self.now_us += READ_US;
        if self.now_us.is_multiple_of(10_000) {
            let status = self.status();
            self.later.push((self.now_us, status));
        }
        let now_us = self.now_us;
        let (due, later) = std::mem::take(&mut self.later)
            .into_iter()
            .partition(|(at_us, _)| *at_us <= now_us);
        self.later = later;
        let due: Vec<(u64, BoardMessage)> = due;
        for (_, message) in due {
            self.waiting.extend(&encode(&message).expect("fits"));
        }
        let length = bytes.len().min(self.waiting.len());
        for (slot, byte) in bytes.iter_mut().zip(self.waiting.drain(..length)) {
            *slot = byte;
        }
        Ok(length)
    }

    fn now_us(&self) -> u64 {
        self.now_us
    }
}

/// A wire that always holds bytes, all of them nonsense.
pub struct Flood {
    pub now_us: u64,
    pub byte: u8,
}

impl Wire for Flood {
    fn send(&mut self, _: &[u8]) -> io::Result<()> {
        Ok(())
    }

    fn receive(&mut self, bytes: &mut [u8]) -> io::Result<usize> {
        self.now_us += 100;
        for slot in &mut *bytes {
            self.byte = self.byte.wrapping_mul(5).wrapping_add(13);
            *slot = self.byte;
        }
        Ok(bytes.len())
    }

    fn now_us(&self) -> u64 {
        self.now_us
    }
}

pub fn link<W: Wire>(wire: W) -> (Link<W>, Arc<AtomicU32>) {
    let interrupts = Arc::new(AtomicU32::new(0));
    (Link::new(wire, 4711, interrupts.clone()), interrupts)
}

pub fn ready(seed: u64) -> Bench {
    let mut bench = Bench::new(seed);
    bench.run(1000);
    bench
}
