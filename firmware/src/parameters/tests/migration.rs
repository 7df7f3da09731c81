//! Sets that other firmware stored: fewer, more and renamed parameters, and version 0.1.

use std::vec::Vec;

use model::vehicle::{RENAMED, VehicleParameters};
use proptest::prelude::*;

use super::super::encoding::{SET_HEADER, SET_MAX, StoredSet, VALUE, decode, encode, read_by_name, read_with};
use super::super::numbered::name_hash;
use super::super::store::VERSION_1;
use super::super::{BootOutcome, Booted, Disbelief};
use super::{booted, built_in, load, now, store, stored, vehicle};
use crate::built_in::PARAMETERS;
use crate::test_flash::TestFlash;

/// A set that other firmware stored: names and values.
type Named<'a> = Vec<((&'a str, &'a str), f32)>;

/// Every parameter of this firmware with its value, and with the gain `kp`.
fn named(kp: f32) -> Named<'static> {
    let parameters = *vehicle(kp).parameters();
    (0..parameters.count())
        .map(|number| {
            let (table, field) = parameters.field(number).expect("a parameter");
            ((table, field.name), parameters.value(number).expect("a parameter"))
        })
        .collect()
}

/// The bytes of a set.
fn bytes(named: &Named, sequence: u32) -> Vec<u8> {
    let mut bytes = b"PAR2".to_vec();
    bytes.extend(sequence.to_le_bytes());
    bytes.extend((named.len() as u32).to_le_bytes());
    for ((table, field), value) in named {
        bytes.extend(name_hash(table, field).to_le_bytes());
        bytes.extend(value.to_le_bytes());
    }
    bytes
}

/// A flash to which other firmware stored a set.
fn flash_with(named: &Named) -> TestFlash {
    let mut store = store(TestFlash::new());
    assert!(now(store.write(1, &bytes(named, 1))), "the set does not fit");
    store.flash.0
}

fn decoded(named: &Named) -> StoredSet {
    decode(&bytes(named, 1)).expect("a set")
}

#[test]
fn a_set_of_this_firmware_is_not_migrated() {
    let mut encoded = [0; SET_MAX];
    let length = encode(vehicle(0.5).parameters(), 7, &mut encoded).expect("fits");
    assert_eq!(encoded[..length], bytes(&named(0.5), 7)[..]);
    assert_eq!(length, SET_HEADER + VALUE * usize::from(PARAMETERS.count()));
    assert_eq!(load(flash_with(&named(0.5))), booted(0.5));
}

#[test]
fn a_set_with_fewer_parameters_takes_the_new_ones_as_built_in() {
    let mut fewer = named(0.5);
    fewer.retain(|((table, field), _)| *table != "estimator" && *field != "ki");
    let lost = named(0.5).len() - fewer.len();
    assert_eq!(lost, 5);
    let found = load(flash_with(&fewer));
    assert_eq!(
        found.outcome,
        BootOutcome::Migrated {
            as_built_in: 5,
            dropped: 0
        }
    );
    assert_eq!(found.vehicle, vehicle(0.5));
}

#[test]
fn a_set_with_more_parameters_in_another_order_keeps_what_is_known() {
    let mut more = named(0.5);
    more.insert(3, (("control", "feed_forward"), 1.5));
    more.push((("lights", "brightness"), f32::NAN));
    more.reverse();
    let found = load(flash_with(&more));
    assert_eq!(
        found.outcome,
        BootOutcome::Migrated {
            as_built_in: 0,
            dropped: 2
        }
    );
    assert_eq!(found.vehicle, vehicle(0.5));
}

#[test]
fn renamed_parameters_and_tables_are_found_under_their_old_names() {
    let renamed = [
        ("gains", "control"),
        ("gains.kp_old", "gains.kp"),
        ("control.ki_once", "control.ki_twice"),
        ("control.ki_twice", "control.ki"),
        // Swapped names end the search, too.
        ("control.kd", "control.swing_gain"),
        ("control.swing_gain", "control.kd"),
    ];
    let mut old = named(0.5);
    for ((table, field), value) in &mut old {
        if *table == "control" {
            match *field {
                "ki" => (*field, *value) = ("ki_once", 0.07),
                "kp" => (*table, *field) = ("gains", "kp_old"),
                _ => *table = "gains",
            }
        }
    }
    let read = read_with(&decoded(&old), &PARAMETERS, &renamed).expect("in range");
    assert_eq!((read.as_built_in, read.dropped), (0, 0));
    let mut expected = *vehicle(0.5).parameters();
    expected.control.ki = 0.07;
    assert_eq!(read.parameters, expected);
    // A new name takes precedence over an old name.
    old.push((("control", "ki"), 0.09));
    let read = read_with(&decoded(&old), &PARAMETERS, &renamed).expect("in range");
    assert_eq!((read.parameters.control.ki, read.dropped), (0.09, 1));
    // An old name of one table does not apply to another table.
    let read = read_with(&decoded(&old), &PARAMETERS, &[("gains", "steering")]).expect("in range");
    assert!(read.as_built_in > 10, "{}", read.as_built_in);
    // Without the table of old names the values are lost.
    let read = read_with(&decoded(&old), &PARAMETERS, &[]).expect("in range");
    assert!(read.as_built_in > 10, "{}", read.as_built_in);
}

