//! The board's log for the link: events as codes with arguments. The board formats no text.

use core::cell::RefCell;

use embassy_sync::blocking_mutex::Mutex;
use embassy_sync::blocking_mutex::raw::RawMutex;
use embassy_time::Instant;
use model::supervise::arming::Mode;
use model::supervise::codes::BlockerSet;
use serde::{Deserialize, Serialize};

use crate::hardware::{Place, ResetCause};

/// An event.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Event {
    /// The board started.
    Booted(ResetCause),
    /// The last run ended in a panic or a hardware fault; the log over RTT has its message.
    Crashed,
    /// The gyros are calibrated.
    Calibrated,
    /// The mode changed to this.
    Mode(Mode),
    /// The fault of this number was latched.
    Fault(u8),
    /// A request to arm was refused because of these blockers.
    NotArmed(BlockerSet),
    /// A set of parameters was stored and is in force.
    SetStored,
    /// A set of parameters was not stored: the flash failed.
    FlashFailed,
    /// An IMU was started.
    ImuStarted(Place),
    /// An IMU gives no samples and is restarted.
    ImuLost(Place),
    /// An IMU did not start; the task keeps trying until it starts.
    ImuNotStarted(Place),
    /// The stored set is another firmware's and was read by name.
    SetMigrated {
        /// Number of parameters that the set does not contain; they have their built-in values.
        as_built_in: u16,
        /// Number of values that belong to no parameter of this firmware.
        dropped: u16,
    },
    /// The stored set cannot be believed: the built-in set is in force, and arming is blocked until a set is stored.
    SetLost,
    /// The external clock is missing: the board runs from its own oscillator.
    InternalClock,
}

/// One line of the log.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Line {
    /// Time of the event, us since boot.
    pub time_us: u64,
    /// The event.
    pub event: Event,
}

/// Largest number of lines in one answer.
const BLOCK_LINES: usize = 24;
/// Largest number of lines that the board keeps.
const LINES: usize = 128;

/// Some consecutive lines of the log.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct LogBlock {
    /// Number of the first line since boot, from 0: requested lines before this line are lost.
    pub first: u32,
    /// The lines; empty if there are no newer lines.
    pub lines: heapless::Vec<Line, BLOCK_LINES>,
}

#[derive(Debug)]
struct Kept {
    lines: heapless::Deque<Line, LINES>,
    /// Number of the oldest line kept.
    first: u32,
}

/// The newest lines of the log.
#[derive(Debug)]
pub struct Log<M: RawMutex> {
    kept: Mutex<M, RefCell<Kept>>,
}

impl Kept {
    /// Adds a line; drops the oldest line if there is no room.
    fn push(&mut self, line: Line) {
        if self.lines.is_full() {
            self.lines.pop_front();
            self.first = self.first.wrapping_add(1);
        }
        // There is room now.
        let _ = self.lines.push_back(line);
    }

    /// The oldest lines whose number is at least `from`.
    fn from(&self, from: u32) -> LogBlock {
        let first = from.max(self.first);
        let skipped = (first - self.first) as usize;
        LogBlock {
            first,
            lines: self.lines.iter().skip(skipped).take(BLOCK_LINES).copied().collect(),
        }
    }
}

impl<M: RawMutex> Log<M> {
    /// No lines.
    pub const fn new() -> Self {
        Self {
            kept: Mutex::new(RefCell::new(Kept {
                lines: heapless::Deque::new(),
                first: 0,
            })),
        }
    }

    /// Adds a line, stamped with the present time; drops the oldest line if there is no room.
    pub fn push(&self, event: Event) {
        let line = Line {
            time_us: Instant::now().as_micros(),
            event,
        };
        self.kept.lock(|kept| {
            // No task waits inside, so the lines are never in use.
            if let Ok(mut kept) = kept.try_borrow_mut() {
                kept.push(line);
            }
        });
    }

    /// The oldest stored lines whose number is at least `from`.
    pub fn from(&self, from: u32) -> LogBlock {
        self.kept.lock(|kept| {
            let kept = kept.try_borrow();
            kept.map(|kept| kept.from(from)).unwrap_or_default()
        })
    }
}

impl<M: RawMutex> Default for Log<M> {
    fn default() -> Self {
        Self::new()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::protocol::frame::encode;
    use crate::protocol::message::{BoardMessage, OrderId, Reading};

    #[test]
    fn the_longest_block_fits_a_frame() {
        let line = Line {
            time_us: u64::MAX,
            event: Event::NotArmed(BlockerSet::FULL),
        };
        let lines = core::iter::repeat_n(line, BLOCK_LINES).collect();
        let first = u32::MAX;
        let id = OrderId {
            session: u32::MAX,
            sequence: u32::MAX,
        };
        let reading = Reading::Log(LogBlock { first, lines });
        assert!(encode(&BoardMessage::Reading { id, reading }).is_ok());
    }

    #[test]
    fn the_newest_lines_stay_with_their_numbers() {
        let mut log = Kept {
            lines: heapless::Deque::new(),
            first: 0,
        };
        let line = |event| Line { time_us: 0, event };
        for number in 0..200_u8 {
            log.push(line(Event::Fault(number)));
        }
        let block = log.from(0);
        assert_eq!(block.first, 200 - LINES as u32);
        assert_eq!(block.lines.len(), BLOCK_LINES);
        let last = log.from(198);
        assert_eq!(last.first, 198);
        assert_eq!(last.lines[..], [line(Event::Fault(198)), line(Event::Fault(199))]);
        assert!(log.from(200).lines.is_empty());
        assert_eq!(log.from(u32::MAX).first, u32::MAX);
    }
}
