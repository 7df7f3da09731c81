//! A recording of a board's messages, and the files made from it.

use std::collections::VecDeque;

use firmware::events::LogBlock;
use firmware::protocol::frame::encode;
use firmware::protocol::message::{BoardMessage, BoardStatus, Identity, OrderId, Reading};
use firmware::records::codec::{RecordBlock, Records};
use record_file::conversation::write_mcap;
use serde::Serialize;

/// Largest size of a recording in the page's memory, bytes. Its file of frames has about this size, its MCAP file three
/// times this size.
const RECORDING_MAX: usize = 64 << 20;

/// A recording in progress: the board's own frames in the order of their arrival.
#[derive(Debug)]
pub struct Recording {
    frames: Vec<u8>,
    bytes_max: usize,
    /// Number of the next block of records, once a block has arrived. Blocks before the first do not count as lost.
    next: Option<u32>,
    /// Number of the next line of the log.
    pub next_line: u32,
    /// Instant at which the stream was ended, us; `None` while the stream continues.
    pub ended_us: Option<u64>,
    /// Counts of the recording so far.
    pub counts: RecordingCounts,
}

/// Counts of a recording.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize)]
pub struct RecordingCounts {
    /// Ticks recorded.
    pub ticks: u64,
    /// Blocks that the board sent and that did not arrive.
    pub lost_blocks: u32,
    /// Bytes stored.
    pub bytes: usize,
    /// Whether the recording is full and has therefore ended by itself.
    pub full: bool,
    /// Whether the recording is complete: the stream has ended, and the log up to then is recorded.
    pub complete: bool,
}

impl Recording {
    /// A recording of this board.
    pub fn begin(identity: &Identity) -> Self {
        Self::with_room(identity, RECORDING_MAX)
    }

    fn with_room(identity: &Identity, bytes_max: usize) -> Self {
        let mut recording = Self {
            frames: Vec::new(),
            bytes_max,
            next: None,
            next_line: 0,
            ended_us: None,
            counts: RecordingCounts::default(),
        };
        recording.write(&BoardMessage::Identity(*identity));
        recording
    }

    /// Notes a boot of the board: its numbers start again.
    pub fn meet(&mut self, identity: &Identity) {
        self.next = None;
        self.next_line = 0;
        self.write(&BoardMessage::Identity(*identity));
    }

    /// Whether records are still taken.
    pub fn goes_on(&self) -> bool {
        self.ended_us.is_none()
    }

    /// Takes the received blocks and statuses until the recording ends. The first that does not fit ends the recording:
    /// a file with a gap would not replay beyond it.
    pub fn take(&mut self, blocks: &mut VecDeque<RecordBlock>, statuses: &[BoardStatus]) {
        for block in blocks.drain(..) {
            if self.is_closed() {
                return;
            }
            self.counts.lost_blocks += self.next.map_or(0, |next| block.number.wrapping_sub(next));
            self.next = Some(block.number.wrapping_add(1));
            self.counts.ticks += Records::new(&block.bytes).flatten().count() as u64;
            self.write(&BoardMessage::Records(block));
        }
        for status in statuses {
            if self.is_closed() {
                return;
            }
            self.write(&BoardMessage::Status(*status));
        }
    }

    /// Takes a block of the log, without the lines that are already recorded.
    pub fn take_log(&mut self, block: &LogBlock) {
        let new = newer(block, self.next_line);
        if new.lines.is_empty() {
            return;
        }
        self.next_line = new.first.saturating_add(new.lines.len() as u32);
        // Which order the block answered does not matter in a file.
        let id = OrderId {
            session: 0,
            sequence: 0,
        };
        let reading = Reading::Log(new);
        self.write(&BoardMessage::Reading { id, reading });
    }

    /// Whether the recording takes nothing more, because it has ended or is full. The log, which has few lines, still
    /// fits.
    fn is_closed(&mut self) -> bool {
        self.counts.full |= self.frames.len() >= self.bytes_max;
        self.counts.full || !self.goes_on()
    }

    /// The frames recorded so far: the file that `hil-sim replay` reads.
    pub fn into_frames(self) -> Vec<u8> {
        self.frames
    }

    fn write(&mut self, message: &BoardMessage) {
        // A message that came in a frame fits into a frame.
        if let Ok(frame) = encode(message) {
            self.frames.extend(&frame);
            self.counts.bytes = self.frames.len();
        }
    }
}

/// The MCAP file of a recording's frames; `vehicle` is the text of the vehicle file of the set in force, empty if that is not
/// known.
///
/// # Errors
/// A message that cannot be written as MCAP, as text.
pub fn mcap(frames: &[u8], vehicle: &str) -> Result<Vec<u8>, String> {
    let vehicle = (!vehicle.is_empty()).then(|| vehicle.to_owned());
    write_mcap(frames, vehicle, Vec::new()).map_err(|error| error.to_string())
}

/// The lines of a block from number `from` on.
pub fn newer(block: &LogBlock, from: u32) -> LogBlock {
    let known = from.saturating_sub(block.first);
    LogBlock {
        first: block.first.saturating_add(known),
        lines: block.lines.iter().skip(known as usize).copied().collect(),
    }
}

#[cfg(test)]
#[path = "../../../tests/support/identities.rs"]
mod identities;

#[cfg(test)]
mod tests {
    use virtual_board::records::RecordFile;

    use super::identities::identity;
    use super::*;

    fn block(number: u32) -> RecordBlock {
        let mut encoder = firmware::records::codec::BlockEncoder::new();
        let mut record = firmware::flight_record::FlightRecord::NONE;
        record.tick = number + 1;
        encoder.push(&record, |_| {});
        let mut full = None;
        encoder.flush(|block| full = Some(block.clone()));
        let mut block = full.expect("a block");
        block.number = number;
        block
    }

    fn status() -> BoardStatus {
        BoardStatus {
            boot: 0,
            sequence: 1,
            vehicle: model::status::Status::default(),
            link: firmware::protocol::message::LinkCounters::default(),
            cycles: firmware::protocol::message::TickCycles::default(),
            clock: firmware::hardware::ClockSource::External,
        }
    }

    #[test]
    fn a_full_recording_ends_keeps_what_it_has_and_says_so() {
        let mut recording = Recording::with_room(&identity(0), 2000);
        let mut number = 0;
        while !recording.counts.full {
            recording.take(&mut [block(number)].into(), &[]);
            number += 1;
            assert!(number < 1000, "it is never full");
        }
        let counts = recording.counts;
        // Later blocks and statuses change nothing. The recording replays up to the last tick before its end.
        let mut later = VecDeque::from([block(number), block(number + 1)]);
        recording.take(&mut later, &[status()]);
        assert_eq!(recording.counts, counts);
        assert!(later.is_empty());
        let read = RecordFile::parse(&recording.into_frames());
        assert_eq!(read.records().count() as u64, counts.ticks);
        assert_eq!((read.lost_blocks, counts.ticks as u32), (0, number - 1));
    }
}
