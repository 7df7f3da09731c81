//! Clock tree: 216 MHz core and TIM1, 108 MHz encoders' timers, from the debugger's 8 MHz clock, or from the part's own
//! oscillator if that clock is missing.

use embassy_stm32::Config;
use embassy_stm32::pac;
use embassy_stm32::rcc::{
    AHBPrescaler, APBPrescaler, LsConfig, Pll, PllMul, PllPDiv, PllPreDiv, PllQDiv, PllSource, Sysclk,
};
use firmware::drive_board::nucleo_f767zi::CORE_CLOCK_HZ;
use firmware::hardware::ClockSource;

use super::stm32_registers::external_clock;

/// Kernel clock of TIM1: twice the clock of its bus, which is half of the core's.
pub const TIMER_HZ: u32 = CORE_CLOCK_HZ;

/// Tries to start the external clock and returns the configuration of the clocks and of the drivers' interrupt
/// priorities for the available clock. Every frequency is the same with either clock.
pub fn config() -> (Config, ClockSource) {
    let mut config = Config::default();
    config.rcc.hse = external_clock::start();
    let (clock, source, prediv) = if config.rcc.hse.is_some() {
        (ClockSource::External, PllSource::HSE, PllPreDiv::DIV4)
    } else {
        // 16 MHz, within 1 % at room temperature.
        (ClockSource::Internal, PllSource::HSI, PllPreDiv::DIV8)
    };
    config.rcc.pll_src = source;
    // 2 MHz in, 432 MHz inside, 216 MHz out, and the 48 MHz of the random number generator.
    config.rcc.pll = Some(Pll {
        prediv,
        mul: PllMul::MUL216,
        divp: Some(PllPDiv::DIV2),
        divq: Some(PllQDiv::DIV9),
        divr: None,
    });
    config.rcc.sys = Sysclk::PLL1_P;
    config.rcc.ahb_pre = AHBPrescaler::DIV1;
    config.rcc.apb1_pre = APBPrescaler::DIV4;
    config.rcc.apb2_pre = APBPrescaler::DIV2;
    // The firmware uses no calendar, whose clock source could be chosen only once per power-up.
    config.rcc.ls = LsConfig::off();
    (config, clock)
}

/// Switches the clock security system on permanently: when the external clock stops, the part continues with its own
/// oscillator, trips the bridges' break and calls the non-maskable interrupt (`NonMaskableInt` in `stm32/crash.rs`).
pub fn watch_external_clock() {
    pac::RCC.cr().modify(|w| w.set_csson(true));
}

/// Whether the external clock stopped. Clears the flag, which would otherwise call the non-maskable interrupt again.
pub fn external_clock_stopped() -> bool {
    let stopped = pac::RCC.cir().read().cssf();
    if stopped {
        pac::RCC.cir().modify(|w| w.set_cssc(true));
    }
    stopped
}
