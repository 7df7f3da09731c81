//! How the simulated vehicle differs from the one in the vehicle file: the table `[plant]` of a scenario.
//!
//! Everything may be left out; what is left out is as the vehicle file has it, and perfect otherwise.

use std::collections::BTreeMap;

use model::vehicle::{NotSet, Vehicle, VehicleParameters};
use serde::Deserialize;

pub use crate::ranges::{Setting, SettingsError};
use crate::ranges::{settings_table, within};

settings_table! {
    /// One drive: motor, gearbox and wheel, against what the vehicle file says of both.
    DriveSettings {
        /// Torque constant over that of the file
        torque_constant_factor: 0.2 to 5.0 = 1.0,
        /// Back-EMF constant over that of the file
        back_emf_factor: 0.2 to 5.0 = 1.0,
        /// Resistance over that of the file
        resistance_factor: 0.1 to 10.0 = 1.0,
        /// Coulomb friction over that of the file
        friction_factor: 0.0 to 100.0 = 1.0,
        /// Wheel radius over that of the file
        wheel_radius_factor: 0.8 to 1.25 = 1.0,
        /// Play of the gearbox at its output, deg; with any, the gearbox is as stiff as the next two say
        backlash_deg: 0.0 to 10.0 = 0.0,
        /// Stiffness of the gearbox at its output, N m/rad; 0 is rigid, or 3000 where there is backlash
        gear_stiffness_n_m_per_rad: 0.0 to 1000000.0 = 0.0,
        /// Damping of the teeth in contact, N m s/rad at the output
        gear_damping_n_m_s_per_rad: 0.0 to 1000.0 = 1.0,
    }
}

settings_table! {
    /// What supplies the board.
    BoardSettings {
        /// Battery voltage below which the board is held in reset, V; 0 is never while the battery is connected
        brown_out_v: 0.0 to 60.0 = 0.0,
    }
}

pub use crate::imu::imperfection::ImuSettings;
pub use crate::supply::BatterySettings;

/// Differences between the simulated vehicle and its vehicle file.
#[derive(Debug, Clone, PartialEq, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct PlantSettings {
    /// Other values of single fields of the vehicle file, table by table.
    pub vehicle: BTreeMap<String, BTreeMap<String, f64>>,
    /// The left drive.
    pub left: DriveSettings,
    /// The right drive.
    pub right: DriveSettings,
    /// The IMU on the arm.
    pub arm_imu: ImuSettings,
    /// The IMU on the spar.
    pub spar_imu: ImuSettings,
    /// The battery's charge; without it the open-circuit voltage stays.
    pub battery: Option<BatterySettings>,
    /// The board's supply.
    pub board: BoardSettings,
}

/// Tables of the vehicle file that describe the controller, not the vehicle.
const CONTROLLER: [&str; 3] = ["control", "estimator", "safety"];

impl PlantSettings {
    /// Checks every value.
    ///
    /// # Errors
    /// The first value out of its range, with table and field. The fields of `[plant.vehicle]` are checked
    /// by [`PlantSettings::vehicle_from`], which knows what the vehicle has.
    pub fn check(&self) -> Result<(), SettingsError> {
        self.left.check("plant.left")?;
        self.right.check("plant.right")?;
        self.arm_imu.check("plant.arm_imu")?;
        self.spar_imu.check("plant.spar_imu")?;
        self.board.check("plant.board")?;
        self.battery.as_ref().map_or(Ok(()), BatterySettings::check)
    }

    /// The simulated vehicle: `vehicle` with the fields of `[plant.vehicle]`.
    ///
    /// # Errors
    /// A name that is no part of the vehicle, or the first value out of range, or a contradiction.
    pub fn vehicle_from(&self, vehicle: &Vehicle<f64>) -> Result<Vehicle<f64>, SettingsError> {
        if self.vehicle.is_empty() {
            return Ok(*vehicle);
        }
        let mut parameters = *vehicle.parameters();
        // Gains say nothing of the simulated vehicle and must not refuse it.
        parameters.control.kp = -1.0;
        if let Some((spar, _)) = &mut parameters.spar {
            (spar.spar_gain, spar.ballast_gain) = (0.0, 0.0);
            (spar.spar_rate_gain, spar.ballast_rate_gain) = (0.0, 0.0);
        }
        for (table, fields) in &self.vehicle {
            for (name, value) in fields {
                let number = parameters.number_of(table, name);
                let number = number.filter(|_| !CONTROLLER.contains(&table.as_str()));
                match number.map_or(Err(NotSet::NoSuchNumber), |number| parameters.set(number, *value)) {
                    Ok(()) => {}
                    Err(NotSet::OutOfRange(error)) => return Err(SettingsError::Vehicle(error.into())),
                    Err(NotSet::NoSuchNumber) => {
                        return Err(SettingsError::UnknownField {
                            name: format!("{table}.{name}"),
                            allowed: tables().join(", "),
                        });
                    }
                }
            }
        }
        Vehicle::new(parameters).map_err(SettingsError::Vehicle)
    }
}

/// The tables of a vehicle file that the plant simulates.
fn tables() -> Vec<&'static str> {
    let tables = VehicleParameters::<f64>::TABLES.iter().map(|table| table.name);
    tables.filter(|name| !CONTROLLER.contains(name)).collect()
}
