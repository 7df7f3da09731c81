//! The messages between host and board.

use model::command::{DriveCommand, Request};
use model::supervise::codes::BlockerSet;
use serde::{Deserialize, Serialize};

use crate::events::LogBlock;
use crate::fault_list::FaultBlock;
use crate::records::codec::RecordBlock;

pub use super::board_status::{BoardStatus, LinkCounters, TickCycles};
pub use super::update::{UPDATE_BYTES, UpdateAnswer, UpdateRefusal, UpdateRequest, UpdateState};

/// Version of the messages; host and board must have the same version.
pub const PROTOCOL_VERSION: u16 = 3;

/// Period at which an operator repeats [`Order::Drive`], ms: many times within any dead-man time.
pub const COMMAND_PERIOD_MS: u64 = 20;

/// Age beyond which the board refuses an [`Order::Request`], us; a drive command of this age counts in
/// [`LinkCounters::late_orders`].
pub const ORDER_AGE_MAX_US: u64 = 250_000;

/// Largest time by which an order may seem to come from the future, us: the drift between the host's and the board's
/// clock since the host last heard the board. The board drops orders beyond this tolerance.
pub const CLOCK_TOLERANCE_US: u64 = 10_000;

/// Rate of the status until a host chooses another rate, Hz.
pub const STATUS_RATE_HZ: u16 = 100;

/// From the host to the board.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[allow(clippy::large_enum_variant)] // None is kept in numbers.
pub enum HostMessage {
    /// Asks for the board's identity. The board answers with [`BoardMessage::Identity`], which offers a session. The
    /// same nonce gets the same session again.
    Identify {
        /// A number that this host has never used before.
        nonce: u32,
    },
    /// Opens the bridges at once. The board accepts this message from anybody, in any state, with any session and
    /// sequence number.
    Disarm(OrderId),
    /// Any other order, which only a host with a session may give.
    Order {
        /// The session, the number and the time of an order.
        envelope: Envelope,
        /// The order.
        order: Order,
    },
}

/// The session and the number of an order.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct OrderId {
    /// The session that the board offered: the first order of an offered session puts the session in force, and ends
    /// the previous session. 0 before the board has offered a session; a host may then only disarm.
    pub session: u32,
    /// Number of the order, from 1, greater than every number before in this session.
    pub sequence: u32,
}

/// The session, the number and the time of an order.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Envelope {
    /// The session and the number of an order.
    pub id: OrderId,
    /// When the order was given, us since the board's boot, as the host knows the board's clock: never later than
    /// it was, and earlier by at most the time that the fastest message from the board took.
    pub given_at_us: u64,
}

/// An order of a host.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[allow(clippy::large_enum_variant)] // None is kept in numbers.
pub enum Order {
    /// Drives the vehicle. The host repeats this order every [`COMMAND_PERIOD_MS`], in any case within the dead-man
    /// time. The board does not answer it.
    Drive(DriveCommand),
    /// Passes this request to the arming state machine.
    Request(Request),
    /// Reads, changes or stores parameters.
    Parameters(ParameterRequest),
    /// Sets the rate of the status.
    StatusRate {
        /// Rate, Hz; 0 sends none.
        hz: u16,
    },
    /// Starts or stops the stream of records of every tick.
    Recording {
        /// Number of the first block; 0 means every stored block. `None` stops the stream.
        from: Option<u32>,
    },
    /// Reads a part of the board's memory. The board answers with [`BoardMessage::Reading`].
    Read(Read),
    /// Stores another firmware and boots it.
    Update(UpdateRequest),
}

/// The parts of the board's memory that a host can read.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Read {
    /// The records of the last seconds before a fault: the oldest block whose number is at least this.
    LookBack {
        /// Number of the block.
        from: u32,
    },
    /// The log: the oldest lines whose number is at least this.
    Log {
        /// Number of the line.
        from: u32,
    },
    /// The last faults, kept over resets: the oldest faults whose number is at least this.
    Faults {
        /// Number of the fault.
        from: u32,
    },
}

/// A part of the board's memory.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[allow(clippy::large_enum_variant)] // None is kept in numbers.
pub enum Reading {
    /// Answer to [`Read::LookBack`].
    LookBack {
        /// Whether the look-back is frozen, from a fault until the vehicle is armed again.
        frozen: bool,
        /// The block; `None` if there is no such block.
        block: Option<RecordBlock>,
    },
    /// Answer to [`Read::Log`].
    Log(LogBlock),
    /// Answer to [`Read::Faults`]: no entry if there are no newer faults.
    Faults(FaultBlock),
}

