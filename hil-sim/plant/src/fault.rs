//! Faults of a sensor.

/// A fault of one sensor.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum SensorFault {
    /// Works.
    #[default]
    None,
    /// No supply or a broken wire: nothing comes.
    Off,
    /// Answers, but what it says no longer changes.
    Stuck,
    /// Answers noise.
    Garbage,
    /// Mounted or wired the wrong way round.
    WrongSign,
    /// Too slow: an encoder loses every other edge, an IMU measures every 16 ms.
    Slow,
    /// What it says is [`DELAY_MS`] old.
    Delayed,
    /// Works and is off by turns, [`INTERMITTENT_MS`] each.
    Intermittent,
    /// An IMU's accelerometer is dead and its gyro works: every force reads zero. An encoder has none and works.
    NoForce,
}

/// Age of what a [`SensorFault::Delayed`] sensor says, in ms.
pub const DELAY_MS: u32 = 50;

/// Length of each turn of a [`SensorFault::Intermittent`] sensor, in ms.
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

    /// The name in scenario files.
    pub fn name(self) -> &'static str {
        match self {
            Self::None => "none",
            Self::Off => "off",
            Self::Stuck => "stuck",
            Self::Garbage => "garbage",
            Self::WrongSign => "wrong-sign",
            Self::Slow => "slow",
            Self::Delayed => "delayed",
            Self::Intermittent => "intermittent",
            Self::NoForce => "no-force",
        }
    }

    /// The fault called `name`.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|fault| fault.name() == name)
    }

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
