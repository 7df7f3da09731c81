//! The effect of faults on an IMU's samples, independent of the part model that reads them.

use crate::fault::{DELAY_MS, SensorFault};
use crate::noise::Noise;

/// Samples kept for [`SensorFault::Delayed`], one for each millisecond.
const DELAYED_SAMPLES: usize = DELAY_MS as usize;
/// Time between two of them, s.
const DELAYED_PERIOD_S: f64 = 1e-3;
/// Time between two samples of a [`SensorFault::Slow`] part, s.
const SLOW_PERIOD_S: f64 = 16e-3;
/// Magnitude of the garbage: the part's whole range, 16 g and 2000 deg/s.
const GARBAGE: [f64; 2] = [16.0 * model::vehicle::GRAVITY_M_S2, 34.9];

/// One sample: accelerometer x, y, z in m/s^2, gyro x, y, z in rad/s.
pub type ImuChannels = [f64; 6];

/// The faults of one IMU.
#[derive(Debug, Clone)]
pub(super) struct Faults {
    fault: SensorFault,
    /// When a slow part next takes a sample, or a delayed one keeps one, s.
    next_s: f64,
    /// What the sensor last gave.
    last: ImuChannels,
    /// The last samples of a delayed sensor, the oldest first.
    history: [ImuChannels; DELAYED_SAMPLES],
}

impl Faults {
    pub(super) fn new() -> Self {
        Self {
            fault: SensorFault::None,
            next_s: 0.0,
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

    /// Whether the sensor takes no sample at the tick of its clock at `now_s`.
    #[inline]
    pub(super) fn skips(&mut self, now_s: f64) -> bool {
        self.fault == SensorFault::Slow && !self.is_due(now_s, SLOW_PERIOD_S)
    }

    /// Whether the next of the instants that come every `period_s` has come.
    fn is_due(&mut self, now_s: f64, period_s: f64) -> bool {
        // A nanosecond of slack: the steps' lengths are rounded.
        let late_s = now_s + 1e-9 - self.next_s;
        if late_s < 0.0 {
            return false;
        }
        self.next_s = period_s + if late_s > period_s { now_s } else { self.next_s };
        true
    }

    /// What the sensor gives at `now_s` where it should give `measured`.
    #[inline]
    pub(super) fn give(&mut self, now_s: f64, measured: ImuChannels, noise: &mut Noise) -> ImuChannels {
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
                if self.is_due(now_s, DELAYED_PERIOD_S) {
                    self.history.rotate_left(1);
                    let [.., newest] = &mut self.history;
                    *newest = measured;
                }
                let [old, ..] = &self.history;
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
