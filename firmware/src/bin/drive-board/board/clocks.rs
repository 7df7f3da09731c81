//! Clock tree: 400 MHz core, 200 MHz buses and timers, from the debugger's 8 MHz clock, or from the part's own
//! oscillator if that clock is missing.

use embassy_stm32::Config;
use embassy_stm32::pac;
use embassy_stm32::rcc::{
    AHBPrescaler, APBPrescaler, LsConfig, Pll, PllDiv, PllMul, PllPreDiv, PllSource, Sysclk, VoltageScale, mux,
};
use firmware::drive_board::nucleo_h743zi::CORE_CLOCK_HZ;
use firmware::hardware::ClockSource;

use super::stm32_registers::external_clock;

/// Kernel clock of TIM1 to TIM8: twice the APB clock, which is a quarter of the core's.
pub const TIMER_HZ: u32 = CORE_CLOCK_HZ / 2;

/// Tries to start the external clock and returns the configuration of the clocks and of the drivers' interrupt
/// priorities for the available clock. Every frequency is the same with either clock.
pub fn config() -> (Config, ClockSource) {
    let mut config = Config::default();
    config.rcc.hse = external_clock::start();
    let (clock, source, prediv) = if config.rcc.hse.is_some() {
        (ClockSource::External, PllSource::HSE, PllPreDiv::DIV2)
    } else {
        // 64 MHz, within 1 % at room temperature.
        (ClockSource::Internal, PllSource::HSI, PllPreDiv::DIV16)
    };
    // 4 MHz in, 800 MHz inside, 400 MHz out.
    config.rcc.pll1 = Some(Pll {
        source,
        prediv,
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
    (config, clock)
}

/// Switches the clock security system on permanently: when the external clock stops, the part continues with its own
/// oscillator, trips the bridges' break and calls the non-maskable interrupt (`NonMaskableInt` in `stm32/crash.rs`).
pub fn watch_external_clock() {
    pac::RCC.cr().modify(|w| w.set_hsecsson(true));
}

/// Whether the external clock stopped. Clears the flag, which would otherwise call the non-maskable interrupt again.
pub fn external_clock_stopped() -> bool {
    let stopped = pac::RCC.cifr().read().hsecssf();
    if stopped {
        pac::RCC.cicr().write(|w| w.set_hsecssc(true));
    }
    stopped
}
