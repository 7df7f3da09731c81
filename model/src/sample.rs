//! What the vehicle senses and commands in one tick, in the raw units of the hardware.
//!
//! Raw counts in, SI inside, raw counts out: a recorded [`Sample`] replays bit for bit.

/// The vehicle's motors, in the order of every per-motor array.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(usize)]
pub enum Motor {
    /// Left wheel (+y side).
    Left = 0,
    /// Right wheel (-y side).
    Right = 1,
    /// Ballast of the camera spar.
    Ballast = 2,
}

/// Number of motors.
pub const MOTORS: usize = 3;

/// The tick of the vehicle, us.
pub const TICK_US: u32 = 1000;

/// Full-scale ranges the IMUs are configured to.
pub mod imu_scale {
    /// Gyro: +-1000 deg/s over the 16-bit range, in LSB per deg/s.
    pub const GYRO_LSB_PER_DEG_S: f32 = 32.8;
    /// Accelerometer: +-8 g over the 16-bit range, in LSB per g.
    pub const ACCEL_LSB_PER_G: f32 = 4096.0;
}

/// Scales of the analogue inputs, 16-bit conversions of 0 to 3.3 V.
pub mod analog_scale {
    /// Battery voltage a count: a divider of 1:20 (66 V full scale).
    pub const BATTERY_V_PER_COUNT: f32 = 66.0 / 65536.0;
    /// Motor current a count: +-60 A around mid-scale.
    pub const CURRENT_A_PER_COUNT: f32 = 120.0 / 65536.0;
    /// Count at zero current.
    pub const CURRENT_ZERO_COUNT: u16 = 32768;
}

/// One reading of an ICM-42688-P, as its registers hold it: axes x forward, y left, z up.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[repr(C)]
pub struct ImuRaw {
    /// Specific force in LSB ([`imu_scale::ACCEL_LSB_PER_G`]).
    pub accel: [i16; 3],
    /// Angular rate in LSB ([`imu_scale::GYRO_LSB_PER_DEG_S`]).
    pub gyro: [i16; 3],
    /// Temperature in LSB (132.48 LSB/K around 25 C).
    pub temperature: i16,
}

/// An IMU reading with its age when the tick began.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[repr(C)]
pub struct ImuSample {
    /// The reading.
    pub raw: ImuRaw,
    /// Age in us; `u32::MAX` while there has been none.
    pub age_us: u32,
}

/// Everything the vehicle senses in one tick.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(C)]
pub struct Sample {
    /// Time since boot in us.
    pub time_us: u64,
    /// Encoder counts, extended to 64 bits: wheel relative to the arm (theta + phi), forward positive;
    /// for the camera the ballast relative to the spar.
    pub encoder_counts: [i64; MOTORS],
    /// Age of the encoder counts in us.
    pub encoder_age_us: u32,
    /// IMU on the reaction-mass arm.
    pub arm_imu: ImuSample,
    /// IMU on the camera spar.
    pub spar_imu: ImuSample,
    /// Battery voltage, raw.
    pub battery: u16,
    /// Motor currents, raw.
    pub current: [u16; MOTORS],
    /// Age of the analogue readings in us.
    pub analog_age_us: u32,
    /// The emergency stop is pressed (level of its pin).
    pub emergency_stop: bool,
    /// The bridges' hardware break has tripped.
    pub bridge_break: bool,
}

/// What the bridges do in one tick.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(C)]
pub struct Actuation {
    /// Bridges on. While false every output is open, whatever the duties say.
    pub enable: bool,
    /// Signed duty of each motor: -32767 to 32767 is -100 % to 100 % of the supply, forward positive.
    pub duty: [i16; MOTORS],
}

impl Actuation {
    /// The safe state: every bridge open.
    pub const SAFE: Self = Self {
        enable: false,
        duty: [0; MOTORS],
    };
}
