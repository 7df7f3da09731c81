//! A vehicle's parameters for the link and the store: hashes that show whether two programs mean the same parameters,
//! and the number of the parameter in an error.

use model::vehicle::{ParameterError, Vehicle, VehicleParameters};

use crate::drive_board::SCALES;
use crate::image::CHECKSUM;

/// Hash of the names and ranges of every parameter of a vehicle of this kind, in order.
pub fn schema(parameters: &VehicleParameters<f32>) -> u32 {
    let mut digest = CHECKSUM.digest();
    for (table, field) in (0..parameters.count()).filter_map(|number| parameters.field(number)) {
        digest.update(table.as_bytes());
        digest.update(field.name.as_bytes());
        digest.update(&field.min.to_le_bytes());
        digest.update(&field.max.to_le_bytes());
    }
    digest.finalize()
}

/// Hash of a parameter's name, `table.field`, which identifies a value in a stored set.
pub(super) fn name_hash(table: &str, field: &str) -> u32 {
    let mut digest = CHECKSUM.digest();
    digest.update(table.as_bytes());
    digest.update(b".");
    digest.update(field.as_bytes());
    digest.finalize()
}

/// The vehicle with these parameters, if they are valid and this board's sensors can measure its limits.
pub(super) fn drivable(parameters: &VehicleParameters<f32>) -> Result<Vehicle<f32>, ParameterError> {
    let vehicle = Vehicle::new(*parameters)?;
    vehicle.check_on(&SCALES.sensor_ranges())?;
    Ok(vehicle)
}

/// Number of the parameter that an error names; `u16::MAX` if the vehicle has no such parameter.
pub(super) fn number_of(parameters: &VehicleParameters<f32>, error: &ParameterError) -> u16 {
    let (group, name) = match error {
        ParameterError::OutOfRange(out) => (out.group, out.field.name),
        ParameterError::Inconsistent { group, field, .. } | ParameterError::Unstable { group, field, .. } => {
            (*group, *field)
        }
    };
    parameters.number_of(group, name).unwrap_or(u16::MAX)
}
