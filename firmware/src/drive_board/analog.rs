//! What the drive board's analogue inputs stand for. The build script reads this file too: a vehicle whose limits the
//! inputs cannot measure does not become firmware.

use model::board::SensorRanges;

/// Battery voltage per count, V: a 16-bit conversion of 0 to 3.3 V behind a divider of 1:20.
pub const BATTERY_V_PER_COUNT: f32 = 66.0 / 65536.0;
/// Motor current per count, A: a 16-bit conversion of an amplifier of +-60 A around mid-scale.
pub const CURRENT_A_PER_COUNT: f32 = 120.0 / 65536.0;
/// Count at zero motor current.
pub const CURRENT_ZERO_COUNT: u16 = 32768;

/// What the inputs measure.
pub const RANGES: SensorRanges = SensorRanges::of(BATTERY_V_PER_COUNT, CURRENT_A_PER_COUNT, CURRENT_ZERO_COUNT);
