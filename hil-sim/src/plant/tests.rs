//! The whole plant.

use std::path::Path;

use model::vehicle::Vehicle;

/// The reference vehicle.
pub(super) fn reference_vehicle() -> Vehicle<f64> {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../vehicles/reference.toml");
    vehicle_file::read_vehicle(&file).unwrap()
}

/// The reference vehicle without its camera.
pub(super) fn bare_vehicle() -> Vehicle<f64> {
    let mut parameters = *reference_vehicle().parameters();
    parameters.camera = None;
    Vehicle::new(parameters).unwrap()
}
