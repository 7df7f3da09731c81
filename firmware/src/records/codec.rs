//! Encodes flight records in few bytes: each record contains the differences from the previous record.
//!
//! A record consists of a mask of the numbers that differ from their expected values, and of these differences: mask
//! and differences as little-endian base-128 varints, a difference with its sign in the lowest bit. The first record
//! of a block is encoded relative to [`FlightRecord::NONE`], so a block can be read without the previous blocks.

use super::channels::{CHANNELS, EXPECTED, Row, record, row};
use crate::flight_record::FlightRecord;

/// Largest size of one record: a mask with one bit per number, seven bits per byte, and a 64-bit difference per
/// number.
const RECORD_MAX: usize = CHANNELS.div_ceil(7) + CHANNELS * VARINT_MAX;
// The mask has 64 bits.
const _: () = assert!(CHANNELS <= 64);
// The longest record fits an empty block.
const _: () = assert!(RECORD_MAX <= BLOCK_BYTES);
/// Largest size of a 64-bit varint in bytes.
const VARINT_MAX: usize = 10;
/// Largest size of a block: a frame less the bytes around the block.
pub const BLOCK_BYTES: usize = 480;

/// Some consecutive records.
#[derive(Debug, Clone, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct RecordBlock {
    /// Number of the block since boot, from 0. A gap in the numbers shows a lost block.
    pub number: u32,
    /// The records, one after the other.
    pub bytes: heapless::Vec<u8, BLOCK_BYTES>,
}

impl RecordBlock {
    /// A block without records.
    pub const fn empty() -> Self {
        Self {
            number: 0,
            bytes: heapless::Vec::new(),
        }
    }
}

/// Bytes of one record.
type RecordBytes = heapless::Vec<u8, RECORD_MAX>;

/// Encodes records into consecutive blocks.
#[derive(Debug)]
pub struct BlockEncoder {
    block: RecordBlock,
    last: Row,
}

impl BlockEncoder {
    /// Nothing encoded.
    pub fn new() -> Self {
        Self {
            block: RecordBlock::empty(),
            last: row(&FlightRecord::NONE),
        }
    }

    /// Adds the record of the next tick. If the record no longer fits, the full block is passed to `full` first.
    pub fn push(&mut self, flight: &FlightRecord, full: impl FnOnce(&RecordBlock)) {
        let next = row(flight);
        let mut bytes = RecordBytes::new();
        write(&mut bytes, &self.last, &next);
        if self.block.bytes.extend_from_slice(&bytes).is_err() {
            full(&self.block);
            self.block.number = self.block.number.wrapping_add(1);
            self.block.bytes.clear();
            bytes.clear();
            write(&mut bytes, &row(&FlightRecord::NONE), &next);
            // The longest record fits an empty block.
            let _ = self.block.bytes.extend_from_slice(&bytes);
        }
        self.last = next;
    }

    /// Ends the block before it is full and passes it to `cut`, unless it is empty.
    pub fn flush(&mut self, cut: impl FnOnce(&RecordBlock)) {
        if !self.block.bytes.is_empty() {
            cut(&self.block);
            self.block.number = self.block.number.wrapping_add(1);
            self.block.bytes.clear();
            self.last = row(&FlightRecord::NONE);
        }
    }
}

impl Default for BlockEncoder {
    fn default() -> Self {
        Self::new()
    }
}

/// Writes the differences of `next` from `last`.
fn write(bytes: &mut RecordBytes, last: &Row, next: &Row) {
    let mut differences = [0_i64; CHANNELS];
    let mut mask = 0_u64;
    for (place, slot) in differences.iter_mut().enumerate() {
        if let (Some(last), Some(next), Some(expected)) = (last.get(place), next.get(place), EXPECTED.get(place)) {
            *slot = next.wrapping_sub(*last).wrapping_sub(*expected);
            mask |= u64::from(*slot != 0) << place;
        }
    }
    write_varint(bytes, mask);
    // Only what differs is written: the places of the bits that are set.
    let mut rest = mask;
    while let Some(difference) = differences.get(rest.trailing_zeros() as usize) {
        write_varint(bytes, (difference << 1 ^ difference >> 63).cast_unsigned());
        rest &= rest.wrapping_sub(1);
    }
}

#[inline]
fn write_varint(bytes: &mut RecordBytes, mut value: u64) {
    while value >= 0x80 {
        // There is room for the longest record.
        let _ = bytes.push(value as u8 | 0x80);
        value >>= 7;
    }
    let _ = bytes.push(value as u8);
}

/// An error in a block.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct BadBlock;

/// Reads the records of one block.
#[derive(Debug, Clone)]
pub struct Records<'a> {
    rest: &'a [u8],
    last: Row,
}

