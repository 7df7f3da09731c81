//! A trial start of a firmware, separate from the run.

use super::emulation::Emulation;
use super::settings::EmulationSettings;
use crate::elf::Firmware;
use crate::error::Error;
use crate::time::MS;
use crate::vehicle::{BenchVehicle, stored};

/// Battery voltage on the bench, V: any voltage at which the board starts.
const BATTERY_V: f64 = 24.0;
/// Time within which a firmware has logged which parameters it uses, ns. Boot loader, self-test and store take 105 ms.
const STARTED: u64 = 400 * MS;

/// Checks with a start on the bench that the firmware uses the parameters in these flash contents, given as addresses
/// and bytes.
///
/// # Errors
/// [`Error::Vehicle`] when the firmware does not, as [`stored::was_taken`]; otherwise as [`Emulation::power_on`].
pub fn takes_stored(firmware: &Firmware, contents: &[(u64, Vec<u8>)]) -> Result<(), Error> {
    let bench = Box::new(BenchVehicle::new(BATTERY_V));
    let mut emulation = Emulation::power_on_with(firmware, bench, EmulationSettings::default(), contents)?;
    emulation.run_until(STARTED)?;
    let log = emulation.at(|stopped| stopped.log_bytes(0))??;
    stored::was_taken(&firmware.decode(&log)?)
}
