//! Analogue inputs on ADC1, in one sequence of 12-bit conversions that the bridges' timer starts and the DMA moves.
//!
//! A reader enables the converter's trigger once; the next trigger, at most 50 us later, starts the sequence. The trigger
//! precedes the middle of the braking interval by [`SAMPLES_AFTER_TRIGGER_NS`], so that the middle lies between the
//! samples of the two drive motors' currents.
//!
//! The converter left-aligns its twelve bits in the word, so a count has the same meaning as a 16-bit count; the lowest
//! four bits are always zero.

use embassy_stm32::Peri;
use embassy_stm32::adc::{Adc, RxDma};
use embassy_stm32::dma;
use embassy_stm32::interrupt::typelevel::Binding;
use embassy_stm32::pac::adc::vals::{Align, Dds, Exten, SampleTime};
use embassy_stm32::pac::gpio::{Gpio, vals::Moder};
use embassy_stm32::pac::{self};
use embassy_stm32::peripherals::ADC1;
use firmware::drive_board::nucleo_f767zi::analog::{CONVERTER_HZ, CURRENT_STEP_HALF_CYCLES};
use firmware::hardware::AnalogInputs;
use model::analog::{ANALOG_INPUTS, Analog};

use super::clocks::TIMER_HZ;
use super::stm32_registers::conversions::{Conversions, NoReading, TIM1_TRGO2, in_sequence};

/// The converter's registers.
const REGISTERS: pac::adc::Adc = pac::ADC1;

/// Time from the trigger to the middle between the samples of the left and the right motor's current. In half cycles: the
/// trigger's latency, 6 (DS11532, ADC characteristics); a sample of [`CURRENT_TIME`], 30; half of the step from one
/// current's sample to the next.
pub const SAMPLES_AFTER_TRIGGER_NS: u32 =
    ((6 + 30 + CURRENT_STEP_HALF_CYCLES / 2) * 1_000_000_000 / (2 * CONVERTER_HZ)) as u32;

/// 15 cycles at 27 MHz, 0.6 us: the source is an amplifier with a filter that the converter does not load.
const CURRENT_TIME: SampleTime = SampleTime::CYCLES15;
/// 112 cycles at 27 MHz, 4 us: the source is a divider of tens of kilohms with a capacitor.
const BATTERY_TIME: SampleTime = SampleTime::CYCLES112;

/// ADC1, set up for the sequence.
pub struct LeftAlignedSequence {
    _adc: Adc<'static, ADC1>,
    conversions: Conversions,
    /// Whether the converter's trigger is enabled, because a reader waits or was dropped halfway.
    under_way: bool,
}

/// Port and number of the pin of a channel of ADC1 (DS11532, pin definitions).
const fn pin_of(channel: u8) -> (Gpio, usize) {
    match channel {
        0..=7 => (pac::GPIOA, channel as usize),
        8..=9 => (pac::GPIOB, channel as usize - 8),
        _ => (pac::GPIOC, channel as usize - 10),
    }
}

// One register of the sequence is enough.
const _: () = assert!(ANALOG_INPUTS <= 6);

impl LeftAlignedSequence {
    /// Sets up the sequence. `channels` are the converter's channels in the order of [`Analog`]. A converter of this part
    /// needs no calibration, but its `pins` come up as digital inputs.
    pub fn new<D: RxDma<ADC1>>(
        adc: Peri<'static, ADC1>,
        dma: Peri<'static, D>,
        interrupts: impl Binding<D::Interrupt, dma::InterruptHandler<D>> + 'static,
        channels: [u8; ANALOG_INPUTS],
    ) -> Self {
        for (port, pin) in channels.map(pin_of) {
            port.moder().modify(|w| w.set_moder(pin, Moder::ANALOG));
        }
        let adc = Adc::new(adc);
        for (n, channel) in channels.map(usize::from).into_iter().enumerate() {
            let time = if n == 0 { BATTERY_TIME } else { CURRENT_TIME };
            if channel < 10 {
                REGISTERS.smpr2().modify(|w| w.set_smp(channel, time));
            } else {
                REGISTERS.smpr1().modify(|w| w.set_smp(channel - 10, time));
            }
        }
        REGISTERS.sqr1().write(|w| w.set_l(ANALOG_INPUTS as u8 - 1));
        REGISTERS.sqr3().write(|w| {
            for (n, channel) in in_sequence(channels).into_iter().enumerate() {
                w.set_sq(n, channel);
            }
        });
        REGISTERS.cr1().modify(|w| w.set_scan(true));
        REGISTERS.cr2().modify(|w| {
            w.set_align(Align::LEFT);
            w.set_cont(false);
            w.set_extsel(TIM1_TRGO2);
            // The converter keeps requesting after a transfer's last word; each sequence starts a new transfer.
            w.set_dds(Dds::CONTINUOUS);
            w.set_dma(true);
        });
        Self {
            _adc: adc,
            conversions: Conversions::new(dma, interrupts),
            under_way: false,
        }
    }

    /// Disables the converter's trigger and ends a sequence in progress. The converter needs 3 us to start again.
    fn stop(&mut self) {
        // Without power the converter drops its present conversion and an unanswered request.
        REGISTERS.cr2().modify(|w| {
            w.set_exten(Exten::DISABLED);
            w.set_adon(false);
            w.set_dma(false);
        });
        REGISTERS.cr2().modify(|w| {
            w.set_adon(true);
            w.set_dma(true);
        });
        // Writing zeros clears the flags; an overrun holds every request back until its flag is clear.
        REGISTERS.sr().write(|_| {});
        self.under_way = false;
    }
}

/// Core cycles of the 3 us that the converter takes to start.
const START_CYCLES: u32 = 3 * (TIMER_HZ / 1_000_000);

impl AnalogInputs for LeftAlignedSequence {
    type Error = NoReading;

    async fn read(&mut self) -> Result<Analog<u16>, NoReading> {
        if self.under_way {
            self.stop();
            cortex_m::asm::delay(START_CYCLES);
        }
        self.under_way = true;
        let start = || REGISTERS.cr2().modify(|w| w.set_exten(Exten::RISING_EDGE));
        let readings = self.conversions.take(start).await;
        let lost = REGISTERS.sr().read().ovr();
        // The next trigger would start the sequence again. The converter has until the next reading to start.
        self.stop();
        if lost { Err(NoReading) } else { Ok(readings) }
    }
}
