//! An IMU on its own bus.

use embassy_stm32::gpio::{Output, Pull};
use embassy_stm32::mode::Async;
use embassy_stm32::spi::mode::Master;
use embassy_stm32::spi::{self, Spi};
use embassy_time::Delay;
use embedded_hal_bus::spi::ExclusiveDevice;

use crate::board::IMU_CLOCK;

/// An IMU on its own bus.
pub type ImuDevice = ExclusiveDevice<Spi<'static, Async, Master>, Output<'static>, Delay>;

/// The clock idles high, and the IMU samples on its second edge. A pull-up keeps the input of an unplugged IMU still.
pub fn config() -> spi::Config {
    let mut config = spi::Config::default();
    config.mode = spi::MODE_3;
    config.frequency = IMU_CLOCK;
    config.miso_pull = Pull::Up;
    config
}

/// The IMU at a bus and its chip select.
pub fn device(bus: Spi<'static, Async, Master>, select: Output<'static>) -> ImuDevice {
    match ExclusiveDevice::new(bus, select, Delay) {
        Ok(device) => device,
        Err(error) => match error {},
    }
}
