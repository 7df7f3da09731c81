//! The interface between the emulated board and the vehicle around the board.

use firmware::drive_board::SCALES;

use crate::board::{BridgeOutput, MOTORS, SensedAtPins};

/// A vehicle around the board.
pub trait ClosedPlant: Send + Sync {
    /// Advances the vehicle by `seconds` with the bridges in the given states; returns what its sensors then
    /// measure.
    fn step(&mut self, seconds: f64, bridges: &[BridgeOutput; MOTORS]) -> SensedAtPins;

    /// Passes on what the drivers wrote to INTF_CONFIG1 of the IMUs (arm, spar), for a vehicle whose IMUs
    /// use it.
    fn configure_imus(&mut self, _intf_config1: [u8; 2]) {}

    /// A copy for a second run from this state on.
    fn fork(&self) -> Box<dyn ClosedPlant>;
}

/// The voltage in mV that converts to `count` of 65536 at 3.3 V full scale, within the converter's range.
pub fn millivolts(count: f64) -> u32 {
    (count * 3300.0 / 65536.0).round().clamp(0.0, 3300.0) as u32
}

/// Slopes of the current sensors' voltages, in uV per us, with `supply_v` across armatures of inductances
/// `windings_h`. The slope is 0 for an inductance of 0, which means a current without ripple.
pub fn slopes_uv_per_us(supply_v: f64, windings_h: [f64; MOTORS]) -> [u32; MOTORS] {
    let scales = SCALES.analog.currents();
    std::array::from_fn(|motor| {
        let inductance_h = windings_h[motor];
        if inductance_h <= 0.0 {
            return 0;
        }
        let amperes_per_us = supply_v / inductance_h * 1e-6;
        (amperes_per_us / f64::from(scales[motor].per_count) * 3_300_000.0 / 65536.0).round() as u32
    })
}
