//! Faults of a sensor.

use serde::{Deserialize, Serialize};

/// A fault of one sensor, with a name of small letters and hyphens in files.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum SensorFault {
    /// The sensor works.
    #[default]
    None,
    /// No supply or a broken wire: no data arrive.
    Off,
    /// The sensor answers, but its data no longer change.
    Stuck,
    /// The sensor answers with noise.
    Garbage,
    /// The sensor is mounted or wired the wrong way round.
    WrongSign,
    /// Too slow: an encoder loses every other edge, an IMU measures every 16 ms.
    Slow,
    /// The data are [`DELAY_MS`] old.
    Delayed,
    /// The sensor alternately works and is off, [`INTERMITTENT_MS`] each.
    Intermittent,
    /// An IMU's accelerometer is dead while its gyro works: every force reads zero. An encoder has no
    /// accelerometer and works.
    NoForce,
}

/// Age of the data of a [`SensorFault::Delayed`] sensor, in ms.
pub const DELAY_MS: u32 = 50;

/// Length of each phase of a [`SensorFault::Intermittent`] sensor, in ms.
pub const INTERMITTENT_MS: u32 = 20;

impl SensorFault {
    /// Every fault, [`SensorFault::None`] first.
    pub const ALL: [Self; 9] = [
        Self::None,
        Self::Off,
        Self::Stuck,
        Self::Garbage,
        Self::WrongSign,
        Self::Slow,
        Self::Delayed,
        Self::Intermittent,
        Self::NoForce,
    ];

    /// Whether the sensor is dead at `time_ms`: [`SensorFault::Off`], or the off turn of
    /// [`SensorFault::Intermittent`].
    pub fn is_dead_at(self, time_ms: u64) -> bool {
        match self {
            Self::Off => true,
            Self::Intermittent => (time_ms / u64::from(INTERMITTENT_MS)) % 2 == 1,
            _ => false,
        }
    }
}
