//! Differences between the simulated vehicle and its vehicle file: the table `[plant]` of a scenario.
//!
//! Every field is optional. A missing field takes the vehicle file's value, or that of a perfect part.

use std::collections::BTreeMap;

use model::vehicle::{NotSet, Vehicle, VehicleParameters};
use serde::Deserialize;

pub use crate::ranges::{Setting, SettingsError};
use crate::ranges::{settings_table, within};

settings_table! {
    /// One drive (motor, gearbox and wheel), relative to the vehicle file's common values of both drives.
    DriveSettings {
        /// Torque constant relative to the vehicle file's
        torque_constant_factor: 0.2 to 5.0 = 1.0,
        /// Back-EMF constant relative to the vehicle file's
        back_emf_factor: 0.2 to 5.0 = 1.0,
        /// Resistance relative to the vehicle file's
        resistance_factor: 0.1 to 10.0 = 1.0,
        /// Coulomb friction relative to the vehicle file's
        friction_factor: 0.0 to 100.0 = 1.0,
        /// Wheel radius relative to the vehicle file's
        wheel_radius_factor: 0.8 to 1.25 = 1.0,
        /// Play of the gearbox at its output, deg; with play, the next two fields give the gearbox's stiffness and damping
        backlash_deg: 0.0 to 10.0 = 0.0,
        /// Stiffness of the gearbox at its output, N m/rad; 0 means rigid, or 3000 with backlash
        gear_stiffness_n_m_per_rad: 0.0 to 1000000.0 = 0.0,
        /// Damping of the teeth in contact, N m s/rad at the output
        gear_damping_n_m_s_per_rad: 0.0 to 1000.0 = 1.0,
    }
}

settings_table! {
    /// The supply of the board.
    BoardSettings {
        /// Battery voltage below which the board is held in reset, V; 0 means never while the battery is connected
        brown_out_v: 0.0 to 60.0 = 0.0,
    }
}

pub use crate::imu::imperfection::ImuSettings;
pub use crate::supply::BatterySettings;

/// Differences between the simulated vehicle and its vehicle file.
#[derive(Debug, Clone, PartialEq, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct PlantSettings {
    /// Changed values of single fields of the vehicle file, by table.
    pub vehicle: BTreeMap<String, BTreeMap<String, f64>>,
    /// The left drive.
    pub left: DriveSettings,
    /// The right drive.
    pub right: DriveSettings,
    /// The IMU on the arm.
    pub arm_imu: ImuSettings,
    /// The IMU on the spar.
    pub spar_imu: ImuSettings,
    /// The battery's charge; without this table the open-circuit voltage is constant.
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

    /// The simulated vehicle: `vehicle` with the changed fields of `[plant.vehicle]`.
    ///
    /// # Errors
    /// A name that does not belong to the vehicle, the first value out of range, or a contradiction.
    pub fn vehicle_from(&self, vehicle: &Vehicle<f64>) -> Result<Vehicle<f64>, SettingsError> {
        if self.vehicle.is_empty() {
            return Ok(*vehicle);
        }
        let mut parameters = *vehicle.parameters();
        // The gains do not describe the simulated vehicle and must not cause a refusal.
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
