//! The three motor bridges on TIM1 and TIM8: they drive and brake at 20 kHz over two lines per motor and have a hardware
//! break.
//!
//! Each bridge has two inputs, and each input has its own compare channel ([`firmware::bridge_legs`]): the four channels
//! of TIM1 drive the left and the right motor, two channels of TIM8 drive the ballast motor. A bridge with both inputs
//! low is open, so switching the outputs off opens the bridges. The drivers generate their own dead time.
//!
//! Both timers count up and down. Once per period, shortly before TIM1's zero, TIM1 sends the converter a trigger (TRGO2
//! from compare channel 6, which has no pin). The converter then samples the currents where they cross their mean, in the
//! middle of the braking interval.
//!
//! This file writes the timers' registers itself, because the HAL's driver enables the outputs while it configures a
//! timer. Here nothing sets a main output enable before the first enabled [`Actuation`], and the break clears the main
//! output enable in hardware, even if the CPU hangs. One wire leads to the break inputs of both timers, and the part's
//! own faults also act on both timers, so either opens all bridges without software. If a timer's outputs are off for
//! another reason, the next tick switches the other timer off.

use embassy_stm32::Peri;
use embassy_stm32::gpio::Flex;
use embassy_stm32::pac::timer::TimAdv;
use embassy_stm32::pac::timer::regs::{Cr1Gp16, SrAdv};
use embassy_stm32::pac::timer::vals::{Bkp, Cms, FilterValue, Lock, Mms2, Ossi, Ossr};
use embassy_stm32::pac::{self, TIM1, TIM8};
use embassy_stm32::peripherals;
use embassy_stm32::timer::simple_pwm::PwmPin;
use embassy_stm32::timer::{Ch1, Ch2, Ch3, Ch4};
use firmware::bridge_legs::leg_counts;
use firmware::drive_board::PWM_HZ;
use firmware::hardware::Bridges;
use model::sample::{Actuation, MOTORS};

use crate::board::clocks::TIMER_HZ;
use crate::board::{SAMPLES_AFTER_TRIGGER_NS, part};

/// Timer counts in half a PWM period: up, and down again.
const HALF_PERIOD_COUNTS: u16 = (TIMER_HZ / PWM_HZ / 2) as u16;
/// Timer counts from the converter's trigger to TIM1's zero: the time from the trigger to the converter's samples of the
/// drive motors' currents, rounded down by at most 5 ns.
const TRIGGER_COUNTS: u16 = (SAMPLES_AFTER_TRIGGER_NS as u64 * TIMER_HZ as u64 / 1_000_000_000) as u16;

const _: () = {
    assert!(TIMER_HZ.is_multiple_of(2 * PWM_HZ) && TIMER_HZ / PWM_HZ / 2 <= 0xFFFF);
    // Within the half in which the counter counts down, and not at its turns.
    assert!(0 < TRIGGER_COUNTS && TRIGGER_COUNTS < HALF_PERIOD_COUNTS);
};

/// Channels of TIM1: left IN1, left IN2, right IN1, right IN2. Numbered from 0, as the registers are.
const DRIVE_CHANNELS: [usize; 4] = [0, 1, 2, 3];
/// Channels of TIM8: ballast IN1, IN2. The pins of the first two channels are used by an encoder.
const BALLAST_CHANNELS: [usize; 2] = [2, 3];

/// The enabled breaks of TIM1, numbered from 0. The part's own faults act on the first break.
const DRIVE_BREAKS: &[usize] = &[0];
/// The wire is connected to TIM8's second break, because no pin of its first break is free on either board. In this
/// configuration the second break switches the outputs to their inactive level, low, like the first break.
const BALLAST_BREAKS: &[usize] = &[0, 1];

