//! Records as files hold them: the link's own frames, an identity first, then blocks of records, and of the log.

use firmware::events::Line;
use firmware::flight_record::FlightRecord;
use firmware::protocol::frame::{Decoder, Received};
use firmware::protocol::message::{BoardMessage, Identity, Reading};
use firmware::records::codec::Records;
use model::sample::Actuation;

/// What a file of records holds.
#[derive(Debug, Default)]
pub struct RecordFile {
    /// The board that made the records, if the file says so.
    pub identity: Option<Identity>,
    /// The records in order.
    pub records: Vec<FlightRecord>,
    /// The lines of the board's log in order, if the file has them: each once.
    pub log: Vec<Line>,
    /// Blocks of which the numbers tell that they are missing.
    pub lost_blocks: u32,
    /// Frames and blocks that could not be read.
    pub unreadable: u32,
}

impl RecordFile {
    /// Reads the bytes of a file, also of one that breaks off.
    pub fn parse(bytes: &[u8]) -> Self {
        let mut file = Self::default();
        let mut decoder = Decoder::new();
        let mut next: Option<u32> = None;
        let mut next_line = 0;
        for byte in bytes {
            match decoder.push::<BoardMessage>(*byte) {
                Received::Bad | Received::Overlong => file.unreadable += 1,
                Received::Message(BoardMessage::Identity(identity)) => {
                    file.identity.get_or_insert(identity);
                    next = None;
                    next_line = 0;
                }
                Received::Message(BoardMessage::Records(block)) => {
                    file.lost_blocks += next.map_or(0, |next| block.number.wrapping_sub(next));
                    next = Some(block.number.wrapping_add(1));
                    for record in Records::new(&block.bytes) {
                        match record {
                            Ok(record) => file.records.push(record),
                            Err(_) => file.unreadable += 1,
                        }
                    }
                }
                Received::Message(BoardMessage::Reading {
                    reading: Reading::Log(block),
                    ..
                }) => {
                    for (number, line) in (block.first..).zip(&block.lines) {
                        if number >= next_line {
                            file.log.push(*line);
                            next_line = number.saturating_add(1);
                        }
                    }
                }
                Received::Nothing | Received::Message(_) => {}
            }
        }
        file
    }
}

/// The first field in which two actuations differ, and its values.
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
