//! Clock tree: 400 MHz core, 200 MHz buses and timers, from the debugger's 8 MHz clock.

use embassy_stm32::Config;
use embassy_stm32::rcc::{
    AHBPrescaler, APBPrescaler, Hse, HseMode, LsConfig, Pll, PllDiv, PllMul, PllPreDiv, PllSource, Sysclk,
    VoltageScale, mux,
};
use embassy_stm32::time::Hertz;

/// Kernel clock of TIM1 to TIM8: twice the APB clock.
pub const TIMER_HZ: u32 = 200_000_000;

/// The clocks, and the interrupt priorities of the drivers.
pub fn config() -> Config {
    let mut config = Config::default();
    // The board has no crystal: the debugger drives OSC_IN.
    config.rcc.hse = Some(Hse {
        freq: Hertz(8_000_000),
        mode: HseMode::Bypass,
    });
    config.rcc.pll1 = Some(Pll {
        source: PllSource::HSE,
        prediv: PllPreDiv::DIV2,
        mul: PllMul::MUL200,
        fracn: None,
        divp: Some(PllDiv::DIV2),
        divq: Some(PllDiv::DIV8),
        divr: None,
    });
    config.rcc.sys = Sysclk::PLL1_P;
    config.rcc.ahb_pre = AHBPrescaler::DIV2;
    config.rcc.apb1_pre = APBPrescaler::DIV2;
    config.rcc.apb2_pre = APBPrescaler::DIV2;
    config.rcc.apb3_pre = APBPrescaler::DIV2;
    config.rcc.apb4_pre = APBPrescaler::DIV2;
    config.rcc.voltage_scale = VoltageScale::Scale1;
    // The firmware uses no calendar, whose clock source could be chosen only once per power-up.
    config.rcc.ls = LsConfig::off();
    // 64 MHz, which the converter's own prescaler halves into its range.
    config.rcc.mux.adcsel = mux::Adcsel::PER;
    config
}
