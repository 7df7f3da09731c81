//! The analogue inputs on the NUCLEO-F767ZI. The build script reads this file too: a vehicle whose limits the inputs
//! cannot measure does not become firmware.

use model::analog::{Analog, AnalogInput, AnalogScale};
use model::board::SensorRanges;

/// A 12-bit conversion, left-aligned in 16 bits, of an amplifier with +-60 A around mid-scale: steps of 0.03 A.
const CURRENT: AnalogScale = AnalogScale {
    per_count: 120.0 / 65536.0,
    zero_count: 32768,
};

/// Channels of ADC1 and their scales.
pub const INPUTS: Analog<AnalogInput> = Analog {
    battery_voltage: AnalogInput {
        channel: 3,
        // A 12-bit conversion, left-aligned in 16 bits; 0 to 3.3 V behind a 1:20 divider.
        scale: AnalogScale {
            per_count: 66.0 / 65536.0,
            zero_count: 0,
        },
    },
    left_current: AnalogInput {
        channel: 10,
        scale: CURRENT,
    },
    right_current: AnalogInput {
        channel: 9,
        scale: CURRENT,
    },
    ballast_current: AnalogInput {
        channel: 4,
        scale: CURRENT,
    },
};

/// The inputs' measuring ranges.
pub const RANGES: SensorRanges = SensorRanges::of(&INPUTS.scales());
