//! The firmware's stored parameters, written into the flash before the firmware starts.

use firmware::drive_board::{FLASH_SECTOR_BYTES, PARAMETER_SECTORS};
use model::vehicle::Vehicle;
use virtual_board::board::flash::VirtualFlash;

use crate::error::Error;

/// End of the part's flash.
const FLASH_END: u64 = 0x0820_0000;
/// Address of the parameter store: the last sectors of bank 2.
pub const REGION: u64 = FLASH_END - (PARAMETER_SECTORS * FLASH_SECTOR_BYTES) as u64;

/// Flash contents, as address and bytes, of a board that received and stored `vehicle` over the link.
///
/// # Errors
/// [`Error::Vehicle`] when the vehicle is not consistent in single precision or does not fit the store.
pub fn set(vehicle: &Vehicle<f64>) -> Result<(u64, Vec<u8>), Error> {
    let refused = |why: String| Error::Vehicle(why);
    let vehicle = Vehicle::new(vehicle.parameters().cast::<f32>()).map_err(|error| refused(error.to_string()))?;
    let flash =
        VirtualFlash::holding(&vehicle).ok_or_else(|| refused("its parameters do not fit the store".to_owned()))?;
    Ok((REGION, flash.contents()))
}

/// Checks in the firmware's log that the firmware uses the parameter set in its flash.
///
/// # Errors
/// [`Error::Vehicle`] when the firmware does not: it was built for a vehicle with other parts, or from
/// other sources.
pub fn was_taken(log: &[String]) -> Result<(), Error> {
    if log.iter().any(|line| line.ends_with("parameters: stored set")) {
        return Ok(());
    }
    Err(Error::Vehicle(
        "the firmware does not fly the stored parameters: it is built for a vehicle with other parts (with or \
         without a camera spar), or from other sources"
            .to_owned(),
    ))
}
