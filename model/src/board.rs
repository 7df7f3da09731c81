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
