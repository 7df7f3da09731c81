//! A start of a firmware apart from the run that it is for.

use super::emulation::Emulation;
use super::settings::EmulationSettings;
use crate::elf::Firmware;
use crate::error::Error;
use crate::time::MS;
use crate::vehicle::{BenchVehicle, stored};

/// Battery voltage on the bench, V: any at which the board starts.
const BATTERY_V: f64 = 24.0;
/// Time within which a firmware has logged which parameters it flies, ns: boot loader, self-test and store take 105 ms.
const STARTED: u64 = 400 * MS;

/// Whether the firmware flies the parameters in these contents of the flash, as addresses and bytes, by a start on the bench.
///
/// # Errors
/// [`Error::Vehicle`] when it does not, as [`stored::was_taken`]; as [`Emulation::power_on`].
pub fn takes_stored(firmware: &Firmware, contents: &[(u64, Vec<u8>)]) -> Result<(), Error> {
    let bench = Box::new(BenchVehicle::new(BATTERY_V));
    let mut emulation = Emulation::power_on_with(firmware, bench, EmulationSettings::default(), contents)?;
    emulation.run_until(STARTED)?;
    let log = emulation.at(|stopped| stopped.log_bytes(0))??;
    stored::was_taken(&firmware.decode(&log)?)
}