impl<'a> Records<'a> {
    /// The records in the bytes of a block.
    pub fn new(bytes: &'a [u8]) -> Self {
        Self {
            rest: bytes,
            last: row(&FlightRecord::NONE),
        }
    }

    fn read(&mut self) -> Option<FlightRecord> {
        let mask = self.varint()?;
        if mask >> CHANNELS != 0 {
            return None;
        }
        let mut next = self.last;
        for (place, (value, expected)) in next.iter_mut().zip(&EXPECTED).enumerate() {
            let mut difference = 0;
            if mask >> place & 1 == 1 {
                let bits = self.varint()?;
                difference = (bits >> 1).cast_signed() ^ -(bits & 1).cast_signed();
            }
            *value = value.wrapping_add(*expected).wrapping_add(difference);
        }
        self.last = next;
        record(&next)
    }

    fn varint(&mut self) -> Option<u64> {
        let mut value = 0;
        for place in 0..VARINT_MAX {
            let (byte, rest) = self.rest.split_first()?;
            self.rest = rest;
            value |= u64::from(byte & 0x7F) << (7 * place);
            if byte & 0x80 == 0 {
                return Some(value);
            }
        }
        None
    }
}

impl Iterator for Records<'_> {
    type Item = Result<FlightRecord, BadBlock>;

    fn next(&mut self) -> Option<Self::Item> {
        if self.rest.is_empty() {
            return None;
        }
        let record = self.read().ok_or(BadBlock);
        if record.is_err() {
            self.rest = &[];
        }
        Some(record)
    }
}

#[cfg(test)]
mod tests {
    use model::analog::Analog;
    use model::command::Request;
    use proptest::prelude::*;

    use super::*;

    fn decoded(blocks: &[RecordBlock]) -> std::vec::Vec<FlightRecord> {
        blocks
            .iter()
            .flat_map(|block| Records::new(&block.bytes))
            .map(|record| record.expect("as written"))
            .collect()
    }

    proptest! {
        /// Any numbers are restored bit for bit, however far they are from the previous numbers.
        #[test]
        fn any_record_comes_back(rows in proptest::collection::vec(any::<[i64; 8]>(), 1..40)) {
            let records: std::vec::Vec<FlightRecord> = rows
                .iter()
                .map(|n| {
                    let mut record = FlightRecord::NONE;
                    record.tick = n[0] as u32;
                    record.sample.time_us = n[1].cast_unsigned();
                    record.sample.encoder_counts = [n[2], n[3], n[4]];
                    record.sample.arm_imu.raw.accel = [n[0] as i16, n[1] as i16, n[2] as i16];
                    record.sample.spar_imu.raw.gyro = [n[3] as i16, n[4] as i16, n[5] as i16];
                    record.sample.arm_imu.age_us = n[5] as u32;
                    record.sample.analog = Analog::from_values(std::array::from_fn(|input| n[7 - input % 3] as u16));
                    record.sample.emergency_stop = n[7] & 1 == 1;
                    record.command.drive.speed_m_s = f32::from_bits(n[0] as u32 & 0x7F7F_FFFF);
                    record.command.age_us = n[1] as u32;
                    record.command.parameters_pending = n[7] & 2 == 2;
                    record.command.request = Request::ALL[(n[7] as usize >> 2) % Request::ALL.len()];
                    record.actuation.enable = n[7] & 16 == 16;
                    record.actuation.duty = [n[2] as i16, n[3] as i16, n[4] as i16];
                    record
                })
                .collect();
            let mut encoder = BlockEncoder::new();
            let mut blocks = std::vec::Vec::new();
            for record in &records {
                encoder.push(record, |block| blocks.push(block.clone()));
            }
            encoder.flush(|block| blocks.push(block.clone()));
            prop_assert_eq!(decoded(&blocks), records);
            let numbers: std::vec::Vec<u32> = blocks.iter().map(|block| block.number).collect();
            prop_assert_eq!(numbers, (0..blocks.len() as u32).collect::<std::vec::Vec<u32>>());
        }

        /// Noise decodes to no or to some records, without a panic and without an endless loop.
        #[test]
        fn noise_ends(noise in proptest::collection::vec(any::<u8>(), 0..500)) {
            prop_assert!(Records::new(&noise).count() <= noise.len());
        }
    }

    #[test]
    fn a_tick_in_which_nothing_happens_takes_a_byte() {
        let mut encoder = BlockEncoder::new();
        let mut record = FlightRecord::NONE;
        for _ in 0..3 {
            record.tick += 1;
            record.sample.time_us += 1000;
            record.command.age_us += 1000;
            encoder.push(&record, |_| {});
        }
        assert_eq!(encoder.block.bytes.len(), 3);
    }
}
