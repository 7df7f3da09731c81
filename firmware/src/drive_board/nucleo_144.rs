//! The analogue inputs at the connectors of the NUCLEO-144 boards. The connectors lead to the same pins of every such part, so
//! that one power stage fits all of them. The build script reads this file too: a vehicle whose limits the inputs cannot
//! measure does not become firmware.

use model::analog::{Analog, AnalogInput, AnalogScale};
use model::board::SensorRanges;

/// A pin that ADC1 of every part on these boards converts (DS12110 and DS11532, pin definitions).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[allow(missing_docs)]
pub enum ConverterPin {
    PA0,
    PA1,
    PA2,
    PA3,
    PA4,
    PA5,
    PA6,
    PA7,
    PB0,
    PB1,
    PC0,
    PC1,
    PC2,
    PC3,
    PC4,
    PC5,
}

/// An amplifier with +-60 A around mid-scale.
const CURRENT: AnalogScale = AnalogScale {
    per_count: 120.0 / 65536.0,
    zero_count: 32768,
};

/// Pins and scales. A conversion of 0 to 3.3 V has 16 bits; a converter of 12 bits aligns them left.
pub const INPUTS: Analog<AnalogInput<ConverterPin>> = Analog {
    battery_voltage: AnalogInput {
        pin: ConverterPin::PA3,
        // Behind a divider of 1:20.
        scale: AnalogScale {
            per_count: 66.0 / 65536.0,
            zero_count: 0,
        },
    },
    left_current: AnalogInput {
        pin: ConverterPin::PC0,
        scale: CURRENT,
    },
    right_current: AnalogInput {
        pin: ConverterPin::PB1,
        scale: CURRENT,
    },
    ballast_current: AnalogInput {
        pin: ConverterPin::PA4,
        scale: CURRENT,
    },
};

/// The inputs' measuring ranges.
pub const RANGES: SensorRanges = SensorRanges::of(&INPUTS.scales());
