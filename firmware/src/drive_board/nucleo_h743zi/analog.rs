//! The drive board's analogue inputs. The build script reads this file too: a vehicle whose limits the inputs cannot
//! measure does not become firmware.

use model::analog::{Analog, AnalogInput, AnalogScale};
use model::board::SensorRanges;

/// A 16-bit conversion of an amplifier with +-60 A around mid-scale.
const CURRENT: AnalogScale = AnalogScale {
    per_count: 120.0 / 65536.0,
    zero_count: 32768,
};

/// Channels of ADC1 and their scales.
pub const INPUTS: Analog<AnalogInput> = Analog {
    battery_voltage: AnalogInput {
        channel: 15,
        // A 16-bit conversion of 0 to 3.3 V behind a divider of 1:20.
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
        channel: 5,
        scale: CURRENT,
    },
    ballast_current: AnalogInput {
        channel: 18,
        scale: CURRENT,
    },
};

/// The inputs' measuring ranges.
pub const RANGES: SensorRanges = SensorRanges::of(&INPUTS.scales());
