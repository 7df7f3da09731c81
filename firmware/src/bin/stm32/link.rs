//! The host link: USART3 through the debugger's virtual COM port; the DMA receives into a ring buffer.

use embassy_stm32::gpio::Pull;
use embassy_stm32::mode::Async;
use embassy_stm32::usart::{Config, RingBufferedUartRx, Uart, UartTx};
use firmware::drive_board::LINK_BAUD;

/// Bytes of the ring buffer: 5.5 ms of the line at full rate, far longer than any task holds the thread.
const RING_BYTES: usize = 512;

/// Receiving half.
pub type LinkReceiver = RingBufferedUartRx<'static>;
/// Sending half.
pub type LinkSender = UartTx<'static, Async>;

/// The line's settings.
pub fn config() -> Config {
    let mut config = Config::default();
    config.baudrate = LINK_BAUD;
    // The line idles high, even when nothing is plugged in.
    config.rx_pull = Pull::Up;
    config
}

/// Splits the driver in two; the receiving half gets the ring buffer. To be called once.
pub fn split(uart: Uart<'static, Async>) -> (LinkSender, LinkReceiver) {
    static RING: static_cell::ConstStaticCell<[u8; RING_BYTES]> = static_cell::ConstStaticCell::new([0; RING_BYTES]);
    let (sender, receiver) = uart.split();
    (sender, receiver.into_ring_buffered(RING.take()))
}
