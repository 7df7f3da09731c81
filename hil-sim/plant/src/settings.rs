//! How the simulated vehicle differs from the one in the vehicle file: the table `[plant]` of a scenario.
//!
//! Everything may be left out; what is left out is as the vehicle file has it, and perfect otherwise.

use std::collections::BTreeMap;

use model::vehicle::{ParameterError, Vehicle};
use serde::Deserialize;
use thiserror::Error;

/// One number of a settings table.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Setting {
    /// Its name, unit included.
    pub name: &'static str,
    /// What it is.
    pub meaning: &'static str,
    /// Smallest allowed value.
    pub min: f64,
    /// Largest allowed value.
    pub max: f64,
    /// Its value if left out.
    pub default: f64,
}

/// What is wrong with the settings.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum SettingsError {
    /// A value is out of its range or not a number.
    #[error("{field} = {value}: allowed is {min} to {max}")]
    OutOfRange {
        /// Table and name.
        field: String,
        /// The value.
        value: f64,
        /// Smallest allowed value.
        min: f64,
        /// Largest allowed value.
        max: f64,
    },
    /// A name of `[plant.vehicle]` that is no part of the simulated vehicle.
    #[error("plant.vehicle.{name}: unknown name: allowed are the fields of {allowed}, where the vehicle has them")]
    UnknownField {
        /// Table and field.
        name: String,
        /// The tables allowed.
        allowed: String,
    },
    /// The changed vehicle is none.
    #[error("plant.vehicle: {0}")]
    Vehicle(ParameterError),
    /// The curve of the open-circuit voltage is none.
    #[error("plant.battery.open_circuit_v: {0}")]
    Curve(&'static str),
}

/// Refuses a value outside its range, NaN included.
pub(crate) fn within(field: impl Into<String>, value: f64, min: f64, max: f64) -> Result<(), SettingsError> {
    if value >= min && value <= max {
        Ok(())
    } else {
        Err(SettingsError::OutOfRange {
            field: field.into(),
            value,
            min,
            max,
        })
    }
}

/// Defines a table of numbers, each with its meaning, range and default.
macro_rules! settings_table {
    (
        $(#[doc = $doc:literal])*
        $name:ident {
            $( $(#[doc = $meaning:literal])+ $field:ident: $min:literal to $max:literal = $default:literal, )+
        }
    ) => {
        $(#[doc = $doc])*
        #[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
        #[serde(deny_unknown_fields, default)]
        pub struct $name {
            $( $(#[doc = $meaning])+ #[doc = concat!("\n\nAllowed: ", stringify!($min), " to ", stringify!($max), ".")] pub $field: f64, )+
        }

        impl Default for $name {
            fn default() -> Self {
                Self { $($field: $default),+ }
            }
        }

        impl $name {
            /// The fields, in order.
            pub const FIELDS: &'static [Setting] = &[
                $( Setting {
                    name: stringify!($field),
                    meaning: concat!($($meaning),+),
                    min: $min,
                    max: $max,
                    default: $default,
                }, )+
            ];

            /// Checks every value; `table` is the table's name in messages.
            ///
            /// # Errors
            /// The first value out of its range.
            pub fn check(&self, table: &str) -> Result<(), SettingsError> {
                $( within(format!("{table}.{}", stringify!($field)), self.$field, $min, $max)?; )+
                Ok(())
            }
        }
    };
}
pub(crate) use settings_table;

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
pub struct Settings {
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

impl Settings {
    /// Checks every value.
    ///
    /// # Errors
    /// The first value out of its range, with table and field. The fields of `[plant.vehicle]` are checked
    /// by [`Settings::vehicle_from`], which knows what the vehicle has.
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
        let mut gains = Vec::new();
        parameters.for_each(|table, field, _| {
            if table != CONTROLLER[0] && field.name.ends_with("_gain") {
                gains.push((table, field.name));
            }
        });
        for (table, name) in gains {
            if let Some(gain) = parameters.field_mut(table, name) {
                *gain = 0.0;
            }
        }
        if let Some(kp) = parameters.field_mut(CONTROLLER[0], "kp") {
            *kp = -1.0;
        }
        for (table, fields) in &self.vehicle {
            for (name, value) in fields {
                let known = !CONTROLLER.contains(&table.as_str());
                match parameters.field_mut(table, name).filter(|_| known) {
                    Some(slot) => *slot = *value,
                    None => {
                        return Err(SettingsError::UnknownField {
                            name: format!("{table}.{name}"),
                            allowed: tables(vehicle).join(", "),
                        });
                    }
                }
            }
        }
        Vehicle::new(parameters).map_err(SettingsError::Vehicle)
    }
}

/// The tables of a vehicle that the plant simulates.
fn tables(vehicle: &Vehicle<f64>) -> Vec<&'static str> {
    let mut tables = Vec::new();
    vehicle.parameters().for_each(|table, _, _| {
        if !CONTROLLER.contains(&table) && !tables.contains(&table) {
            tables.push(table);
        }
    });
    tables
}
