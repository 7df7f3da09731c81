//! A vehicle's parameters by number: how many there are, their names, values and changes, and the hashes that tell
//! whether two programs mean the same by a number or by a name.

use crc::{CRC_32_ISCSI, Crc};
use model::vehicle::{Field, ParameterError, VehicleParameters};

pub(super) const HASH: Crc<u32> = Crc::<u32>::new(&CRC_32_ISCSI);

/// Hash of the names and ranges of every parameter of a vehicle of this kind, in order.
pub fn schema(parameters: &VehicleParameters<f32>) -> u32 {
    let mut digest = HASH.digest();
    parameters.for_each(|table, field, _| {
        digest.update(table.as_bytes());
        digest.update(field.name.as_bytes());
        digest.update(&field.min.to_le_bytes());
        digest.update(&field.max.to_le_bytes());
    });
    digest.finalize()
}

/// Hash of a parameter's name, `table.field`: what a stored set knows a value by.
pub(super) fn name_hash(table: &str, field: &str) -> u32 {
    let mut digest = HASH.digest();
    digest.update(table.as_bytes());
    digest.update(b".");
    digest.update(field.as_bytes());
    digest.finalize()
}

/// How many parameters a vehicle has.
pub fn count(parameters: &VehicleParameters<f32>) -> u16 {
    let mut count = 0;
    parameters.for_each(|_, _, _| count += 1);
    count
}

/// Table and field of one parameter; `None` if no parameter has this number.
pub fn field(parameters: &VehicleParameters<f32>, number: u16) -> Option<(&'static str, &'static Field)> {
    let (mut at, mut found) = (0, None);
    parameters.for_each(|table, field, _| {
        if at == number {
            found = Some((table, field));
        }
        at += 1;
    });
    found
}

/// The value of one parameter; `None` if no parameter has this number.
pub fn value(parameters: &VehicleParameters<f32>, number: u16) -> Option<f32> {
    let (mut at, mut found) = (0, None);
    parameters.for_each(|_, _, value| {
        if at == number {
            found = Some(value);
        }
        at += 1;
    });
    found
}

/// Why a parameter was not changed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Refused {
    /// No parameter has this number.
    NoSuchNumber,
    /// The value is out of range: least and most allowed value.
    OutOfRange(f32, f32),
}

/// Changes one parameter.
///
/// # Errors
/// [`Refused`]; the parameters stay as they are.
pub fn set(parameters: &mut VehicleParameters<f32>, number: u16, value: f32) -> Result<(), Refused> {
    let (table, field) = field(parameters, number).ok_or(Refused::NoSuchNumber)?;
    if !field.allows(f64::from(value)) {
        return Err(Refused::OutOfRange(field.min as f32, field.max as f32));
    }
    let slot = parameters.field_mut(table, field.name).ok_or(Refused::NoSuchNumber)?;
    *slot = value;
    Ok(())
}

/// Number of the parameter that an error names; `u16::MAX` if the vehicle has no such parameter.
pub(super) fn number_of(parameters: &VehicleParameters<f32>, error: &ParameterError) -> u16 {
    let (group, name) = match error {
        ParameterError::OutOfRange(out) => (out.group, out.field.name),
        ParameterError::Inconsistent { group, field, .. } | ParameterError::Unstable { group, field, .. } => {
            (*group, *field)
        }
    };
    number_named(parameters, group, name).unwrap_or(u16::MAX)
}

/// Number of the field `name` of the table `table`; `None` if the vehicle has no such parameter.
pub(super) fn number_named(parameters: &VehicleParameters<f32>, table: &str, name: &str) -> Option<u16> {
    (0..count(parameters))
        .find(|number| field(parameters, *number).is_some_and(|(group, field)| group == table && field.name == name))
}
