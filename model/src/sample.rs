//! The inputs and outputs of one tick, in the raw units of the hardware.
//!
//! A tick takes raw counts, computes in SI and returns raw counts, so a recorded [`Sample`] replays bit for bit.

use crate::analog::Analog;

/// The vehicle's motors, in the order of every per-motor array.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(usize)]
pub enum Motor {
    /// Left wheel (+y side).
    Left = 0,
    /// Right wheel (-y side).
    Right = 1,
    /// Ballast of the spar.
    Ballast = 2,
}

/// Number of motors.
pub const MOTORS: usize = 3;

/// The tick of the vehicle, us.
pub const TICK_US: u32 = 1000;
/// The tick of the vehicle, s.
pub const TICK_S: f32 = TICK_US as f32 * 1e-6;

/// One reading of an IMU in its registers' counts: axes x forward, y left, z up.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[repr(C)]
pub struct ImuRaw {
    /// Specific force in LSB ([`ImuScales::accel_lsb_per_g`](crate::board::ImuScales::accel_lsb_per_g)).
    pub accel: [i16; 3],
    /// Angular rate in LSB ([`ImuScales::gyro_lsb_per_deg_s`](crate::board::ImuScales::gyro_lsb_per_deg_s)).
    pub gyro: [i16; 3],
    /// Temperature in LSB; no decision depends on it.
    pub temperature: i16,
}

/// An IMU reading with its age when the tick began.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[repr(C)]
pub struct ImuSample {
    /// The reading.
    pub raw: ImuRaw,
    /// Age in us; `u32::MAX` before the first reading.
    pub age_us: u32,
}

/// Everything the vehicle senses in one tick.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(C)]
pub struct Sample {
    /// Time since boot in us.
    pub time_us: u64,
    /// Encoder counts, extended to 64 bits, forward positive: each wheel relative to the arm (theta + phi), the
    /// ballast relative to the spar.
    pub encoder_counts: [i64; MOTORS],
    /// Age of the encoder counts in us.
    pub encoder_age_us: u32,
    /// IMU on the arm.
    pub arm_imu: ImuSample,
    /// IMU on the spar.
    pub spar_imu: ImuSample,
    /// Analogue inputs, raw ([`BoardScales`](crate::board::BoardScales)).
    pub analog: Analog<u16>,
    /// Age of the analogue readings in us.
    pub analog_age_us: u32,
    /// The emergency stop is pressed (level of its pin).
    pub emergency_stop: bool,
    /// The break input's wire asks for a break (level of its pin): the emergency stop's second contact is open, or a
    /// bridge driver reports a fault.
    pub break_input: bool,
    /// The bridges' hardware break has tripped.
    pub bridge_break: bool,
    /// Findings of the board's self-test at boot: bit n is the blocker of number n. A set bit keeps the vehicle from
    /// arming until the next boot.
    pub board_blockers: u32,
}

/// Commands to the bridges for one tick.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(C)]
pub struct Actuation {
    /// The bridges are on. While false every output is open, whatever the duties say.
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
