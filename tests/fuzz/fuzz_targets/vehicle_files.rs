//! Any text as a vehicle file: the reader refuses or reads it, and a written copy of the vehicle reads the same.
#![no_main]

use libfuzzer_sys::fuzz_target;
use vehicle_file::{VehicleFile, diff, parse, to_rust, to_toml};

fuzz_target!(|text: &str| {
    match parse("fuzzed.toml", text) {
        Err(error) => assert!(error.to_string().contains("fuzzed.toml")),
        Ok(VehicleFile::Planar(planar)) => assert!(planar.l > 0.0),
        Ok(VehicleFile::Vehicle(vehicle)) => {
            let Ok(VehicleFile::Vehicle(again)) = parse("again.toml", &to_toml(vehicle.parameters())) else {
                panic!("what is written is not read");
            };
            assert_eq!(again, vehicle);
            assert!(diff(again.parameters(), vehicle.parameters()).is_empty());
            // In the board's single precision, and as the board's build writes the set.
            let single = vehicle.parameters().cast::<f32>();
            let Ok(VehicleFile::Vehicle(again)) = parse("single.toml", &to_toml(&single)) else {
                panic!("what the board has is not read");
            };
            assert_eq!(again.parameters().cast::<f32>(), single);
            assert!(to_rust(&vehicle).contains("PARAMETERS"));
        }
    }
});