/// The pins of the bridges and of the breaks, connected to the timers.
#[expect(
    dead_code,
    reason = "the bridges' pins are held: a pin that is dropped leaves its timer"
)]
pub struct BridgePins {
    /// Left bridge, IN1 and IN2.
    pub left: (
        PwmPin<'static, peripherals::TIM1, Ch1>,
        PwmPin<'static, peripherals::TIM1, Ch2>,
    ),
    /// Right bridge, IN1 and IN2.
    pub right: (
        PwmPin<'static, peripherals::TIM1, Ch3>,
        PwmPin<'static, peripherals::TIM1, Ch4>,
    ),
    /// Ballast bridge, IN1 and IN2.
    pub ballast: (
        PwmPin<'static, peripherals::TIM8, Ch3>,
        PwmPin<'static, peripherals::TIM8, Ch4>,
    ),
    /// Break inputs of TIM1 and TIM8, pulled up, on one wire.
    pub break_inputs: [Flex<'static>; 2],
}

/// TIM1 and TIM8, configured once and locked, and their pins.
pub struct MotorBridges {
    _timers: (Peri<'static, peripherals::TIM1>, Peri<'static, peripherals::TIM8>),
    pins: BridgePins,
    /// Whether the last tick enabled the outputs.
    enabled: bool,
    /// Whether the outputs have gone off by themselves since the break was last cleared.
    lost: bool,
}

impl MotorBridges {
    /// Configures the timers with their outputs off, locks polarities and breaks against any later write until reset,
    /// tests each break, and only then lets `connect` connect the pins to the timers. Returns the bridges and whether
    /// each software break switched its timer's outputs off.
    pub fn new(
        drives: Peri<'static, peripherals::TIM1>,
        ballast: Peri<'static, peripherals::TIM8>,
        connect: impl FnOnce() -> BridgePins,
    ) -> (Self, bool) {
        critical_section::with(|_| {
            pac::RCC.apb2enr().modify(|w| {
                w.set_tim1en(true);
                w.set_tim8en(true);
            });
            for reset in [true, false] {
                pac::RCC.apb2rstr().modify(|w| {
                    w.set_tim1rst(reset);
                    w.set_tim8rst(reset);
                });
            }
        });
        configure(TIM1, &DRIVE_CHANNELS, DRIVE_BREAKS);
        configure(TIM8, &BALLAST_CHANNELS, BALLAST_BREAKS);
        trigger_conversions();
        // The two timers are started directly one after the other. Their periods begin some clocks apart and stay so,
        // because both timers count the same clock. The sample of the ballast's current is displaced by the same few
        // clocks.
        critical_section::with(|_| {
            TIM1.cr1().write_value(counting(false));
            TIM8.cr1().write_value(counting(false));
        });
        let drives_work = DRIVE_BREAKS.iter().all(|n| try_break(TIM1, *n));
        let ballast_works = BALLAST_BREAKS.iter().all(|n| try_break(TIM8, *n));
        clear_break_flags();
        let bridges = Self {
            _timers: (drives, ballast),
            pins: connect(),
            enabled: false,
            lost: false,
        };
        (bridges, drives_work && ballast_works)
    }

    /// Whether a timer's outputs are off although the last tick enabled them.
    fn lost(&mut self) -> bool {
        self.lost |= self.enabled && !(TIM1.bdtr().read().moe() && TIM8.bdtr().read().moe());
        self.lost
    }

    /// Sets the mean voltages. A timer loads all its values together at the end of a period, because a pair with one
    /// value of the previous tick could be low at the same time.
    fn set_duties(duty: [i16; MOTORS]) {
        let [left, right, ballast] = duty;
        TIM1.cr1().write_value(counting(true));
        TIM8.cr1().write_value(counting(true));
        set_legs(TIM1, [0, 1], left);
        set_legs(TIM1, [2, 3], right);
        set_legs(TIM8, BALLAST_CHANNELS, ballast);
        TIM1.cr1().write_value(counting(false));
        TIM8.cr1().write_value(counting(false));
    }
}

impl Bridges for MotorBridges {
    fn apply(&mut self, actuation: &Actuation) {
        if !actuation.enable || self.break_tripped() {
            open_all();
            // The next enable starts at zero volts instead of the last duty.
            Self::set_duties([0; MOTORS]);
            self.enabled = false;
            return;
        }
        Self::set_duties(actuation.duty);
        // Written only once: if the outputs go off later, a break has done so, and no write may undo a break.
        if !self.enabled {
            TIM1.bdtr().modify(|w| w.set_moe(true));
            TIM8.bdtr().modify(|w| w.set_moe(true));
            self.enabled = true;
        }
    }

    fn break_tripped(&mut self) -> bool {
        (TIM1.sr().read().0 | TIM8.sr().read().0) & break_flags().0 != 0 || self.lost()
    }

    /// Whether both timers' pins of the wire are high. A pin that is shorted to ground does not follow a press of the
    /// stop, and the stop's contacts then disagree. An open pin trips its timer's break.
    fn break_input_active(&mut self) -> bool {
        let [drives, ballast] = &self.pins.break_inputs;
        drives.is_high() && ballast.is_high()
    }

