//! The channels of the STM32H743's converter.

use super::super::nucleo_144::ConverterPin;

/// Clock of the converter, Hz.
pub const CONVERTER_HZ: u64 = 16_000_000;
/// Half cycles of that clock from one current's sample to the next: a sample of 8.5 cycles, and a conversion of 16 bits that takes
/// 8.5 more (RM0433 Table 214).
pub const CURRENT_STEP_HALF_CYCLES: u64 = 34;

/// The channel of ADC1 that converts `pin` (DS12110, pin definitions).
pub const fn channel(pin: ConverterPin) -> u8 {
    match pin {
        ConverterPin::PA0 => 16,
        ConverterPin::PA1 => 17,
        ConverterPin::PA2 => 14,
        ConverterPin::PA3 => 15,
        ConverterPin::PA4 => 18,
        ConverterPin::PA5 => 19,
        ConverterPin::PA6 => 3,
        ConverterPin::PA7 => 7,
        ConverterPin::PB0 => 9,
        ConverterPin::PB1 => 5,
        ConverterPin::PC0 => 10,
        ConverterPin::PC1 => 11,
        ConverterPin::PC2 => 12,
        ConverterPin::PC3 => 13,
        ConverterPin::PC4 => 4,
        ConverterPin::PC5 => 8,
    }
}
