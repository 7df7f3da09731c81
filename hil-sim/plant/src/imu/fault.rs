//! The effect of faults on an IMU's samples, independent of the part model that reads them.

use crate::fault::{DELAY_MS, SensorFault};
use crate::noise::Noise;

/// Samples kept for [`SensorFault::Delayed`], at 1 kHz.
const DELAYED_SAMPLES: usize = DELAY_MS as usize;
/// A [`SensorFault::Slow`] part takes one of this many samples.
const SLOW: u32 = 16;
/// Magnitude of the garbage: the part's whole range, 16 g and 2000 deg/s.
const GARBAGE: [f64; 2] = [16.0 * model::vehicle::GRAVITY_M_S2, 34.9];

/// One sample: accelerometer x, y, z in m/s^2, gyro x, y, z in rad/s.
pub type ImuChannels = [f64; 6];

/// The faults of one IMU.
#[derive(Debug, Clone)]
pub(super) struct Faults {
    fault: SensorFault,
    ticks: u32,
    /// The sensor's last sample.
    last: ImuChannels,
    /// The last samples of a delayed sensor, the oldest first.
    history: [ImuChannels; DELAYED_SAMPLES],
}

impl Faults {
    pub(super) fn new() -> Self {
        Self {
            fault: SensorFault::None,
            ticks: 0,
            last: [0.0; 6],
            history: [[0.0; 6]; DELAYED_SAMPLES],
        }
    }

    pub(super) fn set(&mut self, fault: SensorFault) {
        self.fault = fault;
        self.history = [self.last; DELAYED_SAMPLES];
    }

    pub(super) fn fault(&self) -> SensorFault {
        self.fault
    }

    /// Whether the sensor takes no sample at this tick of its clock.
    pub(super) fn skips(&mut self) -> bool {
        self.ticks = self.ticks.wrapping_add(1);
        self.fault == SensorFault::Slow && !self.ticks.is_multiple_of(SLOW)
    }

    /// The sample that the faulty sensor gives instead of `measured`.
    #[inline]
    pub(super) fn give(&mut self, measured: ImuChannels, noise: &mut Noise) -> ImuChannels {
        if self.fault == SensorFault::None {
            self.last = measured;
            return measured;
        }
        self.last = match self.fault {
            SensorFault::Stuck => self.last,
            SensorFault::Garbage => core::array::from_fn(|i| {
                // Uniform from -1 to 1 with 53 bits.
                let share = (noise.bits() >> 10) as f64 / (1_u64 << 53) as f64 - 1.0;
                GARBAGE[i / 3] * share
            }),
            SensorFault::WrongSign => measured.map(|value| -value),
            SensorFault::Delayed => {
                self.history.rotate_left(1);
                let [old, .., newest] = &mut self.history;
                *newest = measured;
                *old
            }
            SensorFault::NoForce => {
                let [.., x, y, z] = measured;
                [0.0, 0.0, 0.0, x, y, z]
            }
            SensorFault::None | SensorFault::Off | SensorFault::Slow | SensorFault::Intermittent => measured,
        };
        self.last
    }
}
