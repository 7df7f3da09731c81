//! What a board's raw counts stand for: typed values that each board supplies.

use crate::analog::{Analog, AnalogScale};

/// Largest duty of a bridge either way, in percent of the supply, with the drivers that the project is made for: the rest
/// of each period brakes, so that the switching half of the bridge visits the low side and charges the capacitor of a
/// bootstrapped high side. What has no board to ask, the analysis of a vehicle, reckons with this one too.
pub const DUTY_MAX_PERCENT: u32 = 94;

/// Scales of an IMU's registers at the ranges it is configured to.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ImuScales {
    /// Counts per deg/s of angular rate, > 0.
    pub gyro_lsb_per_deg_s: f32,
    /// Counts per g of specific force, > 0.
    pub accel_lsb_per_g: f32,
}

/// Scales of everything a board converts, in both directions.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BoardScales {
    /// Analogue inputs.
    pub analog: Analog<AnalogScale>,
    /// Largest duty of a bridge as a share of the supply, in (0, 1]: the board's bridges give no more.
    pub duty_max: f32,
    /// Both IMUs.
    pub imu: ImuScales,
}

impl BoardScales {
    /// What the board's analogue inputs measure.
    pub const fn sensor_ranges(&self) -> SensorRanges {
        SensorRanges::of(&self.analog)
    }
}

/// The largest values that a board's analogue inputs can distinguish from larger ones.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SensorRanges {
    /// Battery voltage, V.
    pub battery_max_v: f32,
    /// Size of a motor current, either way, A.
    pub current_max_a: f32,
}

/// Share of an input's full scale that counts as measured: the rest is for noise, offset and gain.
const MEASURED_SHARE: f32 = 0.98;

impl SensorRanges {
    /// The ranges of 16-bit conversions of these scales; of the motors' currents the least.
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
    /// Scales for tests and examples: numerically those of the first drive board.
    pub const EXAMPLE: Self = Self {
        analog: {
            let current = AnalogScale {
                per_count: 120.0 / 65536.0,
                zero_count: 32768,
            };
            let mut analog = Analog::all(current);
            analog.battery_voltage = AnalogScale {
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