#[test]
fn a_migrated_set_stays_in_the_flash_until_the_next_store() {
    let mut fewer = named(0.5);
    fewer.retain(|((_, field), _)| *field != "ki");
    let flash = flash_with(&fewer);
    let mut booting = store(flash.clone());
    let found = now(booting.load(&built_in()));
    assert_eq!(booting.flash.0.bytes, flash.bytes, "the boot writes");
    let mut storing = store(flash);
    now(storing.store(&found.vehicle)).expect("stored");
    assert_eq!(load(storing.flash.0), booted(0.5));
}

#[test]
fn a_stored_value_out_of_range_or_a_contradiction_is_not_believed() {
    const EQ_3_25: f32 = 0.0;
    let kp = PARAMETERS.number_of("control", "kp").expect("known");
    for (value, why) in [
        (f32::NAN, Disbelief::OutOfRange(kp)),
        (f32::INFINITY, Disbelief::OutOfRange(kp)),
        (5.1, Disbelief::OutOfRange(kp)),
        (4.9, Disbelief::Inconsistent(kp)),
    ] {
        let mut stored = named(0.5);
        for ((_, field), slot) in &mut stored {
            match *field {
                "kp" => *slot = value,
                "law" => *slot = EQ_3_25,
                _ => {}
            }
        }
        assert_eq!(
            load(flash_with(&stored)),
            Booted {
                vehicle: built_in(),
                outcome: BootOutcome::NotBelieved(why)
            }
        );
    }
}

/// The built-in set of version 0.1, as that version stored it.
const VERSION_0_1: &[u8] = include_bytes!("version_1.bin");
const VERSION_0_1_WITHOUT_CAMERA: &[u8] = include_bytes!("version_1_without_camera.bin");
/// Place of `control.kp` among the parameters of version 0.1 with a camera.
const KP: usize = 43;

/// A flash to which version 0.1 stored two sets, the last with this gain.
fn version_0_1(kp: f32) -> TestFlash {
    let mut store = store(TestFlash::new());
    for kp in [0.1, kp] {
        let mut set = VERSION_0_1.to_vec();
        set[8 + 4 * KP..][..4].copy_from_slice(&kp.to_le_bytes());
        now(store.put(VERSION_1, &set));
    }
    store.flash.0
}

#[test]
fn a_set_of_version_0_1_is_migrated() {
    let found = load(version_0_1(0.4));
    let BootOutcome::Migrated { as_built_in, dropped } = found.outcome else {
        panic!("{:?}", found.outcome);
    };
    // Each value of the set belongs to a parameter, under its name or a newer name.
    assert_eq!(
        (usize::from(as_built_in) + 66, dropped),
        (usize::from(PARAMETERS.count()), 0)
    );
    assert_eq!(found.vehicle.parameters().control.kp, 0.4);
    assert_eq!(found.vehicle.parameters().body.wheel_radius_m, 0.25);
    // The next store keeps the set, after which no boot reads the set of version 0.1.
    let mut store = store(version_0_1(0.4));
    now(store.store(&found.vehicle)).expect("stored");
    let again = load(store.flash.0);
    assert_eq!((again.outcome, again.vehicle), (BootOutcome::Stored, found.vehicle));
}

#[test]
fn a_set_of_version_0_1_without_a_camera_keeps_what_both_have() {
    let stored = decode(VERSION_0_1_WITHOUT_CAMERA).expect("a set");
    let all = decode(VERSION_0_1).expect("a set");
    assert_eq!((stored.values.len(), all.values.len()), (46, 66));
    for value in &stored.values {
        assert!(
            all.values.contains(value),
            "the two vehicles differ by more than the camera"
        );
    }
    let read = read_by_name(&stored, &PARAMETERS).expect("in range");
    assert_eq!(usize::from(read.as_built_in) + 46, usize::from(PARAMETERS.count()));
    let without = VehicleParameters::<f32> {
        spar: None,
        ..PARAMETERS
    };
    let read = read_by_name(&all, &without).expect("in range");
    // Version 0.1 had every parameter of the camera except the four for the heat of its motor and bridge.
    assert_eq!(read.dropped + 4, PARAMETERS.count() - without.count());
}

