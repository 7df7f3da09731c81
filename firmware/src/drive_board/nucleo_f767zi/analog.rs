//! The channels of the STM32F767's converter.

use super::super::nucleo_144::ConverterPin;

/// Clock of the converter, a quarter of the bus clock, Hz.
pub const CONVERTER_HZ: u64 = 27_000_000;
/// Half cycles of that clock from one current's sample to the next: a sample of 15 cycles, and a conversion of 12 bits that takes
/// 12 more (RM0410 15.5).
pub const CURRENT_STEP_HALF_CYCLES: u64 = 54;

/// The channel of ADC1 that converts `pin` (DS11532, pin definitions).
pub const fn channel(pin: ConverterPin) -> u8 {
    match pin {
        ConverterPin::PA0 => 0,
        ConverterPin::PA1 => 1,
        ConverterPin::PA2 => 2,
        ConverterPin::PA3 => 3,
        ConverterPin::PA4 => 4,
        ConverterPin::PA5 => 5,
        ConverterPin::PA6 => 6,
        ConverterPin::PA7 => 7,
        ConverterPin::PB0 => 8,
        ConverterPin::PB1 => 9,
        ConverterPin::PC0 => 10,
        ConverterPin::PC1 => 11,
        ConverterPin::PC2 => 12,
        ConverterPin::PC3 => 13,
        ConverterPin::PC4 => 14,
        ConverterPin::PC5 => 15,
    }
}
