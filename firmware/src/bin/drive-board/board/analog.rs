//! Analogue inputs on ADC1, in one sequence of 16-bit conversions that
//! the reader starts and the DMA moves.

use embassy_stm32::Peri;
use embassy_stm32::adc::{Adc, RxDma};
use embassy_stm32::dma;
use embassy_stm32::interrupt::typelevel::Binding;
use embassy_stm32::pac::adc::vals::{Adstp, Dmngt, Pcsel, Res, SampleTime};
use embassy_stm32::pac::{self};
use embassy_stm32::peripherals::ADC1;
use firmware::hardware::AnalogInputs;
use model::analog::{ANALOG_INPUTS, Analog};

use super::stm32_registers::conversions::{Conversions, LostWord};

/// The converter's registers.
const REGISTERS: pac::adc::Adc = pac::ADC1;

/// ADC1, set up for the sequence.
pub struct AnalogSequence {
    _adc: Adc<'static, ADC1>,
    conversions: Conversions,
}

impl AnalogSequence {
    /// Calibrates the converter and sets the sequence up. `channels` are the converter's, in the order of
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
        for channel in channels.map(usize::from) {
            // 64.5 cycles at 16 MHz, 4 us: the source is a divider of tens of kilohms with a capacitor.
            REGISTERS
                .smpr(channel / 10)
                .modify(|w| w.set_smp(channel % 10, SampleTime::CYCLES64_5));
        }
        REGISTERS.sqr1().write(|w| {
            w.set_l(ANALOG_INPUTS as u8 - 1);
            for (n, channel) in channels.into_iter().enumerate() {
                w.set_sq(n, channel);
            }
        });
        REGISTERS.cfgr().modify(|w| {
            w.set_res(Res::BITS16);
            w.set_cont(false);
            // The converter keeps requesting after a transfer's last word; each sequence starts a new transfer.
            w.set_dmngt(Dmngt::DMA_CIRCULAR);
        });
        Self {
            _adc: adc,
            conversions: Conversions::new(dma, interrupts),
        }
    }

    /// Stops a sequence whose reader was dropped halfway, and empties the converter's FIFO.
    fn settle() {
        if REGISTERS.cr().read().adstart() {
            REGISTERS.cr().modify(|w| w.set_adstp(Adstp::STOP));
            while REGISTERS.cr().read().adstart() {}
        }
        while REGISTERS.isr().read().eoc() {
            let _ = REGISTERS.dr().read();
        }
        // Writing ones clears the flags.
        REGISTERS.isr().write(|w| {
            w.set_eos(true);
            w.set_ovr(true);
        });
    }
}

impl AnalogInputs for AnalogSequence {
    type Error = LostWord;

    async fn read(&mut self) -> Result<Analog<u16>, LostWord> {
        Self::settle();
        let start = || REGISTERS.cr().modify(|w| w.set_adstart(true));
        let readings = self.conversions.take(start).await;
        if REGISTERS.isr().read().ovr() {
            return Err(LostWord);
        }
        Ok(readings)
    }
}
