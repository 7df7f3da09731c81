//! The three motor bridges on TIM1: locked anti-phase PWM at 20 kHz with dead time and a hardware break.
//!
//! One complementary pair of outputs drives each H-bridge: `CHx` high turns on the forward diagonal, `CHxN`
//! high the reverse diagonal. With both low the bridge is open, so switching the outputs off opens the
//! bridges. At half duty the motor gets zero volts.
//!
//! This file writes the timer's registers itself, because the HAL's driver enables the outputs while it
//! configures the timer. Here nothing sets the main output enable before the first enabled [`Actuation`], and
//! the break clears it in hardware, even if the CPU hangs.

use embassy_stm32::Peri;
use embassy_stm32::gpio::Flex;
use embassy_stm32::pac::timer::vals::{Bkp, FilterValue, Lock, Ossi, Ossr};
use embassy_stm32::pac::{self, TIM1};
use embassy_stm32::peripherals;
use embassy_stm32::timer::complementary_pwm::ComplementaryPwmPin;
use embassy_stm32::timer::simple_pwm::PwmPin;
use embassy_stm32::timer::{Ch1, Ch2, Ch3};
use firmware::drive_board::{DUTY_MAX_PERCENT, PULSE_MIN_PERCENT};
use firmware::hardware::Bridges;
use model::sample::{Actuation, MOTORS};

use crate::board::clocks::TIMER_HZ;
use crate::board::part;

/// PWM frequency: above hearing, and slow enough for the bridges' drivers.
const PWM_HZ: u32 = 20_000;
/// Timer counts in one PWM period.
const PERIOD_COUNTS: u32 = TIMER_HZ / PWM_HZ;
/// Compare value for zero volts.
const CENTRE_COUNTS: i32 = (PERIOD_COUNTS / 2).cast_signed();
/// 500 ns at [`TIMER_HZ`]: longer than a power MOSFET takes to turn off.
const DEAD_TIME_COUNTS: u8 = (TIMER_HZ / 2_000_000) as u8;

const _: () = assert!(TIMER_HZ.is_multiple_of(PWM_HZ) && PERIOD_COUNTS <= 0xFFFF);
const _: () = assert!(
    TIMER_HZ.is_multiple_of(2_000_000) && TIMER_HZ / 2_000_000 < 128,
    "linear range of the dead time"
);
// At the largest duty, the shorter side of the period still exceeds the dead time on both edges.
const _: () = assert!(MARGIN_COUNTS > 2 * DEAD_TIME_COUNTS as i32);
const _: () = assert!(CENTRE_COUNTS - FULL_COUNTS == MARGIN_COUNTS);

/// Shortest pulse of either side.
const MARGIN_COUNTS: i32 = (PERIOD_COUNTS * PULSE_MIN_PERCENT / 100).cast_signed();
/// Largest duty: beyond it the bridges give no more, below it a duty is that share of the supply.
const FULL_COUNTS: i32 = CENTRE_COUNTS * DUTY_MAX_PERCENT.cast_signed() / 100;

/// The pins of the bridges and of the break, connected to the timer.
pub struct BridgePins {
    /// Left, right and ballast bridge, forward.
    pub forward: (
        PwmPin<'static, peripherals::TIM1, Ch1>,
        PwmPin<'static, peripherals::TIM1, Ch2>,
        PwmPin<'static, peripherals::TIM1, Ch3>,
    ),
    /// Left, right and ballast bridge, reverse.
    pub reverse: (
        ComplementaryPwmPin<'static, peripherals::TIM1, Ch1>,
        ComplementaryPwmPin<'static, peripherals::TIM1, Ch2>,
        ComplementaryPwmPin<'static, peripherals::TIM1, Ch3>,
    ),
    /// Break input, pulled up.
    pub break_input: Flex<'static>,
}

/// TIM1, configured once and locked, and its pins.
pub struct Tim1Bridges {
    _timer: Peri<'static, peripherals::TIM1>,
    _forward: (
        PwmPin<'static, peripherals::TIM1, Ch1>,
        PwmPin<'static, peripherals::TIM1, Ch2>,
        PwmPin<'static, peripherals::TIM1, Ch3>,
    ),
    _reverse: (
        ComplementaryPwmPin<'static, peripherals::TIM1, Ch1>,
        ComplementaryPwmPin<'static, peripherals::TIM1, Ch2>,
        ComplementaryPwmPin<'static, peripherals::TIM1, Ch3>,
    ),
    break_input: Flex<'static>,
    /// The last tick enabled the outputs.
    enabled: bool,
    /// The outputs went off by themselves since the break was last cleared.
    lost: bool,
}

