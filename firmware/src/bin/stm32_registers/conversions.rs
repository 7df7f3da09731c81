//! One sequence of conversions of ADC1, started by the bridges' timer, moved by the DMA.

use embassy_stm32::Peri;
use embassy_stm32::adc::RxDma;
use embassy_stm32::dma::{self, Channel, TransferOptions};
use embassy_stm32::interrupt::typelevel::Binding;
use embassy_stm32::pac;
use embassy_stm32::peripherals::ADC1;
use model::analog::{ANALOG_INPUTS, Analog};

/// Value of EXTSEL, on both parts, with which TIM1's second trigger output starts the sequence (RM0433 25.4.19, RM0410
/// 15.6).
pub const TIM1_TRGO2: u8 = 10;

/// Channels in the order of the sequence, of `channels` in that of [`Analog`]: the currents' first, because the trigger times
/// them; the battery's, the list's first, last, because its source is slow to sample.
pub fn in_sequence(mut channels: [u8; ANALOG_INPUTS]) -> [u8; ANALOG_INPUTS] {
    channels.rotate_left(1);
    channels
}

/// No reading: the DMA lost a word of the converter, or the converter does not stop.
#[derive(Debug, Clone, Copy, PartialEq, Eq, defmt::Format)]
pub struct NoReading;

/// The DMA's end of the sequence.
pub struct Conversions {
    dma: Channel<'static>,
    request: dma::Request,
    words: [u16; ANALOG_INPUTS],
}

impl Conversions {
    /// Takes the channel.
    pub fn new<D: RxDma<ADC1>>(
        dma: Peri<'static, D>,
        interrupts: impl Binding<D::Interrupt, dma::InterruptHandler<D>> + 'static,
    ) -> Self {
        let request = dma.request();
        Self {
            dma: Channel::new(dma, interrupts),
            request,
            words: [0; ANALOG_INPUTS],
        }
    }

    /// Returns the words of the sequence that the next trigger starts. `start` enables the converter's trigger once
    /// the channel waits for the words.
    pub async fn take(&mut self, start: impl FnOnce()) -> Analog<u16> {
        let data = pac::ADC1.dr().as_ptr().cast::<u16>();
        // SAFETY: the buffer lives in `self`, which this future borrows; dropping the transfer stops the
        // stream. `self` lies in a task's static storage, which the DMA reaches.
        let transfer = unsafe {
            self.dma
                .read(self.request, data, &mut self.words, TransferOptions::default())
        };
        start();
        transfer.await;
        let mut words = self.words;
        words.rotate_right(1);
        Analog::from_values(words)
    }
}
