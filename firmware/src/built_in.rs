//! The vehicle that this firmware was built for: constants that the build script writes from the vehicle file.

include!(concat!(env!("OUT_DIR"), "/vehicle.rs"));

#[cfg(test)]
mod tests {
    use model::vehicle::Vehicle;

    #[test]
    fn the_built_in_vehicle_is_valid_in_single_precision() {
        assert!(Vehicle::new(super::PARAMETERS).is_ok());
    }
}
