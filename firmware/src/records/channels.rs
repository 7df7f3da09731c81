//! A flight record as a row of numbers, and back: to the bit.

use model::command::{Command, Request};
use model::sample::{Actuation, ImuRaw, ImuSample, MOTORS, Sample, TICK_US};

use crate::flight_record::FlightRecord;

/// Numbers of a record.
pub const CHANNELS: usize = 34;

/// Bits of the channel of flags.
const EMERGENCY_STOP: i64 = 1;
const BRIDGE_BREAK: i64 = 2;
const PARAMETERS_PENDING: i64 = 4;
const ENABLE: i64 = 8;
/// The request stands above the flags.
const REQUEST_SHIFT: u32 = 4;

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
    let [left, right, ballast] = sample.encoder_counts;
    let [left_current, right_current, ballast_current] = sample.current.map(i64::from);
    let [left_duty, right_duty, ballast_duty] = actuation.duty.map(i64::from);
    let arm = imu(&sample.arm_imu);
    let spar = imu(&sample.spar_imu);
    let flag = |set: bool, bit: i64| if set { bit } else { 0 };
    let flags = flag(sample.emergency_stop, EMERGENCY_STOP)
        | flag(sample.bridge_break, BRIDGE_BREAK)
        | flag(command.parameters_pending, PARAMETERS_PENDING)
        | flag(actuation.enable, ENABLE)
        | i64::from(command.request as u8) << REQUEST_SHIFT;
    [
        i64::from(*tick),
        sample.time_us.cast_signed(),
        i64::from(command.age_us),
        left,
        right,
        ballast,
        i64::from(sample.encoder_age_us),
        i64::from(sample.analog_age_us),
        i64::from(sample.battery),
        left_current,
        right_current,
        ballast_current,
        arm[0],
        arm[1],
        arm[2],
        arm[3],
        arm[4],
        arm[5],
        arm[6],
        arm[7],
        spar[0],
        spar[1],
        spar[2],
        spar[3],
        spar[4],
        spar[5],
        spar[6],
        spar[7],
        i64::from(command.speed_m_s.to_bits()),
        i64::from(command.yaw_rate_rad_s.to_bits()),
        flags,
        left_duty,
        right_duty,
        ballast_duty,
    ]
}

/// What a tick adds to the numbers of the one before it, when nothing happens: one tick, its time, and the age of the
/// command.
pub const EXPECTED: Row = {
    let mut expected = [0; CHANNELS];
    expected[0] = 1;
    expected[1] = TICK_US as i64;
    expected[2] = TICK_US as i64;
    expected
};

fn imu(sample: &ImuSample) -> [i64; 8] {
    let ImuSample { raw, age_us } = sample;
    let [ax, ay, az] = raw.accel.map(i64::from);
    let [gx, gy, gz] = raw.gyro.map(i64::from);
    [ax, ay, az, gx, gy, gz, i64::from(raw.temperature), i64::from(*age_us)]
}

/// The record of a row; `None` if a number does not fit its field.
pub fn record(row: &Row) -> Option<FlightRecord> {
    let [
        tick,
        time_us,
        command_age_us,
        left,
        right,
        ballast,
        encoder_age_us,
        analog_age_us,
        battery,
        left_current,
        right_current,
        ballast_current,
        rest @ ..,
    ] = *row;
    let (arm, rest) = rest.split_first_chunk::<8>()?;
    let (spar, rest) = rest.split_first_chunk::<8>()?;
    let [speed, yaw_rate, flags, left_duty, right_duty, ballast_duty] = *<&[i64; 6]>::try_from(rest).ok()?;
    let request = match flags >> REQUEST_SHIFT {
        0 => Request::None,
        1 => Request::Arm,
        2 => Request::Disarm,
        3 => Request::ClearFaults,
        _ => return None,
    };
    let mut current = [0; MOTORS];
    for (slot, count) in current.iter_mut().zip([left_current, right_current, ballast_current]) {
        *slot = u16::try_from(count).ok()?;
    }
    let mut duty = [0; MOTORS];
    for (slot, value) in duty.iter_mut().zip([left_duty, right_duty, ballast_duty]) {
        *slot = i16::try_from(value).ok()?;
    }
    Some(FlightRecord {
        tick: u32::try_from(tick).ok()?,
        sample: Sample {
            time_us: time_us.cast_unsigned(),
            encoder_counts: [left, right, ballast],
            encoder_age_us: u32::try_from(encoder_age_us).ok()?,
            arm_imu: imu_sample(arm)?,
            spar_imu: imu_sample(spar)?,
            battery: u16::try_from(battery).ok()?,
            current,
            analog_age_us: u32::try_from(analog_age_us).ok()?,
            emergency_stop: flags & EMERGENCY_STOP != 0,
            bridge_break: flags & BRIDGE_BREAK != 0,
        },
        command: Command {
            speed_m_s: f32::from_bits(u32::try_from(speed).ok()?),
            yaw_rate_rad_s: f32::from_bits(u32::try_from(yaw_rate).ok()?),
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

fn imu_sample(channels: &[i64; 8]) -> Option<ImuSample> {
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
