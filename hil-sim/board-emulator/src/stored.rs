//! The firmware's stored parameters, laid into its flash before it starts.

use virtual_board::board::flash::VirtualFlash;
use model::vehicle::Vehicle;

use crate::Error;

/// The store's flash: the last two sectors of bank 2.
pub const REGION: u64 = 0x081C_0000;

/// What a board holds in its flash after it was told over its link to fly `vehicle`: address and bytes.
///
/// # Errors
/// [`Error::Vehicle`] when it is not consistent in single precision.
pub fn set(vehicle: &Vehicle<f64>) -> Result<(u64, Vec<u8>), Error> {
    let refused = |why: String| Error::Vehicle(why);
    let vehicle = Vehicle::new(vehicle.parameters().cast::<f32>()).map_err(|error| refused(error.to_string()))?;
    let flash = VirtualFlash::holding(&vehicle).ok_or_else(|| refused("it does not fit the store".to_owned()))?;
    Ok((REGION, flash.contents()))
}

/// Whether the firmware took the set that was laid into its flash, by its log.
///
/// # Errors
/// [`Error::Vehicle`] when it did not: it is built for a vehicle with other parts, or from other sources.
pub fn was_taken(log: &[String]) -> Result<(), Error> {
    if log.iter().any(|line| line.ends_with("parameters: stored set")) {
        return Ok(());
    }
    Err(Error::Vehicle(
        "the firmware did not take it: it is built for a vehicle with other parts (with or without a camera spar), \
         or from other sources"
            .to_owned(),
    ))
}
