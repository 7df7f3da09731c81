//! Analogue inputs on ADC1, in one sequence of 12-bit conversions that the reader starts and the DMA moves.
//!
//! The converter puts its twelve bits at the top of the word, so that a count stands for the same as one of sixteen
//! bits; the lowest four are always zero.

use embassy_stm32::Peri;
use embassy_stm32::adc::{Adc, RxDma};
use embassy_stm32::dma;
use embassy_stm32::gpio::{AnyPin, Flex};
use embassy_stm32::interrupt::typelevel::Binding;
use embassy_stm32::pac::adc::vals::{Align, Dds, SampleTime};
use embassy_stm32::pac::{self};
use embassy_stm32::peripherals::ADC1;
use firmware::hardware::AnalogInputs;
use model::analog::{ANALOG_INPUTS, Analog};

use super::clocks::TIMER_HZ;
use super::stm32_registers::conversions::{Conversions, LostWord};

/// The converter's registers.
const REGISTERS: pac::adc::Adc = pac::ADC1;

/// ADC1, set up for the sequence.
pub struct LeftAlignedSequence {
    _adc: Adc<'static, ADC1>,
    conversions: Conversions,
    /// A sequence was started whose words did not all come.
    under_way: bool,
}

// One register of the sequence is enough.
const _: () = assert!(ANALOG_INPUTS <= 6);

impl LeftAlignedSequence {
    /// Sets the sequence up. `channels` are the converter's, in the order of [`Analog`]. A converter of this part needs
    /// no calibration, but its `pins` come up as digital inputs.
    pub fn new<D: RxDma<ADC1>>(
        adc: Peri<'static, ADC1>,
        dma: Peri<'static, D>,
        interrupts: impl Binding<D::Interrupt, dma::InterruptHandler<D>> + 'static,
        channels: [u8; ANALOG_INPUTS],
        pins: [Peri<'static, AnyPin>; ANALOG_INPUTS],
    ) -> Self {
        for pin in pins {
            Flex::new(pin).set_as_analog();
        }
        // 27 MHz, a quarter of the bus clock.
        let adc = Adc::new(adc);
        for channel in channels.map(usize::from) {
            // 112 cycles at 27 MHz, 4 us: the source is a divider of tens of kilohms with a capacitor.
            let time = SampleTime::CYCLES112;
            if channel < 10 {
                REGISTERS.smpr2().modify(|w| w.set_smp(channel, time));
            } else {
                REGISTERS.smpr1().modify(|w| w.set_smp(channel - 10, time));
            }
        }
        REGISTERS.sqr1().write(|w| w.set_l(ANALOG_INPUTS as u8 - 1));
        REGISTERS.sqr3().write(|w| {
            for (n, channel) in channels.into_iter().enumerate() {
                w.set_sq(n, channel);
            }
        });
        REGISTERS.cr1().modify(|w| w.set_scan(true));
        REGISTERS.cr2().modify(|w| {
            w.set_align(Align::LEFT);
            w.set_cont(false);
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

    /// Ends a sequence whose reader was dropped halfway or whose words the DMA lost.
    fn settle(&mut self) {
        if self.under_way {
            // Without power the converter forgets the conversion that it was in, and the request that nothing answered.
            REGISTERS.cr2().modify(|w| {
                w.set_adon(false);
                w.set_dma(false);
            });
            REGISTERS.cr2().modify(|w| {
                w.set_adon(true);
                w.set_dma(true);
            });
            cortex_m::asm::delay(START_CYCLES);
        }
        // Writing zeros clears the flags; an overrun holds every request back until its flag is clear.
        REGISTERS.sr().write(|_| {});
    }
}

/// Core cycles of the 3 us that the converter takes to start.
const START_CYCLES: u32 = 3 * (TIMER_HZ / 1_000_000);

impl AnalogInputs for LeftAlignedSequence {
    type Error = LostWord;

    async fn read(&mut self) -> Result<Analog<u16>, LostWord> {
        self.settle();
        self.under_way = true;
        let start = || REGISTERS.cr2().modify(|w| w.set_swstart(true));
        let readings = self.conversions.take(start).await;
        if REGISTERS.sr().read().ovr() {
            return Err(LostWord);
        }
        self.under_way = false;
        Ok(readings)
    }
}
