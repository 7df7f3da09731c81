//! The firmware's flight record, decoded from the emulated board's memory.

use std::mem::{offset_of, size_of};

use firmware::flight_record::FlightRecord;
use model::analog::Analog;
use model::command::{Command, DriveCommand, Request};
use model::sample::{Actuation, ImuRaw, ImuSample, Sample};

use super::firmware::Firmware;
use crate::error::Error;

/// Symbol of the record in the firmware.
const SYMBOL: &str = "FLIGHT_RECORD";

/// Length of a record in 32-bit words. Its layout is the same on the host and on the board: C's layout, with
/// the same size and alignment of every field.
pub const WORDS: usize = size_of::<FlightRecord>() / 4;

/// Address of the record in the firmware's RAM.
///
/// # Errors
/// When the firmware has no record, or its record's length is not the host's.
pub fn address(firmware: &Firmware) -> Result<u64, Error> {
    let (address, size) = firmware.symbol(SYMBOL)?;
    if size == size_of::<FlightRecord>() as u64 {
        Ok(address)
    } else {
        Err(Error::Record(format!(
            "{SYMBOL} has {size} bytes, the host's record {}",
            size_of::<FlightRecord>()
        )))
    }
}

/// Decodes one record.
///
/// # Errors
/// When `words` is too short or a field holds no value of its type.
pub fn decode(words: &[u32]) -> Result<FlightRecord, Error> {
    let bytes: Vec<u8> = words.iter().flat_map(|word| word.to_le_bytes()).collect();
    let at = |offset| Fields { bytes: &bytes, offset };
    let sample = |offset| at(offset_of!(FlightRecord, sample) + offset);
    let command = |offset| at(offset_of!(FlightRecord, command) + offset);
    let actuation = |offset| at(offset_of!(FlightRecord, actuation) + offset);
    Ok(FlightRecord {
        tick: at(offset_of!(FlightRecord, tick)).u32()?,
        sample: Sample {
            time_us: sample(offset_of!(Sample, time_us)).u64()?,
            encoder_counts: sample(offset_of!(Sample, encoder_counts))
                .each(8, |field| Ok(field.u64()?.cast_signed()))?,
            encoder_age_us: sample(offset_of!(Sample, encoder_age_us)).u32()?,
            arm_imu: sample(offset_of!(Sample, arm_imu)).imu()?,
            spar_imu: sample(offset_of!(Sample, spar_imu)).imu()?,
            // In C's layout the inputs form an array.
            analog: Analog::from_values(sample(offset_of!(Sample, analog)).each(2, |field| field.u16())?),
            analog_age_us: sample(offset_of!(Sample, analog_age_us)).u32()?,
            emergency_stop: sample(offset_of!(Sample, emergency_stop)).flag()?,
            break_input: sample(offset_of!(Sample, break_input)).flag()?,
            bridge_break: sample(offset_of!(Sample, bridge_break)).flag()?,
            board_blockers: sample(offset_of!(Sample, board_blockers)).u32()?,
        },
        command: Command {
            // In C's layout the quantities form an array.
            drive: DriveCommand::from_values(
                command(offset_of!(Command, drive)).each(4, |field| Ok(f32::from_bits(field.u32()?)))?,
            ),
            age_us: command(offset_of!(Command, age_us)).u32()?,
            request: {
                let number = command(offset_of!(Command, request)).u8()?;
                let unknown = || Error::Record(format!("no request has the number {number}"));
                Request::from_number(number).ok_or_else(unknown)?
            },
            parameters_pending: command(offset_of!(Command, parameters_pending)).flag()?,
        },
        actuation: Actuation {
            enable: actuation(offset_of!(Actuation, enable)).flag()?,
            duty: actuation(offset_of!(Actuation, duty)).each(2, |field| Ok(field.u16()?.cast_signed()))?,
        },
    })
}

/// The fields of a record, starting at an offset.
struct Fields<'a> {
    bytes: &'a [u8],
    offset: usize,
}

impl Fields<'_> {
    fn take<const N: usize>(&self) -> Result<[u8; N], Error> {
        self.bytes
            .get(self.offset..)
            .and_then(|rest| rest.first_chunk())
            .copied()
            .ok_or_else(|| Error::Record("the words end within a record".to_owned()))
    }

    fn u8(&self) -> Result<u8, Error> {
        Ok(u8::from_le_bytes(self.take()?))
    }

    fn u16(&self) -> Result<u16, Error> {
        Ok(u16::from_le_bytes(self.take()?))
    }

    fn u32(&self) -> Result<u32, Error> {
        Ok(u32::from_le_bytes(self.take()?))
    }

    fn u64(&self) -> Result<u64, Error> {
        Ok(u64::from_le_bytes(self.take()?))
    }

    fn flag(&self) -> Result<bool, Error> {
        match self.u8()? {
            0 => Ok(false),
            1 => Ok(true),
            other => Err(Error::Record(format!("{other} is neither true nor false"))),
        }
    }

    fn each<T: Copy + Default, const N: usize>(
        &self,
        size: usize,
        read: impl Fn(&Self) -> Result<T, Error>,
    ) -> Result<[T; N], Error> {
        let mut values = [T::default(); N];
        for (n, value) in values.iter_mut().enumerate() {
            *value = read(&Self {
                bytes: self.bytes,
                offset: self.offset + n * size,
            })?;
        }
        Ok(values)
    }

    fn imu(&self) -> Result<ImuSample, Error> {
        let at = |offset| Self {
            bytes: self.bytes,
            offset: self.offset + offset,
        };
        let raw = |offset| at(offset_of!(ImuSample, raw) + offset);
        let word = |field: &Self| Ok(field.u16()?.cast_signed());
        Ok(ImuSample {
            raw: ImuRaw {
                accel: raw(offset_of!(ImuRaw, accel)).each(2, word)?,
                gyro: raw(offset_of!(ImuRaw, gyro)).each(2, word)?,
                temperature: raw(offset_of!(ImuRaw, temperature)).u16()?.cast_signed(),
            },
            age_us: at(offset_of!(ImuSample, age_us)).u32()?,
        })
    }
}
