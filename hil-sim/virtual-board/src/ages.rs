//! Checks the ages of a tick's samples. The ages follow from the firmware's design and are equal on every board.

use firmware::flight_record::FlightRecord;
use model::sample::TICK_US;

/// A sample whose age contradicts the design.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("tick {tick}: the age of {sample} is {age_us} us, not {least_us} to {most_us} us")]
pub struct WrongAge {
    /// The tick.
    pub tick: u32,
    /// The name of the sample.
    pub sample: &'static str,
    /// The sample's age.
    pub age_us: u32,
    /// The least age by design.
    pub least_us: u32,
    /// The largest age by design.
    pub most_us: u32,
}

/// Checks the ages of one tick's samples. The tick reads the encoders. The IMU readings start in the tick, and the
/// control task waits at most 400 us for them. The analogue conversion starts half a tick earlier.
///
/// # Errors
/// The first sample with a wrong age. Before an IMU has started, its ticks have no sample.
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
    /// Longest wait of the control task plus the possible delay of its own start.
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
