//! Settings as files give them.

use super::*;
use crate::settings::SettingsError;

#[test]
fn single_fields_of_the_vehicle_are_other_in_the_plant_only() {
    let settings: PlantSettings = toml::from_str(
        "[vehicle]\nbody.total_mass_kg = 16.0\nbody.arm_length_m = 0.24\ndrive_motor.resistance_ohm = 0.4\n",
    )
    .expect("settings");
    let vehicle = reference_vehicle();
    let changed = settings.vehicle_from(&vehicle).expect("a vehicle");
    let p = changed.parameters();
    assert_eq!(
        (p.body.total_mass_kg, p.body.arm_length_m, p.drive_motor.resistance_ohm),
        (16.0, 0.24, 0.4)
    );
    assert_eq!(p.body.half_track_m, vehicle.parameters().body.half_track_m);
    let plant = Plant::with_settings(&changed, &SCALES, level(), 1, &settings).expect("a plant");
    assert!((plant.body().inertia().total_mass - (16.0 + 4.08)).abs() < 1e-12);
    for (text, parts) in [
        (
            "[vehicle]\ncontrol.kp = 0.5\n",
            vec!["plant.vehicle.control.kp", "body"],
        ),
        (
            "[vehicle]\nbody.wings = 2.0\n",
            vec!["plant.vehicle.body.wings: unknown"],
        ),
        (
            "[vehicle]\nbody.total_mass_kg = nan\n",
            vec!["body.total_mass_kg = NaN", "0.05 to 2000"],
        ),
        (
            "[vehicle]\nbody.total_mass_kg = 3.0\n",
            vec!["arm_mass_kg", "less than total_mass_kg"],
        ),
    ] {
        let settings: PlantSettings = toml::from_str(text).expect(text);
        let message = settings.vehicle_from(&vehicle).expect_err(text).to_string();
        for part in parts {
            assert!(message.contains(part), "{message}");
        }
    }
}

#[test]
fn settings_out_of_range_are_refused_with_field_and_range() {
    for (text, expected) in [
        (
            "[left]\nwheel_radius_factor = 2.0\n",
            "plant.left.wheel_radius_factor = 2: allowed is 0.8 to 1.25",
        ),
        (
            "[right]\nbacklash_deg = -1.0\n",
            "plant.right.backlash_deg = -1: allowed is 0 to 10",
        ),
        (
            "[arm_imu]\nmisalignment_x_deg = nan\n",
            "plant.arm_imu.misalignment_x_deg = NaN: allowed is -180 to 180",
        ),
        (
            "[spar_imu]\ntemperature_c = 200.0\n",
            "plant.spar_imu.temperature_c = 200: allowed is -40 to 85",
        ),
        (
            "[board]\nbrown_out_v = 100.0\n",
            "plant.board.brown_out_v = 100: allowed is 0 to 60",
        ),
    ] {
        let settings: PlantSettings = toml::from_str(text).expect(text);
        let error = settings.check().expect_err(text);
        assert!(matches!(error, SettingsError::OutOfRange { .. }));
        assert_eq!(error.to_string(), expected);
    }
    assert!(toml::from_str::<PlantSettings>("[left]\nwings = 1.0\n").is_err());
    assert_eq!(PlantSettings::default().check(), Ok(()));
}
