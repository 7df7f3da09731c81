//! The vehicles that the tests of the speed laws on the sampled planar vehicle share.
#![allow(dead_code)] // Each test binary uses part of it.

use model::vehicle::{GRAVITY_M_S2, Vehicle, VehicleParameters};
use theory::analysis::random_drive::SearchedLaw;

/// The reference vehicle, changed.
fn vehicle(change: impl FnOnce(&mut VehicleParameters<f64>)) -> Vehicle<f64> {
    let mut parameters = *vehicle_file::reference().expect("the reference vehicle").parameters();
    change(&mut parameters);
    Vehicle::new(parameters).expect("a vehicle")
}

/// The reference vehicle as a search flies it under `law`.
pub fn searched(law: SearchedLaw) -> Vehicle<f64> {
    vehicle(|p| *p = law.flown(p))
}

/// The vehicle of the thesis, (3.26), under `law`: no spar, no rotors, no smoothing, 0.42 g.
pub fn thesis_vehicle(law: SearchedLaw) -> Vehicle<f64> {
    vehicle(|p| {
        p.spar = None;
        p.drive_motor.rotor_inertia_kg_m2 = 0.0;
        p.drive_motor.current_limit_a = 90.0;
        p.safety.overcurrent_a = 100.0;
        p.control.acceleration_max_m_s2 = 0.42 * GRAVITY_M_S2;
        p.control.comfort_s = 0.0;
        *p = law.flown(p);
    })
}
