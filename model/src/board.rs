//! Conversions of a board's raw counts: typed values that each board supplies.

use crate::analog::{Analog, AnalogScale};

/// Scales of an IMU's registers at the ranges it is configured to.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ImuScales {
    /// Counts per deg/s of angular rate, > 0.
    pub gyro_lsb_per_deg_s: f32,
    /// Counts per g of specific force, > 0.
    pub accel_lsb_per_g: f32,
}

/// Scales of everything that a board converts, inputs and outputs.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BoardScales {
    /// Analogue inputs.
    pub analog: Analog<AnalogScale>,
    /// Largest duty of the board's bridges as a share of the supply, in (0, 1].
    pub duty_max: f32,
    /// Both IMUs.
    pub imu: ImuScales,
}

impl BoardScales {
    /// The measuring ranges of the board's analogue inputs.
    pub const fn sensor_ranges(&self) -> SensorRanges {
        SensorRanges::of(&self.analog)
    }
}

/// The largest values that a board's analogue inputs can distinguish from larger ones.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SensorRanges {
    /// Battery voltage, V.
    pub battery_max_v: f32,
    /// Magnitude of a motor current in either direction, A.
    pub current_max_a: f32,
}

/// Share of an input's full scale that counts as its measuring range. The rest allows for noise, offset and gain error.
const MEASURED_SHARE: f32 = 0.98;

impl SensorRanges {
    /// The measuring ranges of 16-bit conversions with these scales. The current range is the smallest of the motors'
    /// ranges.
    pub const fn of(scales: &Analog<AnalogScale>) -> Self {
        let mut current_max_a = f32::INFINITY;
        let currents = scales.currents();
        let mut motor = 0;
        while motor < currents.len() {
            let AnalogScale { per_count, zero_count } = currents[motor];
            let above = u16::MAX - zero_count;
            let counts = if above < zero_count { above } else { zero_count };
            let max_a = MEASURED_SHARE * counts as f32 * per_count;
            if max_a < current_max_a {
                current_max_a = max_a;
            }
            motor += 1;
        }
        Self {
            battery_max_v: MEASURED_SHARE * u16::MAX as f32 * scales.battery_voltage.per_count,
            current_max_a,
        }
    }
}

impl BoardScales {
    /// Scales of no board, for tests and examples: round numbers, so that nothing passes because it knows a board's own.
    pub const EXAMPLE: Self = Self {
        analog: {
            let current = AnalogScale {
                per_count: 0.002,
                zero_count: 32_000,
            };
            let mut analog = Analog::all(current);
            analog.battery_voltage = AnalogScale {
                per_count: 0.001,
                zero_count: 0,
            };
            analog
        },
        duty_max: 0.9,
        imu: ImuScales {
            gyro_lsb_per_deg_s: 30.0,
            accel_lsb_per_g: 4000.0,
        },
    };
}
