//! Records every tick of the default drive and replays the ticks through the pure step of the vehicle's core:
//! each actuation must be the same, bit for bit. `cargo run -p hil-sim --example replay_a_record`.

use std::error::Error;

use firmware::drive_board::SCALES;
use firmware::flight_record::FlightRecord;
use model::tick::VehicleCore;
use model::vehicle::Vehicle;
use virtual_board::scenario::file::{DEFAULT, DEFAULT_NAME};
use virtual_board::scenario::{self, Backend, Scenario, VirtualBackend};

fn main() -> Result<(), Box<dyn Error>> {
    let vehicle = vehicle_file::reference()?;
    let records = record(&vehicle)?;
    match first_difference(&vehicle, &records)? {
        None => println!("{} ticks replayed, every actuation the same", records.len()),
        Some(record) => println!("the replay of tick {} differs", record.tick),
    }
    Ok(())
}

/// The ticks of the default drive: what the vehicle sensed, the command, and the actuation.
pub(crate) fn record(vehicle: &Vehicle<f64>) -> Result<Vec<FlightRecord>, Box<dyn Error>> {
    let drive = Scenario::parse(DEFAULT_NAME, DEFAULT)?;
    let plant = drive.plant(vehicle)?;
    let mut backend = VirtualBackend::boot(vehicle, plant)?;
    backend.keep_records();
    scenario::run(&drive, &mut backend, |_ms| {})?;
    Ok(backend.take_records())
}

/// The first record whose actuation a core that starts anew does not repeat.
pub(crate) fn first_difference<'a>(
    vehicle: &Vehicle<f64>,
    records: &'a [FlightRecord],
) -> Result<Option<&'a FlightRecord>, Box<dyn Error>> {
    // The board computes in single precision.
    let vehicle = Vehicle::new(vehicle.parameters().cast::<f32>())?;
    let mut core = VehicleCore::new(&vehicle, &SCALES);
    let differs = |record: &&FlightRecord| core.step(&record.sample, &record.command).actuation != record.actuation;
    Ok(records.iter().find(differs))
}
