//! A scenario written in code instead of a file, flown by the firmware's tasks on the virtual board:
//! `cargo run -p hil-sim --example fly_a_scenario`.

use std::collections::BTreeMap;
use std::error::Error;

use plant::settings::PlantSettings;
use plant::terrain::Terrain;
use virtual_board::scenario::{
    self, Action, BoundsOf, MetricValue, Scenario, ScenarioSource, Step, VirtualBackend, metrics,
};

fn main() -> Result<(), Box<dyn Error>> {
    for metric in fly()? {
        println!("{:32} {:12.4}", metric.name, metric.value);
    }
    Ok(())
}

/// Climbs a slope of 3 deg at 0.5 m/s, then stands; every metric of the run.
pub(crate) fn fly() -> Result<Vec<MetricValue>, Box<dyn Error>> {
    let step = |at_s, action| Step { at_s, action };
    let drive = |speed_m_s| Action::Drive {
        speed_m_s,
        yaw_rate_rad_s: 0.0,
    };
    let climb = Scenario {
        title: "climbs 3 deg and stands".into(),
        duration_s: 12.0,
        seed: 1,
        // The reference vehicle.
        vehicle: None,
        // With its bridges open the vehicle would roll down the slope.
        chocked_until_armed: true,
        terrain: Terrain::slope(3_f64.to_radians(), 0.8)?,
        // The plant as the vehicle file describes it.
        plant: PlantSettings::default(),
        // The board arms once its estimates have settled.
        steps: vec![step(1.0, Action::Arm), step(1.5, drive(0.5)), step(5.0, drive(0.0))],
        // Bounds, for `scenario::evaluate`; here only the values count.
        metrics: BTreeMap::new(),
        bounds_of: BoundsOf::ThisVehicle,
        // It comes from no file.
        source: ScenarioSource::default(),
    };
    let vehicle = vehicle_file::reference()?;
    let mut board = VirtualBackend::boot(&vehicle, climb.plant(&vehicle)?)?;
    let outcome = scenario::run(&climb, &mut board, |_ms| {})?;
    Ok(metrics::measure(&outcome))
}
