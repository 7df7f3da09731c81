//! Cost of a tick under each law: a ratio of times measured on the host, which is therefore not in the JSON
//! output.

use std::time::Instant;

use firmware::drive_board::SCALES;
use firmware::flight_record::FlightRecord;
use model::tick::VehicleCore;
use model::vehicle::Vehicle;
use report::error::CommandError;
use virtual_board::scenario::{Backend, VirtualBackend, run_into};

use super::contenders::Contender;
use super::courses::Course;
use crate::cli::drive::vehicle_f32;

/// Number of replayed ticks, and number of replays. The shortest replay is the one with the least
/// disturbance from the host.
const TICKS: usize = 12_000;
const REPLAYS: usize = 15;

/// One law's recorded drive.
struct RecordedDrive {
    told: Vehicle<f32>,
    records: Vec<FlightRecord>,
    least_s: f64,
}

/// The cost of a tick under each law, divided by the cost under the first law, from replays of each law's
/// own drive of `course`. The replays of the laws alternate, so that other work of the host affects all
/// laws.
///
/// # Errors
/// The course's ground or the board does not accept the vehicle.
pub fn costs(course: &Course, laws: &[Contender]) -> Result<Vec<f64>, CommandError> {
    let mut drives = laws
        .iter()
        .map(|law| recorded(course, law))
        .collect::<Result<Vec<_>, _>>()?;
    for _ in 0..REPLAYS {
        for drive in &mut drives {
            let mut core = VehicleCore::new(&drive.told, &SCALES);
            let started = Instant::now();
            for record in &drive.records {
                std::hint::black_box(core.step(&record.sample, &record.command));
            }
            drive.least_s = drive.least_s.min(started.elapsed().as_secs_f64());
        }
    }
    let first_s = drives.first().map_or(1.0, |drive| drive.least_s);
    Ok(drives.iter().map(|drive| drive.least_s / first_s).collect())
}

fn recorded(course: &Course, law: &Contender) -> Result<RecordedDrive, CommandError> {
    let plant = course
        .scenario
        .plant(&course.simulated)
        .map_err(|error| CommandError::Other(format!("{}: {error}", course.name)))?;
    let mut backend = VirtualBackend::boot(&law.told, plant).map_err(|error| CommandError::Other(error.to_string()))?;
    backend.keep_records();
    // A drive that ends early is recorded up to its end.
    let _ended = run_into(&course.scenario, &mut backend, |_| {}, |_| {});
    let mut records = backend.take_records();
    records.truncate(TICKS);
    Ok(RecordedDrive {
        told: vehicle_f32(&law.told)?,
        records,
        least_s: f64::INFINITY,
    })
}
