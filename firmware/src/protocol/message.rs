//! What host and board say to each other.

use model::command::Request;
use model::status::Status;
use serde::{Deserialize, Serialize};

/// Version of the messages: host and board must agree.
pub const PROTOCOL_VERSION: u16 = 2;

/// How often an operator repeats [`HostMessage::Drive`], ms: many times within any dead-man time.
pub const COMMAND_PERIOD_MS: u64 = 20;

/// From the host to the board.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum HostMessage {
    /// Who are you? Answered by [`BoardMessage::Identity`].
    Identify,
    /// Drive so; repeated every [`COMMAND_PERIOD_MS`], in any case before the dead-man time is over.
    Drive {
        /// Speed, m/s, forward positive.
        speed_m_s: f32,
        /// Yaw rate, rad/s, anticlockwise positive; exactly 0 holds the heading.
        yaw_rate_rad_s: f32,
    },
    /// Ask the arming state machine.
    Request(Request),
    /// Read, change or store parameters.
    Parameters(ParameterRequest),
}

/// What the host asks of the parameters. Numbers are those of [`model::vehicle::VehicleParameters`].
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum ParameterRequest {
    /// Tell one value.
    Read {
        /// Its number.
        number: u16,
    },
    /// Change one value, not in force before [`ParameterRequest::Store`].
    Write {
        /// Its number.
        number: u16,
        /// Its new value.
        value: f32,
    },
    /// Check the changed set, keep it in flash, and put it in force. Only while disarmed.
    Store,
    /// Go back to the built-in set, not in force before [`ParameterRequest::Store`].
    Defaults,
}

/// What the board answers to a [`ParameterRequest`].
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub enum ParameterAnswer {
    /// One value as it is, or as it has been changed.
    Value {
        /// Its number.
        number: u16,
        /// How many there are.
        count: u16,
        /// Its value.
        value: f32,
        /// Hash of every name and range: host and board mean the same by a number.
        schema: u32,
    },
    /// There is no such number.
    NoSuchNumber,
    /// The value is out of its range.
    OutOfRange {
        /// Least allowed.
        min: f32,
        /// Most allowed.
        max: f32,
    },
    /// The set contradicts itself; number of the value to change.
    Inconsistent {
        /// Its number.
        number: u16,
    },
    /// The vehicle is armed.
    Armed,
    /// The flash failed; the set in force stays.
    FlashFailed,
    /// The set is stored and in force.
    Stored,
    /// The built-in set is ready to be stored.
    DefaultsReady,
}

/// From the board to the host.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[allow(clippy::large_enum_variant)] // Nearly every message is a status, and none is kept in numbers.
pub enum BoardMessage {
    /// Answer to [`HostMessage::Identify`].
    Identity {
        /// [`PROTOCOL_VERSION`] of the board.
        protocol: u16,
    },
    /// The status of vehicle and board, every 10 ms.
    Status(BoardStatus),
    /// Answer to [`HostMessage::Parameters`].
    Parameters(ParameterAnswer),
}

/// The status of vehicle and board as it is sent.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct BoardStatus {
    /// The vehicle, as the last tick left it.
    pub vehicle: Status,
    /// The link's input.
    pub link: LinkCounters,
    /// Cost of the ticks.
    pub cycles: TickCycles,
}

/// Counters of the link's input, since boot.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct LinkCounters {
    /// Good frames.
    pub frames: u32,
    /// Frames with a wrong checksum, stuffing or content.
    pub bad_frames: u32,
    /// Frames longer than any message.
    pub overlong_frames: u32,
    /// Errors that the UART reported (overrun, noise, framing).
    pub uart_errors: u32,
    /// Requests dropped because too many were waiting.
    pub dropped_requests: u32,
}

impl LinkCounters {
    /// Frames that could not be read, for whatever reason.
    pub fn unreadable_frames(&self) -> u32 {
        self.bad_frames.wrapping_add(self.overlong_frames)
    }
}

/// Execution cost of one tick in CPU cycles, by stage: the latest, and the worst total.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct TickCycles {
    /// Raw to SI.
    pub sense: u32,
    /// Estimation.
    pub estimate: u32,
    /// Supervision and laws.
    pub decide: u32,
    /// Limits, duties, bridges.
    pub actuate: u32,
    /// All four.
    pub total: u32,
    /// The largest total since boot.
    pub worst: u32,
}
