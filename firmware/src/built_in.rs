//! The vehicle that this firmware was built for: constants that the build script writes from the vehicle file.

include!(concat!(env!("OUT_DIR"), "/vehicle.rs"));

/// Hash of the sources and of the vehicle file that this firmware was built from.
pub const BUILD_HASH: u32 = include!(concat!(env!("OUT_DIR"), "/build_hash.rs"));

#[cfg(test)]
mod tests {
    use model::vehicle::Vehicle;

    #[test]
    fn the_built_in_vehicle_is_valid_in_single_precision() {
        let vehicle = Vehicle::new(super::PARAMETERS).expect("valid");
        assert_eq!(vehicle.check_on(&crate::drive_board::SCALES.sensor_ranges()), Ok(()));
    }
}
