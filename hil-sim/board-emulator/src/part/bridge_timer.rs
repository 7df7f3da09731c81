//! TIM1 and TIM8, which switch the bridges, without the calls that nothing on this board needs.
//!
//! Neither timer moves data by DMA or follows another timer. Each timer therefore listens only to the request lines that
//! trip its break: the line of the clock security system, and the supply detector, for which the part has no line
//! ([`BridgeTimer::supply_fell`]).
//!
//! The part's model asks for control at every edge of every channel: tens of thousands of times per second and timer at
//! 20 kHz. These calls would be most of a run's cost. The model knows the outputs' enables, breaks and locks, and catches
//! up in one pass whenever it is accessed. [`PwmWaveform`] computes the edges within a period. The model's events are
//! therefore dropped, except around a change of the break input, because these events time the break's filter. A reader
//! of the outputs drives the break inputs first, which makes the models catch up.

use rigless::device::{Device, DeviceContext, Level, RegisterFile, RequestChange};
use rigless::soc::stm32h743::generated::tim1::{self, Register};
use rigless::soc::stm32h743::peripherals::rcc::CLOCK_FAILURE;
use rigless::soc::stm32h743::peripherals::tim::{ADVANCED_TIMERS, Advanced, BreakInput, BreakSource, Channel, Tim};
use rigless::time::{EventId, VirtualNanos};

use super::setup::BridgeBreak;
use super::timer::UNSET_CLOCK_HZ;
use super::waveform::{PWM_CHANNELS, PwmShape, PwmWaveform};

/// Time after a change of the break input for which the model's events pass, in ns: longer than any setting of the
/// break's filter at this board's clock (15 samples of 32 periods of 5 ns: 2.4 us).
const BREAK_FILTER_NS: u64 = 5_000;

/// Instance whose request line trips the bridges' breaks when the external clock fails.
const CLOCKS: &str = "RCC";
/// The line that represents the supply detector. No line of the power controller has this index.
const SUPPLY: (&str, usize) = ("PWR", usize::MAX);

/// MMS2 that makes the sixth channel's reference the second trigger output, and the mode PWM 1 of a channel.
const SIXTH_REFERENCE: u64 = 0b1001;
const PWM_1: u64 = 0b0110;
/// Software's update event in EGR.
const UPDATE: u64 = 1;
/// Software's breaks in EGR: BG, B2G.
const SOFTWARE_BREAKS: [u64; 2] = [1 << 7, 1 << 8];

/// TIM1 or TIM8.
#[derive(Debug)]
pub struct BridgeTimer {
    /// The part's model.
    pub model: Tim<Advanced>,
    /// The last instant, in ns, at which an event reaches the model.
    events_until: u64,
    waveform: PwmWaveform,
    /// Writes of a preloaded compare value that the end of a period could have separated from the writes of the other
    /// values.
    pub unheld_writes: u64,
    /// Bits of EGR that do nothing.
    deaf: u64,
}

rigless::store!(BridgeTimer {
    values: [model, events_until, waveform, unheld_writes],
    parts: [],
    built: [deaf]
});

impl BridgeTimer {
    /// TIM1 for 0, TIM8 for 1, out of reset; `deaf` is a break that does not hear software, if there is one.
    pub fn new(nth: usize, deaf: Option<BridgeBreak>) -> Self {
        let deaf = deaf.filter(|deaf| deaf.timer == nth);
        Self {
            model: Tim::with_clock(UNSET_CLOCK_HZ, ADVANCED_TIMERS[nth])
                .breaks_on(CLOCKS, CLOCK_FAILURE)
                .breaks_on(SUPPLY.0, SUPPLY.1),
            events_until: 0,
            waveform: PwmWaveform::default(),
            unheld_writes: 0,
            deaf: deaf.map_or(0, |deaf| SOFTWARE_BREAKS[deaf.nth]),
        }
    }

    /// What the timer drives onto its channels, with the outputs enabled as `registers` say.
    pub fn waveform(&self, registers: &RegisterFile) -> PwmWaveform {
        let mut waveform = self.waveform;
        let shape = PwmShape {
            enabled: tim1::bdtr::MOE.is_set(registers.get(Register::Bdtr)),
            ..*waveform.shape()
        };
        waveform.reshape(waveform.seen(), shape, false);
        waveform
    }

    /// The pulse that a channel repeats while the counter runs and the outputs are enabled: high time and period, in ns.
    pub fn pulse(&self, channel: Channel, now: VirtualNanos, registers: &RegisterFile) -> Option<(u64, u64)> {
        self.model.output(channel, registers)?;
        let mut waveform = self.waveform(registers);
        waveform.catch_up(now.0);
        if !waveform.shape().enabled {
            return None;
        }
        Some((
            waveform.high_ns(usize::from(channel.number()) - 1)?,
            waveform.period_ns()?,
        ))
    }

