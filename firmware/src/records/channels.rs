//! Converts a flight record to a row of numbers and back, bit for bit.

use model::analog::{ANALOG_INPUTS, Analog};
use model::command::{Command, DriveCommand, Request};
use model::sample::{Actuation, ImuRaw, ImuSample, MOTORS, Sample, TICK_US};

use crate::flight_record::FlightRecord;

/// Numbers of an IMU's sample: specific force, angular rate, temperature, age.
const IMU: usize = 3 + 3 + 1 + 1;
/// Numbers of a record: tick and its time; age of the command; encoder counts; ages of encoders and analogue readings;
/// analogue readings; the IMUs; the drive command; flags; duties.
pub const CHANNELS: usize = 2 + 1 + MOTORS + 2 + ANALOG_INPUTS + 2 * IMU + DriveCommand::QUANTITIES + 1 + MOTORS;

/// Bits of the channel of flags.
const EMERGENCY_STOP: i64 = 1;
const BRIDGE_BREAK: i64 = 2;
const PARAMETERS_PENDING: i64 = 4;
const ENABLE: i64 = 8;
const BREAK_INPUT: i64 = 16;
/// The request's number stands above the flags.
const REQUEST_SHIFT: u32 = 5;
/// The board's blockers stand above the request.
const BLOCKERS_SHIFT: u32 = REQUEST_SHIFT + u8::BITS;

/// The numbers of a record.
pub type Row = [i64; CHANNELS];

/// The record as a row.
pub fn row(record: &FlightRecord) -> Row {
    let FlightRecord {
        tick,
        sample,
        command,
        actuation,
    } = record;
    let flag = |set: bool, bit: i64| if set { bit } else { 0 };
    let flags = flag(sample.emergency_stop, EMERGENCY_STOP)
        | flag(sample.bridge_break, BRIDGE_BREAK)
        | flag(sample.break_input, BREAK_INPUT)
        | flag(command.parameters_pending, PARAMETERS_PENDING)
        | flag(actuation.enable, ENABLE)
        | i64::from(command.request as u8) << REQUEST_SHIFT
        | i64::from(sample.board_blockers) << BLOCKERS_SHIFT;
    let mut row = [0; CHANNELS];
    let mut slots = row.iter_mut();
    let mut put = |numbers: &[i64]| {
        for (number, slot) in numbers.iter().zip(slots.by_ref()) {
            *slot = *number;
        }
    };
    put(&[
        i64::from(*tick),
        sample.time_us.cast_signed(),
        i64::from(command.age_us),
    ]);
    put(&sample.encoder_counts);
    put(&[i64::from(sample.encoder_age_us), i64::from(sample.analog_age_us)]);
    put(&sample.analog.values().map(i64::from));
    put(&imu(&sample.arm_imu));
    put(&imu(&sample.spar_imu));
    put(&command.drive.values().map(|value| i64::from(value.to_bits())));
    put(&[flags]);
    put(&actuation.duty.map(i64::from));
    row
}

/// The expected change of the numbers from tick to tick when nothing happens: one tick, its time, and the age of the
/// command.
pub const EXPECTED: Row = {
    let mut expected = [0; CHANNELS];
    expected[0] = 1;
    expected[1] = TICK_US as i64;
    expected[2] = TICK_US as i64;
    expected
};

fn imu(sample: &ImuSample) -> [i64; IMU] {
    let ImuSample { raw, age_us } = sample;
    let [ax, ay, az] = raw.accel.map(i64::from);
    let [gx, gy, gz] = raw.gyro.map(i64::from);
    [ax, ay, az, gx, gy, gz, i64::from(raw.temperature), i64::from(*age_us)]
}

/// The record of a row; `None` if a number does not fit its field.
pub fn record(row: &Row) -> Option<FlightRecord> {
    let rest = &mut &row[..];
    let [tick, time_us, command_age_us] = take(rest)?;
    let encoder_counts = take(rest)?;
    let [encoder_age_us, analog_age_us] = take(rest)?;
    let readings = take::<ANALOG_INPUTS>(rest)?;
    let (arm, spar) = (take(rest)?, take(rest)?);
    let quantities = take::<{ DriveCommand::QUANTITIES }>(rest)?;
    let [flags] = take(rest)?;
    let duties = take::<MOTORS>(rest)?;
    let request = Request::from_number((flags >> REQUEST_SHIFT) as u8)?;
    let mut drive = [0.0; DriveCommand::QUANTITIES];
    for (slot, bits) in drive.iter_mut().zip(quantities) {
        *slot = f32::from_bits(u32::try_from(bits).ok()?);
    }
    let mut analog = [0; ANALOG_INPUTS];
    for (slot, count) in analog.iter_mut().zip(readings) {
        *slot = u16::try_from(count).ok()?;
    }
    let mut duty = [0; MOTORS];
    for (slot, value) in duty.iter_mut().zip(duties) {
        *slot = i16::try_from(value).ok()?;
    }
    Some(FlightRecord {
        tick: u32::try_from(tick).ok()?,
        sample: Sample {
            time_us: time_us.cast_unsigned(),
            encoder_counts,
            encoder_age_us: u32::try_from(encoder_age_us).ok()?,
            arm_imu: imu_sample(&arm)?,
            spar_imu: imu_sample(&spar)?,
            analog: Analog::from_values(analog),
            analog_age_us: u32::try_from(analog_age_us).ok()?,
            emergency_stop: flags & EMERGENCY_STOP != 0,
            break_input: flags & BREAK_INPUT != 0,
            bridge_break: flags & BRIDGE_BREAK != 0,
            board_blockers: u32::try_from(flags >> BLOCKERS_SHIFT).ok()?,
        },
        command: Command {
            drive: DriveCommand::from_values(drive),
            age_us: u32::try_from(command_age_us).ok()?,
            request,
            parameters_pending: flags & PARAMETERS_PENDING != 0,
        },
        actuation: Actuation {
            enable: flags & ENABLE != 0,
            duty,
        },
    })
}

/// Takes the next numbers of a row.
fn take<const N: usize>(rest: &mut &[i64]) -> Option<[i64; N]> {
    let (numbers, after) = rest.split_first_chunk()?;
    *rest = after;
    Some(*numbers)
}

fn imu_sample(channels: &[i64; IMU]) -> Option<ImuSample> {
    let [ax, ay, az, gx, gy, gz, temperature, age_us] = *channels;
    let count = |value: i64| i16::try_from(value).ok();
    Some(ImuSample {
        raw: ImuRaw {
            accel: [count(ax)?, count(ay)?, count(az)?],
            gyro: [count(gx)?, count(gy)?, count(gz)?],
            temperature: count(temperature)?,
        },
        age_us: u32::try_from(age_us).ok()?,
    })
}
