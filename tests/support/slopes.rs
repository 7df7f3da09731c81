//! Drives of any vehicle on a plane with any slope.

use model::vehicle::{Vehicle, VehicleParameters};
use virtual_board::scenario::trace::TraceRow;
use virtual_board::scenario::{self, DriveOutcome, Scenario, VirtualBackend};

use super::reference;

/// Drives on a plane of `slope_deg`, with chocks until the vehicle arms at 2 s; `steps` are inline tables, `more` further tables.
pub fn drive(vehicle: &Vehicle<f64>, seconds: f64, slope_deg: f64, more: &str, steps: &str) -> DriveOutcome {
    let text = format!(
        "title = 't'\nduration_s = {seconds:?}\nchocked_until_armed = true\n{more}\nterrain.plane.slope_x_rad = {:?}\n\
         step = [{{ at_s = 2.0, action = 'arm' }}, {steps}]",
        slope_deg.to_radians()
    );
    let scenario = Scenario::parse("a scenario of this test", &text).unwrap_or_else(|error| panic!("{error}\n{text}"));
    let plant = scenario.plant(vehicle).expect("drivable");
    let mut backend = VirtualBackend::boot(vehicle, plant).expect("boots");
    scenario::run(&scenario, &mut backend, |_| {}).expect("the plant stays valid")
}

/// The reference vehicle, changed.
pub fn changed(change: impl FnOnce(&mut VehicleParameters<f64>)) -> Vehicle<f64> {
    let mut parameters = *reference().parameters();
    change(&mut parameters);
    Vehicle::new(parameters).expect("a vehicle")
}

/// The reference vehicle, changed, with the gains that follow from the change.
pub fn by_rule(change: impl FnOnce(&mut VehicleParameters<f64>)) -> Vehicle<f64> {
    let mut parameters = *reference().parameters();
    change(&mut parameters);
    parameters.follow_rules(|_, _| true);
    Vehicle::new(parameters).expect("a vehicle")
}

/// The vehicle of `vehicles/small.toml`, whose motors, gears and encoders are nothing like the reference vehicle's.
pub fn small() -> Vehicle<f64> {
    let text = include_str!("../../vehicles/small.toml");
    match vehicle_file::parse("vehicles/small.toml", text) {
        Ok(vehicle_file::VehicleFile::Vehicle(vehicle)) => *vehicle,
        other => panic!("{other:?}"),
    }
}

/// The largest value; fails without rows, of which any bound would hold.
pub fn most(rows: &[TraceRow], value: impl Fn(&TraceRow) -> f64) -> f64 {
    assert!(!rows.is_empty(), "no rows");
    rows.iter().map(value).fold(f64::NEG_INFINITY, f64::max)
}

/// The rows from `from_s` on.
pub fn from(outcome: &DriveOutcome, from_s: f64) -> &[TraceRow] {
    let rows = &outcome.trace.rows;
    &rows[rows.partition_point(|row| row.time_s() < from_s)..]
}
