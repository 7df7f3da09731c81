//! The file format of records: the link's own frames, first an identity, then blocks of records and of the log.

use firmware::events::{Line, LogBlock};
use firmware::flight_record::FlightRecord;
use firmware::protocol::frame::{Decoder, Received};
use firmware::protocol::message::{BoardMessage, Identity, Reading};
use firmware::records::codec::{RecordBlock, Records};
use model::sample::Actuation;

/// The contents of a file of records.
#[derive(Debug, Default)]
pub struct RecordFile {
    /// The boots of the board, in the order in which they were recorded.
    pub boots: Vec<BootRecords>,
    /// Number of missing blocks, from the numbers of the others.
    pub lost_blocks: u32,
    /// Number of unreadable frames and blocks.
    pub unreadable: u32,
}

/// The recording from one boot of the board to the next.
#[derive(Debug, Default)]
pub struct BootRecords {
    /// Position of the first frame, bytes from the start of the file.
    pub start: usize,
    /// The board that made the records, if the file names it.
    pub identity: Option<Identity>,
    /// The records in order, each tick once.
    pub records: Vec<FlightRecord>,
    /// The lines of the board's log in order, each once, if the file contains them.
    pub log: Vec<Line>,
}

impl RecordFile {
    /// Reads the bytes of a file, which may be truncated. A boot begins at the identity of another boot or, if that
    /// identity is lost, at a tick that goes back.
    pub fn parse(bytes: &[u8]) -> Self {
        let mut reader = FrameReader::default();
        for (byte, end) in bytes.iter().zip(1..) {
            reader.take(*byte, end);
        }
        reader.file
    }

    /// The records of every boot, one after the other.
    pub fn records(&self) -> impl Iterator<Item = &FlightRecord> {
        self.boots.iter().flat_map(|boot| &boot.records)
    }
}

/// Splits records in the order of their creation into boots: a boot begins where the tick goes back.
pub fn boots(records: &[FlightRecord]) -> impl Iterator<Item = &[FlightRecord]> {
    records.chunk_by(|before, after| after.tick > before.tick)
}

/// Reads frames into a [`RecordFile`].
#[derive(Default)]
struct FrameReader {
    file: RecordFile,
    decoder: Decoder,
    /// Position of the present frame, bytes.
    start: usize,
    /// Number of the next block of this boot, once a block has been read.
    next: Option<u32>,
    /// Number of the next line of this boot's log.
    next_line: u32,
    /// Whether the board has repeated its identity within the same boot. The board may then repeat ticks that have
    /// already been read.
    again: bool,
}

impl FrameReader {
    /// Processes the next byte; `end` is its position plus 1.
    fn take(&mut self, byte: u8, end: usize) {
        match self.decoder.push::<BoardMessage>(byte) {
            Received::Nothing => return,
            Received::Bad | Received::Overlong => self.file.unreadable += 1,
            Received::Message(BoardMessage::Identity(identity)) => self.meet(identity),
            Received::Message(BoardMessage::Records(block)) => self.take_block(&block),
            Received::Message(BoardMessage::Reading {
                reading: Reading::Log(block),
                ..
            }) => self.take_log(&block),
            Received::Message(_) => {}
        }
        self.start = end;
    }

    fn meet(&mut self, identity: Identity) {
        let known = self.file.boots.last().and_then(|boot| boot.identity);
        self.again = known.is_some_and(|known| known.about.boot == identity.about.boot);
        if !self.again {
            self.begin(Some(identity));
        }
    }

    fn begin(&mut self, identity: Option<Identity>) -> &mut BootRecords {
        (self.next, self.next_line, self.again) = (None, 0, false);
        let boot = BootRecords {
            start: self.start,
            identity,
            ..BootRecords::default()
        };
        self.file.boots.push(boot);
        let last = self.file.boots.len() - 1;
        &mut self.file.boots[last]
    }

    fn boot(&mut self) -> &mut BootRecords {
        match self.file.boots.len() {
            0 => self.begin(None),
            boots => &mut self.file.boots[boots - 1],
        }
    }

    fn take_block(&mut self, block: &RecordBlock) {
        for record in Records::new(&block.bytes) {
            let Ok(record) = record else {
                self.file.unreadable += 1;
                continue;
            };
            let is_known = self.boot().records.last().is_some_and(|last| record.tick <= last.tick);
            match (is_known, self.again) {
                (true, true) => continue,
                (true, false) => {
                    self.begin(None);
                }
                (false, _) => self.again = false,
            }
            self.boot().records.push(record);
        }
        let next = self.next.unwrap_or(block.number);
        self.file.lost_blocks += block.number.saturating_sub(next);
        self.next = Some(block.number.wrapping_add(1).max(next));
    }

    fn take_log(&mut self, block: &LogBlock) {
        let next_line = self.next_line;
        let new = (block.first..)
            .zip(&block.lines)
            .filter(|(number, _)| *number >= next_line);
        for (number, line) in new {
            self.boot().log.push(*line);
            self.next_line = number.saturating_add(1);
        }
    }
}

/// The first field in which two actuations differ, and the two values.
pub fn first_field(recorded: Actuation, replayed: Actuation) -> Option<(&'static str, i32, i32)> {
    let fields = |actuation: Actuation| {
        let [left, right, ballast] = actuation.duty.map(i32::from);
        [i32::from(actuation.enable), left, right, ballast]
    };
    let names = ["enable", "left duty", "right duty", "ballast duty"];
    let values = fields(recorded).into_iter().zip(fields(replayed));
    let (name, (recorded, replayed)) = names.into_iter().zip(values).find(|(_, (a, b))| a != b)?;
    Some((name, recorded, replayed))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_field_that_differs_is_named() {
        let a = Actuation {
            enable: true,
            duty: [1, -2, 3],
        };
        assert_eq!(first_field(a, a), None);
        let mut b = a;
        b.duty[2] = 4;
        assert_eq!(first_field(a, b), Some(("ballast duty", 3, 4)));
        b.duty[1] = 5;
        assert_eq!(first_field(a, b), Some(("right duty", -2, 5)));
        b.enable = false;
        assert_eq!(first_field(a, b), Some(("enable", 1, 0)));
    }
}
