//! Conversions of a board's raw counts: typed values that each board supplies.

use crate::analog::{Analog, AnalogScale};

/// Largest duty of a bridge in either direction, in percent of the supply, for the drivers that the project uses. In the
/// rest of each period the bridge brakes: its switching half connects to the low side and charges the capacitor of a
/// bootstrapped high side. The analysis of a vehicle, which has no board to ask, uses this value too.
pub const DUTY_MAX_PERCENT: u32 = 94;

/// Scales of an IMU's registers at its configured ranges.
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
            battery_max_v: MEASURED_SHARE * u16::MAX as f32 * scales.battery.per_count,
            current_max_a,
        }
    }
}

impl BoardScales {
    /// Scales for tests and examples: numerically those of the first drive board.
    pub const EXAMPLE: Self = Self {
        analog: {
            let current = AnalogScale {
                per_count: 120.0 / 65536.0,
                zero_count: 32768,
            };
            let mut analog = Analog::all(current);
            analog.battery = AnalogScale {
                per_count: 66.0 / 65536.0,
                zero_count: 0,
            };
            analog
        },
        duty_max: DUTY_MAX_PERCENT as f32 / 100.0,
        imu: ImuScales {
            gyro_lsb_per_deg_s: 32.768,
            accel_lsb_per_g: 4096.0,
        },
    };
}
