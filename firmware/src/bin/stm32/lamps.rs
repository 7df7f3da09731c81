//! The lamps.

use embassy_stm32::gpio::{Level, Output};
use firmware::hardware::Indicators;

/// The board's lamps.
pub struct Lamps {
    /// Green: armed.
    pub armed: Output<'static>,
    /// Red: faulted.
    pub faulted: Output<'static>,
}

impl Indicators for Lamps {
    fn show(&mut self, armed: bool, faulted: bool) {
        self.armed.set_level(Level::from(armed));
        self.faulted.set_level(Level::from(faulted));
    }
}
