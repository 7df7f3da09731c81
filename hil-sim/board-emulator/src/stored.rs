//! The firmware's stored parameters, laid into its flash before it starts.

use firmware::built_in;
use firmware::parameters;
use hil_sim::virtual_board::flash::VirtualFlash;
use model::vehicle::Vehicle;

use crate::Error;

/// The store's flash: the last two sectors of bank 2.
pub const REGION: u64 = 0x081C_0000;

/// What a board holds in its flash after it was told over its link to fly `vehicle`: address and bytes.
///
/// # Errors
/// [`Error::Vehicle`] when the firmware would not take it: a vehicle of another kind than the one it is built
/// for, or one that is not consistent in single precision.
pub fn set(vehicle: &Vehicle<f64>) -> Result<(u64, Vec<u8>), Error> {
    let refused = |why: String| Error::Vehicle(why);
    let parameters = vehicle.parameters().cast::<f32>();
    if parameters::schema(&parameters) != parameters::schema(&built_in::PARAMETERS) {
        return Err(refused(
            "the firmware is built for a vehicle with another set of parts (with or without a camera spar)".to_owned(),
        ));
    }
    let vehicle = Vehicle::new(parameters).map_err(|error| refused(error.to_string()))?;
    let flash = VirtualFlash::holding(&vehicle).ok_or_else(|| refused("it does not fit the store".to_owned()))?;
    Ok((REGION, flash.contents()))
}
