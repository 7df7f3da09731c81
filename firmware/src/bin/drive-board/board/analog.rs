//! Analogue inputs on ADC1, in one sequence of 16-bit conversions that the bridges' timer starts and the DMA moves.
//!
//! A reader enables the converter's trigger once; the next trigger, at most 50 us later, starts the sequence. The trigger
//! precedes the middle of the braking interval by [`SAMPLES_AFTER_TRIGGER_NS`], so that the middle lies between the
//! samples of the two drive motors' currents.

use embassy_stm32::Peri;
use embassy_stm32::adc::{Adc, RxDma};
use embassy_stm32::dma;
use embassy_stm32::interrupt::typelevel::Binding;
use embassy_stm32::pac::adc::vals::{Adstp, Dmngt, Exten, Pcsel, Res, SampleTime};
use embassy_stm32::pac::{self};
use embassy_stm32::peripherals::ADC1;
use firmware::drive_board::nucleo_h743zi::analog::{CONVERTER_HZ, CURRENT_STEP_HALF_CYCLES};
use firmware::hardware::AnalogInputs;
use model::analog::{ANALOG_INPUTS, Analog};

use super::stm32_registers::conversions::{Conversions, NoReading, TIM1_TRGO2, in_sequence};

/// The converter's registers.
const REGISTERS: pac::adc::Adc = pac::ADC1;

/// Time from the trigger to the middle between the samples of the left and the right motor's current. In half cycles: the
/// trigger's latency, 4 give or take 1 (DS12110, ADC characteristics); a sample of [`CURRENT_TIME`], 17; half of the
/// step from one current's sample to the next.
pub const SAMPLES_AFTER_TRIGGER_NS: u32 =
    ((4 + 17 + CURRENT_STEP_HALF_CYCLES / 2) * 1_000_000_000 / (2 * CONVERTER_HZ)) as u32;

/// 8.5 cycles at 16 MHz, 0.5 us: the source is an amplifier with a filter that the converter does not load.
const CURRENT_TIME: SampleTime = SampleTime::CYCLES8_5;
/// 64.5 cycles at 16 MHz, 4 us: the source is a divider of tens of kilohms with a capacitor.
const BATTERY_TIME: SampleTime = SampleTime::CYCLES64_5;

/// ADC1, set up for the sequence.
pub struct AnalogSequence {
    _adc: Adc<'static, ADC1>,
    conversions: Conversions,
}

impl AnalogSequence {
    /// Calibrates the converter and sets up the sequence. `channels` are the converter's channels in the order of
    /// [`Analog`]. Their pins are analogue from reset on.
    pub fn new<D: RxDma<ADC1>>(
        adc: Peri<'static, ADC1>,
        dma: Peri<'static, D>,
        interrupts: impl Binding<D::Interrupt, dma::InterruptHandler<D>> + 'static,
        channels: [u8; ANALOG_INPUTS],
    ) -> Self {
        let adc = Adc::new(adc);
        REGISTERS.pcsel().modify(|w| {
            for channel in channels {
                w.set_pcsel(channel as usize, Pcsel::PRESELECTED);
            }
        });
        for (n, channel) in channels.map(usize::from).into_iter().enumerate() {
            let time = if n == 0 { BATTERY_TIME } else { CURRENT_TIME };
            REGISTERS.smpr(channel / 10).modify(|w| w.set_smp(channel % 10, time));
        }
        REGISTERS.sqr1().write(|w| {
            w.set_l(ANALOG_INPUTS as u8 - 1);
            for (n, channel) in in_sequence(channels).into_iter().enumerate() {
                w.set_sq(n, channel);
            }
        });
        REGISTERS.cfgr().modify(|w| {
            w.set_res(Res::BITS16);
            w.set_cont(false);
            w.set_extsel(TIM1_TRGO2);
            w.set_exten(Exten::RISING_EDGE);
            // The converter keeps requesting after a transfer's last word; each sequence starts a new transfer.
            w.set_dmngt(Dmngt::DMA_CIRCULAR);
        });
        Self {
            _adc: adc,
            conversions: Conversions::new(dma, interrupts),
        }
    }

    /// Makes the converter deaf to the trigger, whatever sequence is under way, and empties its FIFO.
    fn settle() -> Result<(), NoReading> {
        if REGISTERS.cr().read().adstart() {
            REGISTERS.cr().modify(|w| w.set_adstp(Adstp::STOP));
            within_looks(|| !REGISTERS.cr().read().adstart())?;
        }
        within_looks(|| {
            let empty = !REGISTERS.isr().read().eoc();
            if !empty {
                let _ = REGISTERS.dr().read();
            }
            empty
        })?;
        // Writing ones clears the flags.
        REGISTERS.isr().write(|w| {
            w.set_eos(true);
            w.set_ovr(true);
        });
        Ok(())
    }
}

/// Most looks at a register. A converter that stops does so within a few of its cycles, and its FIFO holds a few words; as many
/// looks take some 10 us, in which the control task has to wait.
const LOOKS: usize = 200;

/// Looks until `is_done`. If the converter does not finish within [`LOOKS`] looks, there is no reading, and the control task
/// continues.
fn within_looks(is_done: impl FnMut() -> bool) -> Result<(), NoReading> {
    let mut looks = core::iter::repeat_with(is_done).take(LOOKS);
    if looks.any(|done| done) { Ok(()) } else { Err(NoReading) }
}

impl AnalogInputs for AnalogSequence {
    type Error = NoReading;

    async fn read(&mut self) -> Result<Analog<u16>, NoReading> {
        // The reader before may have been dropped halfway.
        Self::settle()?;
        let start = || REGISTERS.cr().modify(|w| w.set_adstart(true));
        let readings = self.conversions.take(start).await;
        let lost = REGISTERS.isr().read().ovr();
        // The next trigger would start the sequence again.
        Self::settle()?;
        if lost { Err(NoReading) } else { Ok(readings) }
    }
}
