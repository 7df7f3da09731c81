//! The ages of a tick's samples, which are facts of the firmware's design: equal on every board.

use firmware::flight_record::FlightRecord;
use model::sample::TICK_US;

/// A sample whose age is not what the design says.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("tick {tick}: the age of {sample} is {age_us} us, not {least_us} to {most_us} us")]
pub struct WrongAge {
    /// The tick.
    pub tick: u32,
    /// Which sample.
    pub sample: &'static str,
    /// Its age.
    pub age_us: u32,
    /// The least age by design.
    pub least_us: u32,
    /// The largest age by design.
    pub most_us: u32,
}

/// Checks the ages of one tick's samples: the encoders are read in the tick; the IMUs' samples were begun in it, and
/// the control task waits for them at most 400 us; the analogue reading was begun half a tick before.
///
/// # Errors
/// The first sample of another age. In the ticks before an IMU has started there is no sample of it yet.
///
/// ```
/// use firmware::flight_record::FlightRecord;
/// use virtual_board::ages::check;
/// fn first_wrong(records: &[FlightRecord]) -> Option<String> {
///     records.iter().find_map(|record| Some(check(record, true).err()?.to_string()))
/// }
/// assert_eq!(first_wrong(&[]), None);
/// ```
pub fn check(record: &FlightRecord, with_spar: bool) -> Result<(), WrongAge> {
    /// What the control task waits at most, and what its own start may take.
    const IN_THE_TICK_US: u32 = 450;
    let sample = &record.sample;
    let mut ages = vec![
        ("the encoder counts", sample.encoder_age_us, 0, 0),
        ("the arm IMU's sample", sample.arm_imu.age_us, 0, IN_THE_TICK_US),
        (
            "the analogue reading",
            sample.analog_age_us,
            TICK_US / 2 - 50,
            TICK_US / 2 + IN_THE_TICK_US,
        ),
    ];
    if with_spar {
        ages.push(("the spar IMU's sample", sample.spar_imu.age_us, 0, IN_THE_TICK_US));
    }
    for (name, age_us, least_us, most_us) in ages {
        if age_us < least_us || age_us > most_us {
            return Err(WrongAge {
                tick: record.tick,
                sample: name,
                age_us,
                least_us,
                most_us,
            });
        }
    }
    Ok(())
}
