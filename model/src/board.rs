//! What a board's raw counts stand for: typed values that each board supplies.

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
    /// Battery voltage per count, V, > 0.
    pub battery_v_per_count: f32,
    /// Motor current per count, A, > 0.
    pub current_a_per_count: f32,
    /// Count at zero motor current.
    pub current_zero_count: u16,
    /// Largest duty of a bridge as a share of the supply, in (0, 1]: the board's bridges give no more.
    pub duty_max: f32,
    /// Both IMUs.
    pub imu: ImuScales,
}

impl BoardScales {
    /// What the board's analogue inputs measure.
    pub const fn sensor_ranges(&self) -> SensorRanges {
        SensorRanges::of(
            self.battery_v_per_count,
            self.current_a_per_count,
            self.current_zero_count,
        )
    }
}

/// The largest values that a board's analogue inputs can tell from larger ones.
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
    /// The ranges of 16-bit conversions of these scales.
    pub const fn of(battery_v_per_count: f32, current_a_per_count: f32, current_zero_count: u16) -> Self {
        let above = u16::MAX - current_zero_count;
        let counts = if above < current_zero_count {
            above
        } else {
            current_zero_count
        };
        Self {
            battery_max_v: MEASURED_SHARE * u16::MAX as f32 * battery_v_per_count,
            current_max_a: MEASURED_SHARE * counts as f32 * current_a_per_count,
        }
    }
}

#[cfg(test)]
impl BoardScales {
    /// Scales for tests: round numbers, but for those whose rounding matters.
    pub(crate) const TEST: Self = Self {
        battery_v_per_count: 66.0 / 65536.0,
        current_a_per_count: 120.0 / 65536.0,
        current_zero_count: 32768,
        duty_max: 0.94,
        imu: ImuScales {
            gyro_lsb_per_deg_s: 32.8,
            accel_lsb_per_g: 4096.0,
        },
    };
}
