//! Quadrature counters of the three motors on TIM2, TIM3 and TIM4.

use embassy_stm32::gpio::Pull;
use embassy_stm32::pac;
use embassy_stm32::pac::timer::regs::CcmrInput2ch;
use embassy_stm32::pac::timer::vals::FilterValue;
use embassy_stm32::peripherals::{TIM2, TIM3, TIM4};
use embassy_stm32::timer::qei::{self, Qei};
use firmware::drive_board::ENCODER_DIVIDER;
use firmware::hardware::EncoderCounters;
use model::sample::MOTORS;

/// The filter of [`firmware::drive_board::encoders`]: eight samples, [`ENCODER_DIVIDER`] periods of the timers' clock apart.
const ENCODER_FILTER: FilterValue = match ENCODER_DIVIDER {
    8 => FilterValue::FDTS_DIV8_N8,
    16 => FilterValue::FDTS_DIV16_N8,
    32 => FilterValue::FDTS_DIV32_N8,
    _ => panic!("the timers have no filter of eight samples with this divider"),
};

/// The hardware counters, in the order of the motors.
pub struct QuadratureCounters {
    /// Left wheel.
    left: Qei<'static, TIM2>,
    /// Right wheel.
    right: Qei<'static, TIM3>,
    /// Ballast of the spar.
    ballast: Qei<'static, TIM4>,
}

impl QuadratureCounters {
    /// The counters, with the board's filter at every input.
    pub fn new(left: Qei<'static, TIM2>, right: Qei<'static, TIM3>, ballast: Qei<'static, TIM4>) -> Self {
        filter(pac::TIM2.ccmr_input(0));
        filter(pac::TIM3.ccmr_input(0));
        filter(pac::TIM4.ccmr_input(0));
        Self { left, right, ballast }
    }
}

/// Sets the filter of both channels.
fn filter(inputs: pac::common::Reg<CcmrInput2ch, pac::common::RW>) {
    inputs.modify(|w| {
        w.set_icf(0, ENCODER_FILTER);
        w.set_icf(1, ENCODER_FILTER);
    });
}

/// The counters count both edges of both channels; pull-ups keep the inputs of an unplugged encoder still.
pub fn config() -> qei::Config {
    qei::Config {
        ch1_pull: Pull::Up,
        ch2_pull: Pull::Up,
        ..qei::Config::default()
    }
}

impl EncoderCounters for QuadratureCounters {
    fn counts(&mut self) -> [u16; MOTORS] {
        [self.left.count(), self.right.count(), self.ballast.count()]
    }
}