    /// Lets the model's events pass for the longest time that the break's filter can take.
    pub fn time_break_filter(&mut self, now: VirtualNanos) {
        self.events_until = now.0 + BREAK_FILTER_NS;
    }

    /// The supply fell below the detector's level, which the firmware has connected to the break.
    pub fn supply_fell(&mut self, registers: &mut RegisterFile, context: &mut DeviceContext<'_>) {
        let (instance, request) = SUPPLY;
        let change = RequestChange {
            instance,
            request,
            level: Level::High,
        };
        self.model.on_request(change, registers, context);
    }

    /// Puts a level on the pin of a break input, which makes the model catch up.
    pub fn drive_break(
        &mut self,
        input: BreakInput,
        level: Level,
        registers: &mut RegisterFile,
        context: &mut DeviceContext<'_>,
    ) {
        self.model
            .drive_break_source(input, BreakSource::Pin, level, registers, context);
    }
}

/// The waveform's shape according to the registers.
fn shape(registers: &RegisterFile) -> PwmShape {
    /// Compare register of each channel, the register of the channel's mode, and the lowest bit of the channel's half of
    /// that register.
    const COMPARE: [(Register, Register, u32); PWM_CHANNELS] = [
        (Register::Ccr1, Register::Ccmr1Output, 0),
        (Register::Ccr2, Register::Ccmr1Output, 8),
        (Register::Ccr3, Register::Ccmr2Output, 0),
        (Register::Ccr4, Register::Ccmr2Output, 8),
        (Register::Ccr5, Register::Ccmr3Output, 0),
        (Register::Ccr6, Register::Ccmr3Output, 8),
    ];
    let control = registers.get(Register::Cr1);
    let mode = |n: usize| registers.get(COMPARE[n].1) >> COMPARE[n].2;
    PwmShape {
        runs: tim1::cr1::CEN.is_set(control),
        held: tim1::cr1::UDIS.is_set(control),
        up_and_down: tim1::cr1::CMS.get(control) != 0,
        prescaler: registers.get(Register::Psc),
        top: registers.get(Register::Arr),
        skipped: registers.get(Register::Rcr),
        compare: std::array::from_fn(|n| registers.get(COMPARE[n].0) & 0xFFFF),
        preloaded: std::array::from_fn(|n| mode(n) & 1 << 3 != 0),
        high_below: std::array::from_fn(|n| (mode(n) >> 4 & 0b111) | (mode(n) >> 16 & 1) << 3 == PWM_1),
        triggers: tim1::cr2::MMS2.get(registers.get(Register::Cr2)) == SIXTH_REFERENCE,
        enabled: tim1::bdtr::MOE.is_set(registers.get(Register::Bdtr)),
    }
}

impl Device for BridgeTimer {
    type Register = Register;

    fn read(&mut self, register: Register, file: &mut RegisterFile, context: &mut DeviceContext<'_>) -> Option<u64> {
        self.model.read(register, file, context)
    }

    fn peek(&self, register: Register, file: &RegisterFile, now: VirtualNanos) -> Option<u64> {
        self.model.peek(register, file, now)
    }

    fn write(&mut self, register: Register, value: u64, file: &mut RegisterFile, context: &mut DeviceContext<'_>) {
        let compares = [Register::Ccr1, Register::Ccr2, Register::Ccr3, Register::Ccr4];
        let shape_before = *self.waveform.shape();
        if compares.contains(&register) && shape_before.runs && !shape_before.held {
            self.unheld_writes += 1;
        }
        let heard = if register == Register::Egr {
            value & !self.deaf
        } else {
            value
        };
        self.model.write(register, heard, file, context);
        let restarted = register == Register::Egr && value & UPDATE != 0;
        self.waveform.reshape(context.now().0, shape(file), restarted);
    }

    fn on_event(&mut self, event: EventId, file: &mut RegisterFile, context: &mut DeviceContext<'_>) {
        if context.now().0 <= self.events_until {
            self.model.on_event(event, file, context);
        }
    }

    /// Only the clocks' lines: no other request or acknowledge is wired to these timers.
    fn on_request(&mut self, change: RequestChange, file: &mut RegisterFile, context: &mut DeviceContext<'_>) {
        if change.instance == CLOCKS {
            self.model.on_request(change, file, context);
        }
    }

    fn on_clock_input(&mut self, input: usize, hz: u64, file: &mut RegisterFile, context: &mut DeviceContext<'_>) {
        self.model.on_clock_input(input, hz, file, context);
        self.waveform.set_clock(hz);
    }

    fn reset(&mut self) {
        self.model.reset();
        self.waveform.stop();
    }

    fn reset_line(&mut self, file: &mut RegisterFile, context: &mut DeviceContext<'_>) {
        self.model.reset_line(file, context);
        self.waveform.stop();
    }
}
