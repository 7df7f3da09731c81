//! Addresses, codes and times of the ICM-42688-P (bank 0 unless noted).

/// Read bit of the address byte.
pub const READ: u8 = 0x80;
/// Soft reset.
pub const DEVICE_CONFIG: u8 = 0x11;
/// Reset bit of [`DEVICE_CONFIG`].
pub const DEVICE_CONFIG_RESET: u8 = 0x01;
/// Temperature, high byte: first of the data registers (big-endian words).
pub const TEMP_DATA1: u8 = 0x1d;
/// Gyro z, low byte: last of the data registers.
pub const GYRO_DATA_Z0: u8 = 0x2a;
/// Interrupt status, cleared by reading.
pub const INT_STATUS: u8 = 0x2d;
/// New data.
pub const INT_STATUS_DATA_READY: u8 = 0x08;
/// A reset is done.
pub const INT_STATUS_RESET_DONE: u8 = 0x10;
/// Interface configuration 1: among others, the adaptive full scale (bits 7:6).
pub const INTF_CONFIG1: u8 = 0x4d;
/// Bits of the adaptive full scale ("AFSR") in [`INTF_CONFIG1`].
pub const ADAPTIVE_FULL_SCALE: u8 = 0xc0;
/// Value of these bits that switches the adaptive full scale off. With any other value, including the reset value, the
/// adaptive full scale is on.
pub const ADAPTIVE_FULL_SCALE_OFF: u8 = 0x40;
/// Power of gyro (bits 3:2) and accelerometer (1:0).
pub const PWR_MGMT0: u8 = 0x4e;
/// Low-noise mode, of either sensor.
pub const MODE_LOW_NOISE: u8 = 3;
/// Gyro full scale (7:5) and data rate (3:0).
pub const GYRO_CONFIG0: u8 = 0x4f;
/// Accelerometer full scale (7:5) and data rate (3:0).
pub const ACCEL_CONFIG0: u8 = 0x50;
/// Filter bandwidths: accelerometer (7:4), gyro (3:0).
pub const GYRO_ACCEL_CONFIG0: u8 = 0x52;
/// Identity.
pub const WHO_AM_I: u8 = 0x75;
/// Value of [`WHO_AM_I`].
pub const WHO_AM_I_VALUE: u8 = 0x47;
/// Bank selection, present in every bank.
pub const REG_BANK_SEL: u8 = 0x76;

/// Registers of bank 0 that are not 0 after a reset (data registers apart).
pub const RESET_VALUES: &[(u8, u8)] = &[
    (0x13, 0x05),
    (INT_STATUS, INT_STATUS_RESET_DONE),
    (0x4c, 0x30),
    (INTF_CONFIG1, 0x91),
    (GYRO_CONFIG0, 0x06),
    (ACCEL_CONFIG0, 0x06),
    (0x51, 0x16),
    (GYRO_ACCEL_CONFIG0, 0x11),
    (0x53, 0x0d),
    (0x64, 0x10),
    (0x65, 0x10),
    (WHO_AM_I, WHO_AM_I_VALUE),
];

/// Time after a reset before the part answers, in s.
pub const RESET_S: f64 = 0.001;
/// From switching the gyro on to its first valid data, in s.
pub const GYRO_START_S: f64 = 0.030;
/// From switching the accelerometer on to its first valid data, in s.
pub const ACCEL_START_S: f64 = 0.010;
/// Temperature counts per K, zero at 25 C.
pub const TEMPERATURE_LSB_PER_K: f64 = 132.48;

/// Data rate of a configuration register's code in Hz; `None` for a reserved code.
pub fn data_rate_hz(config: u8) -> Option<f64> {
    Some(match config & 0x0f {
        1 => 32e3,
        2 => 16e3,
        3 => 8e3,
        4 => 4e3,
        5 => 2e3,
        6 => 1e3,
        7 => 200.0,
        8 => 100.0,
        9 => 50.0,
        10 => 25.0,
        11 => 12.5,
        15 => 500.0,
        _ => return None,
    })
}

/// Gyro sensitivity of GYRO_CONFIG0: +-2000 deg/s, halved by each code; 2^15 counts over the full scale, which the data
/// sheet rounds to 16.4, 32.8, 65.5, ...
pub fn gyro_lsb_per_deg_s(config: u8) -> f64 {
    16.384 * f64::from(1_u32 << (config >> 5))
}

/// Accelerometer sensitivity of ACCEL_CONFIG0: +-16 g, halved by each code (four are used).
pub fn accel_lsb_per_g(config: u8) -> f64 {
    [2048.0, 4096.0, 8192.0, 16384.0][usize::from(config >> 5 & 3)]
}

/// -3 dB point of the gyro's filter at the data rate `rate_hz`.
pub fn bandwidth_hz(config: u8, rate_hz: f64) -> f64 {
    match config & 0x0f {
        0 => rate_hz / 2.0,
        code => {
            let divisor = [4.0, 5.0, 8.0, 10.0, 16.0, 20.0, 40.0][usize::from(code.min(7)) - 1];
            rate_hz.max(400.0) / divisor
        }
    }
}
