//! Quadrature counters of the three motors on TIM2, TIM3 and TIM4.

use embassy_stm32::peripherals::{TIM2, TIM3, TIM4};
use embassy_stm32::timer::qei::Qei;
use firmware::hardware::EncoderCounters;
use model::sample::MOTORS;

/// The hardware counters, in the order of the motors.
pub struct QuadratureCounters {
    /// Left wheel.
    pub left: Qei<'static, TIM2>,
    /// Right wheel.
    pub right: Qei<'static, TIM3>,
    /// Ballast of the camera spar.
    pub ballast: Qei<'static, TIM4>,
}

impl EncoderCounters for QuadratureCounters {
    fn counts(&mut self) -> [u16; MOTORS] {
        [self.left.count(), self.right.count(), self.ballast.count()]
    }
}
