//! Any text as a scenario: the reader refuses or reads the text, and a scenario that was read gives a plant or a reason.
#![no_main]

use libfuzzer_sys::fuzz_target;
use model::vehicle::Vehicle;
use std::sync::OnceLock;
use virtual_board::scenario::Scenario;

static VEHICLE: OnceLock<Vehicle<f64>> = OnceLock::new();

fuzz_target!(|text: &str| {
    match Scenario::parse("fuzzed.toml", text) {
        Err(error) => assert!(error.to_string().contains("fuzzed.toml")),
        Ok(scenario) => {
            let vehicle = VEHICLE.get_or_init(|| vehicle_file::reference().expect("checked by its tests"));
            match scenario.plant(vehicle) {
                Err(error) => assert!(!error.to_string().is_empty()),
                Ok(plant) => assert!(plant.truth().speed_m_s.is_finite()),
            }
        }
    }
});
