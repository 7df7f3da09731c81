//! Byte stuffing without moving bytes: COBS (Cheshire and Baker 1999, "Consistent Overhead Byte Stuffing"), in place.
//!
//! A stuffed message is the message with a byte before it. Every zero, and the byte before the message, is replaced by
//! the distance to the next zero or to the end. Stuffing and unstuffing therefore only write the zeros. The exception
//! is a run of 254 bytes without a zero: its distance is 255, and one additional byte follows the run.

/// The distance that does not end at a zero.
const FULL: u8 = 255;

/// Bytes in which [`stuff`] looks for zeros at once.
const EIGHT: usize = 8;

/// Stuffs the message in `wire[1..=length]`; the stuffed message may use the bytes behind it. Returns the length of
/// the stuffed message, which begins at `wire[0]`; `None` if there is no room.
pub fn stuff(wire: &mut [u8], length: usize) -> Option<usize> {
    let mut end = length.checked_add(1)?;
    // From the end, because the additional bytes of long runs move only the stuffed part.
    let (mut next, mut at) = (end, end);
    while at > 1 {
        let first = at.saturating_sub(EIGHT).max(1);
        let part = wire.get(first..at)?;
        let mut zeros = match part.first_chunk() {
            Some(eight) => zeros(*eight),
            None => zeros(core::array::from_fn(|i| part.get(i).copied().unwrap_or(1))),
        };
        // The lowest bit is that of the last zero.
        while zeros != 0 {
            let zero = first + (EIGHT - 1) - zeros.trailing_zeros() as usize / 8;
            zeros &= zeros - 1;
            end = hold(wire, zero, next, end)?;
            next = zero;
        }
        at = first;
    }
    hold(wire, 0, next, end)
}

/// The zeros among eight bytes: the highest bit of each that is one, the last byte's lowest.
fn zeros(eight: [u8; EIGHT]) -> u64 {
    // All bits but the highest of each byte: to these the same number can be added without a carry into the next byte.
    const LOW: u64 = u64::from_ne_bytes([0x7F; EIGHT]);
    let bytes = u64::from_be_bytes(eight);
    !(((bytes & LOW) + LOW) | bytes | LOW)
}

/// Writes the distance from `holder` to `next`: the next zero, or the end of the stuffed bytes. Returns that end.
#[inline]
fn hold(wire: &mut [u8], holder: usize, next: usize, end: usize) -> Option<usize> {
    let distance = next - holder;
    if distance < usize::from(FULL) {
        *wire.get_mut(holder)? = distance as u8;
        Some(end)
    } else {
        hold_run(wire, holder, next, end)
    }
}

/// As [`hold`] before a run of 254 bytes or more. The end moves by a byte for each full distance after which the run or the
/// message goes on.
#[cold]
fn hold_run(wire: &mut [u8], holder: usize, next: usize, end: usize) -> Option<usize> {
    *wire.get_mut(holder)? = FULL;
    let holder = holder + usize::from(FULL);
    if holder == end {
        return Some(end);
    }
    let rest = wire.get_mut(holder..=end)?;
    rest.copy_within(..rest.len().checked_sub(1)?, 1);
    hold(wire, holder, next + 1, end + 1)
}

/// Unstuffs a message in place; `None` if a distance is invalid.
pub fn unstuff(stuffed: &mut [u8]) -> Option<&mut [u8]> {
    let mut distance = *stuffed.first()?;
    let (mut at, mut end) = (0, stuffed.len());
    loop {
        let next = at + usize::from(distance);
        if distance == 0 || next > end {
            return None;
        }
        if next == end {
            return stuffed.get_mut(1..end);
        }
        let holder = stuffed.get_mut(next)?;
        let full = distance == FULL;
        distance = *holder;
        if full {
            stuffed.get_mut(next..end)?.copy_within(1.., 0);
            end -= 1;
            at = next - 1;
        } else {
            *holder = 0;
            at = next;
        }
    }
}

#[cfg(test)]
mod tests {
    use std::vec::Vec;

    use proptest::prelude::*;

    use super::*;

    fn stuffed(message: &[u8]) -> Vec<u8> {
        let mut wire = std::vec![0; cobs::max_encoding_length(message.len()) + 1];
        wire[1..=message.len()].copy_from_slice(message);
        let length = stuff(&mut wire, message.len()).expect("room");
        wire.truncate(length);
        wire
    }

    /// Messages with few zeros or many, around the lengths at which a run is full.
    fn messages() -> impl Strategy<Value = Vec<u8>> {
        let byte = prop_oneof![
            Just(prop_oneof![3 => Just(0_u8), 1 => any::<u8>()].boxed()),
            Just(prop_oneof![1 => Just(0_u8), 300 => 1..=255_u8].boxed()),
            Just((1..=255_u8).boxed()),
        ];
        (byte, prop_oneof![0..12_usize, 250..260_usize, 500..520_usize])
            .prop_flat_map(|(byte, length)| proptest::collection::vec(byte, length))
    }

    proptest! {
        /// Compares stuffing and unstuffing with the crate `cobs`.
        #[test]
        fn a_message_is_stuffed_as_another_program_stuffs_it(message in messages()) {
            let mut wire = stuffed(&message);
            let mut other = std::vec![0; cobs::max_encoding_length(message.len())];
            let length = cobs::encode(&message, &mut other);
            prop_assert_eq!(&wire[..], &other[..length]);
            prop_assert_eq!(unstuff(&mut wire), Some(&mut message.clone()[..]));
        }

        /// For any bytes without a zero, the result equals the crate's message or refusal.
        #[test]
        fn bytes_are_taken_as_another_program_takes_them(
            mut bytes in proptest::collection::vec(prop_oneof![3 => 1..8_u8, 1 => 1..=255_u8], 0..700),
        ) {
            let mut other = bytes.clone();
            let found = cobs::decode_in_place(&mut other).ok();
            let message = unstuff(&mut bytes).map(|message| message.to_vec());
            prop_assert_eq!(message, found.map(|length| other[..length].to_vec()));
        }
    }

    #[test]
    fn a_run_of_254_bytes_takes_a_byte_more_unless_it_ends_the_message() {
        for (length, added) in [(253, 1), (254, 1), (255, 2), (508, 2), (509, 3)] {
            let mut wire = stuffed(&std::vec![7; length]);
            assert_eq!(wire.len(), length + added, "{length}");
            assert_eq!(unstuff(&mut wire), Some(&mut std::vec![7; length][..]));
        }
    }

    #[test]
    fn a_zero_after_a_full_run_comes_back() {
        for run in [253, 254, 255, 507, 508, 509] {
            let message = [std::vec![7; run], std::vec![0, 7]].concat();
            assert_eq!(unstuff(&mut stuffed(&message)), Some(&mut message.clone()[..]), "{run}");
        }
    }

    #[test]
    fn a_message_without_room_and_a_zero_among_the_distances_are_refused() {
        assert_eq!(stuff(&mut [0, 7, 7], 3), None);
        assert_eq!(stuff(&mut [7; 256], 255), None);
        assert_eq!(stuff(&mut [7; 8], usize::MAX), None);
        assert_eq!(unstuff(&mut []), None);
        assert_eq!(unstuff(&mut [2, 7, 0, 1]), None);
        assert_eq!(unstuff(&mut [3, 7]), None);
    }
}
