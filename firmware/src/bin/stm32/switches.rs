//! The switches: the emergency stop and the board's own button.

use embassy_stm32::gpio::Input;
use firmware::hardware::EmergencyStop;

/// The first contact of the emergency stop, normally closed to ground, with a pull-up: an open wire reads as
/// a press.
pub struct StopContact(pub Input<'static>);

impl EmergencyStop for StopContact {
    fn is_pressed(&mut self) -> bool {
        self.0.is_high()
    }
}

/// The board's own button: the board pulls its pin down, the pressed button pulls it up.
pub struct UserButton(Input<'static>);

impl UserButton {
    /// The button on its pin.
    pub fn new(pin: Input<'static>) -> Self {
        Self(pin)
    }

    /// Whether someone presses the button now.
    pub fn is_pressed(&self) -> bool {
        self.0.is_high()
    }
}