    fn clear_break(&mut self) {
        clear_break_flags();
        self.lost = false;
    }
}

/// Sets a timer up with its counter stopped and its outputs off, and locks its break.
fn configure(timer: TimAdv, channels: &[usize], breaks: &[usize]) {
    // The direction mode is set while the counter is stopped, because it must not change together with the start (RM0433
    // 38.3.11, RM0410 25.3.11).
    timer.cr1().write(|w| w.set_cms(UP_AND_DOWN));
    timer.psc().write_value(0);
    timer.arr().write(|w| w.set_arr(HALF_PERIOD_COUNTS));
    // Every second turn of the counter loads the written values. ST's manuals disagree on which turn an odd number means
    // (RM0433 38.3.3 against RM0090 17.3.3). At zero every line is high, so no line changes; at the top the two lines of
    // a bridge change in the same clock. In both cases the lines never pass through both low.
    timer.rcr().write(|w| w.set_rep(1));
    for channel in channels.iter().copied() {
        timer.ccr(channel).write(|w| w.set_ccr(HALF_PERIOD_COUNTS));
        timer.ccmr_output(channel / 2).modify(|w| {
            w.set_ocm(channel % 2, part::PWM_MODE);
            w.set_ocpe(channel % 2, true);
        });
        timer.ccer().modify(|w| w.set_cce(channel, true));
    }
    timer.bdtr().write(|w| {
        // Off means driven to the idle level, which is low, not floating.
        w.set_ossi(Ossi::IDLE_LEVEL);
        w.set_ossr(Ossr::IDLE_LEVEL);
        for n in breaks.iter().copied() {
            // A closed contact pulls the input down, a resistor pulls it up: an open wire is a break.
            w.set_bkp(n, Bkp::ACTIVE_HIGH);
            w.set_bke(n, true);
            // No filter, which would need the timer's clock: the break acts with every clock stopped. Against the motors'
            // noise the wire has its own filter (docs/power-stage.md).
            w.set_bkf(n, FilterValue::NO_FILTER);
        }
        w.set_aoe(false);
        w.set_moe(false);
        w.set_lock(Lock::LEVEL2);
    });
    // The update event loads the preloaded period and duties.
    timer.egr().write(|w| w.set_ug(true));
}

/// Counting mode of the timers. The three up-and-down modes differ only in the times of the compare flags, which nobody
/// reads.
const UP_AND_DOWN: Cms = Cms::CENTER_ALIGNED1;

/// Makes TIM1 send the converter's trigger: a rising edge of channel 6's reference, once per period, while counting down.
fn trigger_conversions() {
    TIM1.ccr6().write(|w| w.set_ccr(TRIGGER_COUNTS));
    TIM1.ccmr3().modify(|w| w.set_ocm(1, part::PWM_MODE));
    TIM1.cr2().modify(|w| w.set_mms2(Mms2::COMPARE_OC6));
}

/// Control register of a counting timer. While `held`, the end of a period does not load the written values.
fn counting(held: bool) -> Cr1Gp16 {
    let mut value = Cr1Gp16(0);
    value.set_cms(UP_AND_DOWN);
    value.set_arpe(true);
    value.set_cen(true);
    value.set_udis(held);
    value
}

#[expect(clippy::inline_always, reason = "the registers' addresses are constants then")]
#[inline(always)]
fn set_legs(timer: TimAdv, channels: [usize; 2], duty: i16) {
    let counts = leg_counts(duty, HALF_PERIOD_COUNTS);
    timer.ccr(channels[0]).write(|w| w.set_ccr(counts.in1));
    timer.ccr(channels[1]).write(|w| w.set_ccr(counts.in2));
}

/// The flags of the pins' breaks and of the system's: clock, memory, supply, core.
fn break_flags() -> SrAdv {
    let mut flags = SrAdv(0);
    flags.set_bif(0, true);
    flags.set_bif(1, true);
    flags.set_sbif(true);
    flags
}

/// Clears the flags of every break and no other flags: writing a zero clears a flag, writing a one leaves it unchanged.
fn clear_break_flags() {
    for timer in [TIM1, TIM8] {
        timer.sr().write_value(SrAdv(!break_flags().0));
    }
}

/// Triggers a timer's `nth` break by software and returns whether the outputs, which were on, went off and the flag rose.
/// To be called before the pins are connected to the timer.
fn try_break(timer: TimAdv, nth: usize) -> bool {
    timer.bdtr().modify(|w| w.set_moe(true));
    let on = timer.bdtr().read().moe();
    timer.egr().write(|w| w.set_bg(nth, true));
    let flagged = timer.sr().read().bif(nth);
    let off = !timer.bdtr().read().moe();
    open_all();
    on && off && flagged
}

/// Opens every bridge at once. A fault handler may call this: it writes two registers and needs no state.
pub fn open_all() {
    TIM1.bdtr().modify(|w| w.set_moe(false));
    TIM8.bdtr().modify(|w| w.set_moe(false));
}
