//! Tests of the whole plant.

use std::path::Path;

use model::board::BoardScales;
use model::vehicle::Vehicle;

use super::*;
use crate::body::FORWARD;
use crate::noise::Noise;
use crate::terrain::Terrain;

mod ground;
mod numerics;

/// The drive board's scales.
pub(super) const SCALES: BoardScales = BoardScales::EXAMPLE;

/// The reference vehicle.
pub(super) fn reference_vehicle() -> Vehicle<f64> {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../vehicles/reference.toml");
    vehicle_file::read_vehicle(&file).unwrap()
}

/// The reference vehicle without its camera.
pub(super) fn bare_vehicle() -> Vehicle<f64> {
    let mut parameters = *reference_vehicle().parameters();
    parameters.spar = None;
    Vehicle::new(parameters).unwrap()
}

/// The vehicle without its camera and without friction in bearings and gearboxes, which coasts for ever.
fn coasting_vehicle() -> Vehicle<f64> {
    let mut parameters = *bare_vehicle().parameters();
    parameters.body.bearing_damping_n_m_s = 0.0;
    parameters.drive_motor.coulomb_friction_n_m = 0.0;
    Vehicle::new(parameters).unwrap()
}

/// Sets the vehicle rolling.
fn roll(plant: &mut Plant, speed_m_s: f64) {
    let (_, u) = plant.body_mut().state_mut();
    u[FORWARD] = speed_m_s;
    u[RIGHT] = speed_m_s / 0.25;
    u[LEFT] = speed_m_s / 0.25;
}

const OPEN: [BridgeState; MOTORS] = [BridgeState::Open; MOTORS];

fn terrain(text: &str) -> Terrain {
    toml::from_str(text).unwrap()
}

fn slope(slope_x_rad: f64) -> Terrain {
    Terrain::slope(slope_x_rad, 0.8).unwrap()
}

fn drive(left: f64, right: f64, camera: f64) -> [BridgeState; MOTORS] {
    [left, right, camera].map(BridgeState::Duty)
}

/// Switches an IMU on in the same way as the firmware.
fn start_imu(chip: &mut Icm42688pModel) {
    chip.transfer(&mut [0x4f, 0x25, 0x25]);
    chip.transfer(&mut [0x52, 0x33]);
    chip.transfer(&mut [0x4e, 0x0f]);
}

/// Accelerometer and gyro, in LSB.
fn read_imu(chip: &mut Icm42688pModel) -> [i16; 6] {
    let mut bytes = [0; 13];
    bytes[0] = 0x1f | 0x80;
    chip.transfer(&mut bytes);
    core::array::from_fn(|i| i16::from_be_bytes([bytes[1 + 2 * i], bytes[2 + 2 * i]]))
}

#[test]
fn on_the_level_it_stands_and_its_sensors_say_so() {
    let mut plant = Plant::new(&reference_vehicle(), &SCALES, slope(0.0), 3).unwrap();
    start_imu(plant.arm_imu());
    start_imu(plant.spar_imu().unwrap());
    for _ in 0..500 {
        plant.advance(1e-3, &OPEN);
    }
    let truth = plant.truth();
    assert!(truth.x_m.abs() < 1e-9 && truth.phi_rad.abs() < 1e-9);
    assert_eq!(plant.counters(), [0; 3]);
    for chip in 0..2 {
        let words = if chip == 0 {
            read_imu(plant.arm_imu())
        } else {
            read_imu(plant.spar_imu().unwrap())
        };
        // Bias of a few mg (4 LSB each) and a few tenths of a deg/s (33 LSB each): the readings are not
        // exactly 0 and 1 g.
        assert!((i32::from(words[2]) - 4096).abs() < 40, "{words:?}");
        assert!(
            words[..2].iter().all(|a| a.abs() < 40) && words[3..].iter().all(|w| w.abs() < 35),
            "{words:?}"
        );
        assert!(words[3..].iter().any(|w| *w != 0), "a real gyro is never quite zero");
    }
    let analog = plant.analog();
    let (battery, current) = (SCALES.analog.battery_voltage, SCALES.analog.left_current);
    assert!((battery.value(analog.battery_voltage) - 25.188).abs() < 0.015);
    assert!(analog.currents().iter().all(|c| c.abs_diff(current.zero_count) < 12));
    let weight: f64 = truth.normal_n.iter().sum();
    assert!((weight - (13.6 + 0.51 + 1.53 + 2.04) * 9.81).abs() < 1e-3, "{weight} N");
}

#[test]
fn a_disarmed_vehicle_rolls_away_and_is_not_righted() {
    let mut plant = Plant::new(&reference_vehicle(), &SCALES, slope(0.0873), 3).unwrap();
    for _ in 0..3000 {
        plant.advance(1e-3, &OPEN);
    }
    let truth = plant.truth();
    // Without losses the vehicle would be at 0.5 g sin(5 deg) t^2 = 3.8 m; damping and the wheels' inertia
    // reduce the distance.
    assert!((-3.8..-0.5).contains(&truth.x_m), "{} m", truth.x_m);
    assert!(truth.speed_m_s < -0.5, "and is still rolling: {} m/s", truth.speed_m_s);
    assert!(
        truth.current_a.iter().all(|i| *i == 0.0),
        "no current flows through open bridges"
    );
    // Only a gearbox friction that can carry the slope's torque may hold the vehicle: 8.7 N m here, 4.4 N m
    // per side.
    let mut parameters = *reference_vehicle().parameters();
    parameters.drive_motor.coulomb_friction_n_m = 5.0;
    let mut held = Plant::new(&Vehicle::new(parameters).unwrap(), &SCALES, slope(0.0873), 3).unwrap();
    for _ in 0..10_000 {
        held.advance(1e-3, &OPEN);
        // Arm and wheels rock as one body.
        let truth = held.truth();
        assert!(truth.x_m.abs() < 0.15, "{truth:?}");
        assert!(
            (truth.wheel_rate_rad_s[0] + truth.phi_rate_rad_s).abs() < 2e-6,
            "{truth:?}"
        );
    }
    // With chocks the vehicle stands; without them it rolls.
    let mut plant = Plant::new(&reference_vehicle(), &SCALES, slope(0.0873), 3).unwrap();
    plant.set_chocked(true);
    for _ in 0..1000 {
        plant.advance(1e-3, &OPEN);
    }
    assert!(plant.truth().x_m.abs() < 2e-5, "{}", plant.truth().x_m);
    plant.set_chocked(false);
    for _ in 0..1000 {
        plant.advance(1e-3, &OPEN);
    }
    assert!(plant.truth().x_m < -0.1);
}
