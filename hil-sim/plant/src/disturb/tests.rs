//! The effects of steps and settings on the plant, compared with closed forms and balances.

mod electrics;
mod mechanics;
mod settings;

use model::vehicle::Vehicle;

use crate::motor::BridgeState;
use crate::settings::PlantSettings;
use crate::terrain::Terrain;
use crate::tests::{SCALES, bare_vehicle, reference_vehicle};
use crate::{MOTORS, Plant};

const OPEN: [BridgeState; MOTORS] = [BridgeState::Open; MOTORS];

fn level() -> Terrain {
    Terrain::slope(0.0, 0.8).expect("level")
}

/// Without friction in bearings and gearboxes.
fn frictionless(vehicle: &Vehicle<f64>) -> Vehicle<f64> {
    let mut parameters = *vehicle.parameters();
    parameters.body.bearing_damping_n_m_s = 0.0;
    parameters.drive_motor.coulomb_friction_n_m = 0.0;
    if let Some((spar, motor)) = &mut parameters.spar {
        spar.spar_damping_n_m_s = 0.0;
        motor.coulomb_friction_n_m = 0.0;
        motor.rotor_inertia_kg_m2 = 0.0;
    }
    Vehicle::new(parameters).expect("a vehicle")
}

fn plant(vehicle: &Vehicle<f64>, settings: &PlantSettings) -> Plant {
    Plant::with_settings(vehicle, &SCALES, level(), 1, settings).expect("a plant")
}

fn run(plant: &mut Plant, ms: usize, bridges: [BridgeState; MOTORS]) {
    for _ in 0..ms {
        plant.advance(1e-3, &bridges);
    }
}