/// A request about parameters. Numbers are those of [`model::vehicle::VehicleParameters`].
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum ParameterRequest {
    /// Return one value of the set in force.
    Read {
        /// Its number.
        number: u16,
    },
    /// Stage a change of one value, not in force before [`ParameterRequest::Store`]. A refused change drops every
    /// staged change.
    Write {
        /// Its number.
        number: u16,
        /// Its new value.
        value: f32,
    },
    /// Check the staged set (the set in force if nothing is staged), store it in flash, and put it in force. Only
    /// while disarmed. A refused store drops every staged change.
    Store,
    /// Stage the built-in set, not in force before [`ParameterRequest::Store`].
    BuiltIn,
    /// Return one value of the staged set, which is the set in force if nothing is staged.
    ReadStaged {
        /// Its number.
        number: u16,
    },
    /// Drop every staged change.
    Discard,
}

/// The board's answer to a [`ParameterRequest`].
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum ParameterAnswer {
    /// One value of the requested set, or the value that has just been staged.
    Value {
        /// Its number.
        number: u16,
        /// Number of parameters.
        count: u16,
        /// Its value.
        value: f32,
        /// Hash of every name and range: if it matches, host and board mean the same by a number.
        schema: u32,
    },
    /// No parameter has this number.
    NoSuchNumber,
    /// The value is out of its range.
    OutOfRange {
        /// Least allowed.
        min: f32,
        /// Most allowed.
        max: f32,
    },
    /// The set is inconsistent; the number of the value to change.
    Inconsistent {
        /// Its number.
        number: u16,
    },
    /// The vehicle is armed.
    Armed,
    /// The flash failed; the set in force is unchanged.
    FlashFailed,
    /// The set is stored and in force.
    Stored,
    /// The built-in set is ready to be stored.
    BuiltInReady,
    /// All staged changes are dropped.
    Discarded,
}

/// From the board to the host.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[allow(clippy::large_enum_variant)] // Nearly every message is a status, and none is kept in numbers.
pub enum BoardMessage {
    /// Answer to [`HostMessage::Identify`].
    Identity(Identity),
    /// The status of vehicle and board, at the rate that the host chose.
    Status(BoardStatus),
    /// Answer to an order or to [`HostMessage::Disarm`].
    Answer {
        /// The order.
        id: OrderId,
        /// The answer.
        answer: Answer,
    },
    /// Some ticks of the stream of records.
    Records(RecordBlock),
    /// Answer to [`Order::Read`].
    Reading {
        /// The order.
        id: OrderId,
        /// The data.
        reading: Reading,
    },
}

/// The board's identity, and the session that it offers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Identity {
    /// [`PROTOCOL_VERSION`] of the board.
    pub protocol: u16,
    /// The nonce of the question.
    pub nonce: u32,
    /// The session that the board offers, never 0.
    pub session: u32,
    /// The greatest sequence number that this session has used; 0 in a new session.
    pub sequence: u32,
    /// The board's time at the question, us since boot.
    pub time_us: u64,
    /// The firmware and the board.
    pub about: About,
}

/// The firmware and the board that runs it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct About {
    /// Version of the firmware: major, minor, patch.
    pub version: [u16; 3],
    /// Hash of the sources and of the vehicle file that the firmware was built from.
    pub build: u32,
    /// Hash of the names and ranges of the vehicle's parameters.
    pub schema: u32,
    /// A number that differs from boot to boot and from board to board.
    pub boot: u32,
}

/// The result of an order.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum Answer {
    /// The order was carried out.
    Done,
    /// The order had no effect.
    Refused(Refusal),
    /// Answer to [`Order::Parameters`].
    Parameters(ParameterAnswer),
    /// Answer to [`Order::Update`].
    Update(UpdateAnswer),
}

/// Why an order had no effect.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Refusal {
    /// The session is neither in force nor offered: the board has rebooted, or another host has taken over.
    UnknownSession,
    /// The order was given too long ago, or in the board's future.
    Late,
    /// Too many orders of this kind are waiting.
    Busy,
    /// Arm: these blockers keep the vehicle from arming.
    Blocked(BlockerSet),
    /// Arm: a controlled stop is under way.
    Stopping,
    /// Arm: a Disarm came with it.
    Disarmed,
    /// The board accepts this request only while disarmed.
    NotDisarmed,
    /// StatusRate: the line cannot carry a higher rate.
    StatusRate {
        /// Largest rate, Hz.
        max_hz: u16,
    },
}
