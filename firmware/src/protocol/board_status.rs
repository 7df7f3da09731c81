//! The status of vehicle and board, as sent over the link.

use model::status::Status;
use serde::{Deserialize, Serialize};

use crate::hardware::ClockSource;

/// The status of vehicle and board, as sent over the link.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct BoardStatus {
    /// `boot` of the board, as in its identity.
    pub boot: u32,
    /// Number of the status, from 1 at boot.
    pub sequence: u32,
    /// The vehicle's status after the last tick.
    pub vehicle: Status,
    /// Counters of the link's input.
    pub link: LinkCounters,
    /// Cost of the ticks.
    pub cycles: TickCycles,
    /// The source of the board's clocks.
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
    /// Dropped frames of the session: repeated frames, and frames that a later frame overtook.
    pub repeated_frames: u32,
    /// Dropped orders of a session that is neither in force nor offered.
    pub foreign_frames: u32,
    /// Orders, including drive commands, that were too old or from the board's future.
    pub late_orders: u32,
    /// Answers dropped because too many were waiting, or because another Disarm came in the same tick.
    pub dropped_answers: u32,
}

impl LinkCounters {
    /// Frames that the board could not read, for any reason.
    pub fn unreadable_frames(&self) -> u32 {
        self.bad_frames.wrapping_add(self.overlong_frames)
    }
}

/// Execution cost of one tick in CPU cycles, by stage: the latest, and the worst total. All are 0 on a board that counts none.
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

impl TickCycles {
    /// Whether the board counts cycles: a simulated board does not.
    pub fn are_counted(&self) -> bool {
        self.worst > 0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_board_that_has_counted_a_tick_counts_cycles() {
        assert!(!TickCycles::default().are_counted());
        assert!(
            TickCycles {
                worst: 1,
                ..TickCycles::default()
            }
            .are_counted()
        );
    }
}
