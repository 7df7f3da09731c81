//! A set of parameters as the store's bytes: each value has the hash of its name, so firmware with other
//! parameters finds the values that it knows.

use model::vehicle::{RENAMED, VehicleParameters};

use super::numbered::name_hash;
use super::version_1;

/// Longest stored set in bytes, a multiple of any flash's word.
pub(super) const SET_MAX: usize = 1024;
/// Bytes in front of the values: format, sequence number, number of values, 4 bytes each.
pub(super) const SET_HEADER: usize = 12;
/// Bytes of a value: the hash of its name, and the value.
pub(super) const VALUE: usize = 8;
/// Largest number of values of a stored set.
pub(super) const VALUES_MAX: usize = (SET_MAX - SET_HEADER) / VALUE;
/// First bytes of a stored set.
const FORMAT: [u8; 4] = *b"PAR2";

/// Encodes a set with its sequence number and returns the set's length in bytes; `None` if the set does not fit.
pub(super) fn encode(parameters: &VehicleParameters<f32>, sequence: u32, bytes: &mut [u8; SET_MAX]) -> Option<usize> {
    let count = parameters.count();
    let (header, values) = bytes.split_at_mut_checked(SET_HEADER)?;
    let words = [FORMAT, sequence.to_le_bytes(), u32::from(count).to_le_bytes()];
    for (slot, word) in header.chunks_exact_mut(4).zip(words) {
        slot.copy_from_slice(&word);
    }
    let mut slots = values.chunks_exact_mut(4);
    for number in 0..count {
        let (table, field) = parameters.field(number)?;
        slots
            .next()?
            .copy_from_slice(&name_hash(table, field.name).to_le_bytes());
        slots.next()?.copy_from_slice(&parameters.value(number)?.to_le_bytes());
    }
    Some(SET_HEADER + VALUE * usize::from(count))
}

/// A stored set as read from the flash.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct StoredSet {
    /// The set's sequence number; 0 for a set of version 1.
    pub sequence: u32,
    /// Whether the set has this version's format.
    pub present_format: bool,
    /// Hash of the name and value of each parameter.
    pub values: heapless::Vec<(u32, f32), VALUES_MAX>,
}

/// Decodes a stored set; `None` if the bytes are not a set.
pub(super) fn decode(bytes: &[u8]) -> Option<StoredSet> {
    let mut set = StoredSet {
        sequence: 0,
        present_format: false,
        values: heapless::Vec::new(),
    };
    if let Some(rest) = bytes.strip_prefix(&FORMAT) {
        let (sequence, rest) = rest.split_first_chunk::<4>()?;
        let (count, values) = rest.split_first_chunk::<4>()?;
        set.sequence = u32::from_le_bytes(*sequence);
        set.present_format = true;
        if values.len() != usize::try_from(u32::from_le_bytes(*count)).ok()?.checked_mul(VALUE)? {
            return None;
        }
        for value in values.chunks_exact(VALUE) {
            let (hash, value) = value.split_first_chunk::<4>()?;
            let value = f32::from_le_bytes(value.try_into().ok()?);
            set.values.push((u32::from_le_bytes(*hash), value)).ok()?;
        }
    } else {
        for value in version_1::values(bytes)? {
            set.values.push(value).ok()?;
        }
    }
    Some(set)
}

/// A set read by name.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct ByName {
    /// The parameters.
    pub parameters: VehicleParameters<f32>,
    /// Number of parameters that the set did not contain; they have their built-in values.
    pub as_built_in: u16,
    /// Number of values of the set whose names match no parameter.
    pub dropped: u16,
}

/// Reads a set by name for a vehicle of the kind of `built_in`.
///
/// # Errors
/// Number of the first parameter whose stored value is out of its range.
pub(super) fn read_by_name(stored: &StoredSet, built_in: &VehicleParameters<f32>) -> Result<ByName, u16> {
    read_with(stored, built_in, RENAMED)
}

/// [`read_by_name`] with another table of old and new names.
pub(super) fn read_with(
    stored: &StoredSet,
    built_in: &VehicleParameters<f32>,
    renamed: &[(&str, &str)],
) -> Result<ByName, u16> {
    let mut read = ByName {
        parameters: *built_in,
        as_built_in: 0,
        dropped: 0,
    };
    let mut taken = 0;
    for number in 0..built_in.count() {
        let name = built_in.field(number);
        match name.and_then(|(table, field)| find(stored, (table, field.name), renamed, RENAMES_MAX)) {
            Some(value) => {
                read.parameters.set(number, value).map_err(|_| number)?;
                taken += 1;
            }
            None => read.as_built_in += 1,
        }
    }
    read.dropped = (stored.values.len() as u16).saturating_sub(taken);
    Ok(read)
}

/// Largest number of changes of a parameter's name or table.
const RENAMES_MAX: u8 = 4;

/// The stored value of a parameter, under its present or an older name.
fn find(stored: &StoredSet, name: (&str, &str), renamed: &[(&str, &str)], renames: u8) -> Option<f32> {
    let (table, field) = name;
    let hash = name_hash(table, field);
    if let Some((_, value)) = stored.values.iter().find(|(known, _)| *known == hash) {
        return Some(*value);
    }
    let renames = renames.checked_sub(1)?;
    renamed.iter().find_map(|(old, new)| {
        let older = match (old.split_once('.'), new.split_once('.')) {
            (Some(older), Some(newer)) if newer == name => older,
            (None, None) if *new == table => (*old, field),
            _ => return None,
        };
        find(stored, older, renamed, renames)
    })
}