#[test]
fn an_unknown_schema_of_version_0_1_is_not_believed() {
    let mut set = VERSION_0_1.to_vec();
    set[0] ^= 1;
    assert_eq!(decode(&set), None);
    assert_eq!(decode(&VERSION_0_1[..VERSION_0_1.len() - 4]), None);
    let mut store = store(TestFlash::new());
    now(store.put(VERSION_1, &set));
    assert_eq!(
        load(store.flash.0).outcome,
        BootOutcome::NotBelieved(Disbelief::Unreadable)
    );
}

#[test]
fn every_name_has_a_hash_of_its_own() {
    let mut hashes: Vec<u32> = decode(VERSION_0_1).expect("a set").values.iter().map(|v| v.0).collect();
    for ((table, name), _) in named(0.5) {
        hashes.push(name_hash(table, name));
        // Version 0.1 has another entry for a parameter only where the parameter had another name.
        for (old, new) in RENAMED {
            if let (Some((table_before, name_before)), Some(now)) = (old.split_once('.'), new.split_once('.'))
                && now == (table, name)
            {
                // The table may have had another name, too.
                let tables = RENAMED.iter().filter(|(_, new)| *new == table_before);
                let mut tables = tables.map(|(old, _)| *old).chain([table_before]);
                assert!(
                    tables.any(|table| hashes.contains(&name_hash(table, name_before))),
                    "{old} was no parameter"
                );
            }
        }
    }
    hashes.sort_unstable();
    hashes.dedup();
    let names = named(0.5);
    let old = decode(VERSION_0_1).expect("a set");
    let kept = names
        .iter()
        .filter(|((table, name), _)| old.values.iter().any(|(hash, _)| *hash == name_hash(table, name)))
        .count();
    assert_eq!(hashes.len(), names.len() + old.values.len() - kept);
}

proptest! {
    /// Bytes that are no set, and sets with any values, lead to no panic and to no value out of its range.
    #[test]
    fn any_bytes_are_read_or_refused(
        bytes in proptest::collection::vec(any::<u8>(), 0..SET_MAX),
        format in any::<bool>(),
        values in proptest::collection::vec((0_u16..80, any::<f32>()), 0..VALUES),
    ) {
        let mut noise = bytes;
        if format {
            noise.splice(0..noise.len().min(4), *b"PAR2");
        }
        if let Some(set) = decode(&noise) {
            let _ = read_by_name(&set, &PARAMETERS);
        }
        let names = named(0.5);
        let some: Named = values.iter().filter_map(|(n, v)| Some((names.get(usize::from(*n))?.0, *v))).collect();
        if let Ok(read) = read_by_name(&decoded(&some), &PARAMETERS) {
            for number in 0..PARAMETERS.count() {
                let value = read.parameters.value(number).expect("a parameter");
                prop_assert!(PARAMETERS.clone().set(number, value).is_ok());
            }
            prop_assert!(usize::from(read.dropped) <= some.len());
        }
    }

    /// The store reads a set by name, whichever parameters it lacks and whichever it has in addition.
    #[test]
    fn any_other_schema_is_migrated(missing in any::<[bool; 80]>(), added in 0_u16..20, kp in 0.0_f32..0.7) {
        let mut other = named(kp);
        let all = other.len();
        let mut keep = missing.iter().map(|missing| !missing);
        other.retain(|_| keep.next().unwrap_or(true));
        let kept = other.len();
        let names: Vec<std::string::String> = (0..added).map(|n| std::format!("new_{n}")).collect();
        other.extend(names.iter().map(|name| (("control", name.as_str()), 1.0)));
        let found = load(flash_with(&other));
        let kp_kept = other.iter().any(|((_, field), _)| *field == "kp");
        prop_assert_eq!(found.vehicle, if kp_kept { vehicle(kp) } else { built_in() });
        let as_built_in = (all - kept) as u16;
        prop_assert_eq!(found.outcome, if as_built_in == 0 && added == 0 {
            BootOutcome::Stored
        } else {
            BootOutcome::Migrated { as_built_in, dropped: added }
        });
        prop_assert_eq!(load(stored(flash_with(&other), 0.3)), booted(0.3));
    }
}

/// Largest number of values in a set of these tests.
const VALUES: usize = 100;