impl Tim1Bridges {
    /// Configures the timer with its outputs off, locks dead time, polarities and the break against
    /// any later write until reset, tries the break, and only then lets `connect` connect the pins to the timer. Returns
    /// the bridges and whether the break, asked for by software, switched the outputs off.
    pub fn new(timer: Peri<'static, peripherals::TIM1>, connect: impl FnOnce() -> BridgePins) -> (Self, bool) {
        critical_section::with(|_| {
            pac::RCC.apb2enr().modify(|w| w.set_tim1en(true));
            pac::RCC.apb2rstr().modify(|w| w.set_tim1rst(true));
            pac::RCC.apb2rstr().modify(|w| w.set_tim1rst(false));
        });
        TIM1.psc().write_value(0);
        TIM1.arr().write(|w| w.set_arr((PERIOD_COUNTS - 1) as u16));
        for n in 0..MOTORS {
            TIM1.ccr(n).write(|w| w.set_ccr(CENTRE_COUNTS as u16));
            TIM1.ccmr_output(n / 2).modify(|w| {
                w.set_ocm(n % 2, part::PWM_MODE);
                w.set_ocpe(n % 2, true);
            });
        }
        TIM1.ccer().modify(|w| {
            for n in 0..MOTORS {
                w.set_cce(n, true);
                w.set_ccne(n, true);
            }
        });
        TIM1.bdtr().write(|w| {
            w.set_dtg(DEAD_TIME_COUNTS);
            // Off means driven to the idle level, which is low, not floating.
            w.set_ossi(Ossi::IDLE_LEVEL);
            w.set_ossr(Ossr::IDLE_LEVEL);
            // A closed contact pulls the input down, a resistor pulls it up: an open wire is a break.
            w.set_bkp(0, Bkp::ACTIVE_HIGH);
            w.set_bke(0, true);
            // No filter, which would need the timer's clock: the break acts with every clock stopped. Against the
            // motors' noise the wire has a filter of its own (docs/power-stage.md).
            w.set_bkf(0, FilterValue::NO_FILTER);
            w.set_aoe(false);
            w.set_moe(false);
            w.set_lock(Lock::LEVEL2);
        });
        TIM1.cr1().modify(|w| w.set_arpe(true));
        // The update event loads the preloaded period and duties.
        TIM1.egr().write(|w| w.set_ug(true));
        TIM1.cr1().modify(|w| w.set_cen(true));
        let break_works = try_break();
        clear_break_flags();
        let pins = connect();
        let bridges = Self {
            _timer: timer,
            _forward: pins.forward,
            _reverse: pins.reverse,
            break_input: pins.break_input,
            enabled: false,
            lost: false,
        };
        (bridges, break_works)
    }

    /// Whether the timer holds its outputs off, though the last tick enabled them.
    fn lost(&mut self) -> bool {
        self.lost |= self.enabled && !TIM1.bdtr().read().moe();
        self.lost
    }

    fn set_counts(duty: [i16; MOTORS]) {
        for (n, duty) in duty.into_iter().enumerate() {
            let counts = i32::from(duty) * CENTRE_COUNTS / i32::from(i16::MAX);
            let counts = CENTRE_COUNTS + counts.clamp(-FULL_COUNTS, FULL_COUNTS);
            TIM1.ccr(n).write(|w| w.set_ccr(counts as u16));
        }
    }
}

impl Bridges for Tim1Bridges {
    fn apply(&mut self, actuation: &Actuation) {
        if !actuation.enable || self.break_tripped() {
            open_all();
            // The next enable starts at zero volts, not at the last duty driven.
            Self::set_counts([0; MOTORS]);
            self.enabled = false;
            return;
        }
        Self::set_counts(actuation.duty);
        // Written once: what switches the outputs off later is a break, which no write may undo.
        if !self.enabled {
            TIM1.bdtr().modify(|w| w.set_moe(true));
            self.enabled = true;
        }
    }

    fn break_tripped(&mut self) -> bool {
        let flags = TIM1.sr().read();
        // The pin's break, the second break, the system's: clock, memory, supply, core.
        flags.bif(0) || flags.bif(1) || flags.sbif() || self.lost()
    }

    fn break_input_active(&mut self) -> bool {
        self.break_input.is_high()
    }

    fn clear_break(&mut self) {
        clear_break_flags();
        self.lost = false;
    }
}

/// Clears the flags of every break and no others: writing a zero clears a flag, writing a one leaves it.
fn clear_break_flags() {
    TIM1.sr().write(|w| {
        w.0 = !0;
        w.set_bif(0, false);
        w.set_bif(1, false);
        w.set_sbif(false);
    });
}

/// Asks for a break by software and returns whether the outputs, which were on, went off and the flag rose. To be called
/// before the pins are connected to the timer.
fn try_break() -> bool {
    TIM1.bdtr().modify(|w| w.set_moe(true));
    let on = TIM1.bdtr().read().moe();
    TIM1.egr().write(|w| w.set_bg(0, true));
    let flagged = TIM1.sr().read().bif(0);
    let off = !TIM1.bdtr().read().moe();
    open_all();
    on && off && flagged
}

/// Opens every bridge at once. A fault handler may call this: it writes one register and needs no state.
pub fn open_all() {
    TIM1.bdtr().modify(|w| w.set_moe(false));
}
