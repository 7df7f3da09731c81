//! The plant of a scenario, and the scenario's requirements on the vehicle.

use firmware::drive_board::SCALES;
use model::vehicle::Vehicle;
use plant::Plant;
use plant::imu::imperfection::ImuSettings;
use plant::settings::SettingsError;
use plant::terrain::TerrainError;

use super::bounds_of::{BoundsOf, are_one};
use super::error::ScenarioError;
use super::file::{Scenario, ScenarioSource};
use super::metrics::{self, MetricKind};

impl ScenarioSource {
    /// The error in `[plant]`, with its place.
    pub(super) fn settings(&self, error: SettingsError) -> ScenarioError {
        let (file, path) = (self.file(), error.field());
        self.placed(ScenarioError::Plant { file, error }, &path)
    }

    /// The error in `[terrain]`, with its place.
    pub(super) fn terrain(&self, error: TerrainError) -> ScenarioError {
        let (file, path) = (self.file(), format!("terrain.{}", error.field()));
        self.placed(ScenarioError::Terrain { file, error }, &path)
    }
}

impl Scenario {
    /// The simulated vehicle at the start: `vehicle` with the changes of `[plant]`, on this terrain.
    ///
    /// # Errors
    /// A setting of `[plant]` that does not suit the vehicle, a step for a part that the vehicle does not
    /// have, or a terrain that its wheels cannot follow.
    pub fn plant(&self, vehicle: &Vehicle<f64>) -> Result<Plant, ScenarioError> {
        let simulated = self.plant.vehicle_from(vehicle);
        let simulated = simulated.map_err(|error| self.source.settings(error))?;
        if simulated.parameters().spar.is_none() {
            self.refuse_what_is_of_a_spar()?;
        }
        let terrain = self.terrain.clone();
        Plant::with_settings(&simulated, &SCALES, terrain, self.seed, &self.plant)
            .map_err(|error| self.source.terrain(error))
    }

    /// Prepares this scenario for a run of the vehicle `flown`. `own` is the vehicle for which the bounds
    /// were written; `None` if its file cannot be read. Other gains, limits and thresholds do not make
    /// another vehicle, because the bounds are to judge them.
    pub fn flown_by(&mut self, flown: &Vehicle<f64>, own: Option<&Vehicle<f64>>) {
        let one = own.is_some_and(|own| are_one(flown, own));
        if one || self.metrics.is_empty() {
            return;
        }
        self.bounds_of = BoundsOf::AnotherVehicle;
        self.metrics
            .retain(|name, _| metrics::kind(name) != Some(MetricKind::Measured));
    }

    /// Refuses steps for a part that a vehicle without a spar does not have, because such steps would have
    /// no effect.
    fn refuse_what_is_of_a_spar(&self) -> Result<(), ScenarioError> {
        for (i, step) in self.steps.iter().enumerate() {
            if let Some((field, what)) = step.of_spar() {
                let path = format!("step[{i}].{field}");
                let allowed =
                    format!("this vehicle has no {what}: allowed with [spar] and [ballast_motor] in its file");
                return Err(self.source.none_here(&path, allowed));
            }
        }
        if self.plant.spar_imu != ImuSettings::default() {
            let allowed = "this vehicle has no IMU on a spar: allowed with [spar] and [ballast_motor] in its file";
            return Err(self.source.none_here("plant.spar_imu", allowed));
        }
        Ok(())
    }
}
