//! The status of vehicle and board as it goes over the link.

use model::status::Status;
use serde::{Deserialize, Serialize};

use crate::hardware::ClockSource;

/// The status of vehicle and board as it is sent.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct BoardStatus {
    /// `boot` of the board, as in its identity.
    pub boot: u32,
    /// Number of the status, from 1 at boot.
    pub sequence: u32,
    /// The vehicle, as the last tick left it.
    pub vehicle: Status,
    /// The link's input.
    pub link: LinkCounters,
    /// Cost of the ticks.
    pub cycles: TickCycles,
    /// What the board's clocks run from.
    pub clock: ClockSource,
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
    /// Orders dropped because too many were waiting, or because a later one of the same kind came in the same tick.
    pub dropped_requests: u32,
    /// Frames of the session that had come before, or that a later one overtook: dropped.
    pub repeated_frames: u32,
    /// Orders of a session that is neither in force nor offered: dropped.
    pub foreign_frames: u32,
    /// Orders that were too old or from the board's future, drive commands among them.
    pub late_orders: u32,
    /// Answers dropped because too many were waiting, or because another Disarm came in the same tick.
    pub dropped_answers: u32,
}

impl LinkCounters {
    /// Frames that the board could not read, for whatever reason.
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
