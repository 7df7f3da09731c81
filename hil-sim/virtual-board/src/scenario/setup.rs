//! The plant that a scenario asks for.

use firmware::drive_board::SCALES;
use model::vehicle::Vehicle;
use plant::Plant;
use plant::settings::SettingsError;
use plant::terrain::TerrainError;
use thiserror::Error;

use super::file::Scenario;

/// Why a scenario and a vehicle make no plant.
#[derive(Debug, Error)]
pub enum SetupError {
    /// A setting of `[plant]` does not fit the vehicle.
    #[error(transparent)]
    PlantSettings(#[from] SettingsError),
    /// The vehicle's wheels cannot follow the terrain.
    #[error(transparent)]
    Terrain(#[from] TerrainError),
}

impl Scenario {
    /// The simulated vehicle at the start: `vehicle` as `[plant]` changes it, on this terrain.
    ///
    /// # Errors
    /// [`SetupError`].
    pub fn plant(&self, vehicle: &Vehicle<f64>) -> Result<Plant, SetupError> {
        let simulated = self.plant.vehicle_from(vehicle)?;
        Ok(Plant::with_settings(
            &simulated,
            &SCALES,
            self.terrain.clone(),
            self.seed,
            &self.plant,
        )?)
    }
}
