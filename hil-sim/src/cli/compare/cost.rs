//! What a tick costs under each law: a ratio of times that one run measures on its host, which no JSON holds.

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

/// Ticks that are replayed, and how often: the least time of all replays is the one that nothing else on the host disturbed.
const TICKS: usize = 12_000;
const REPLAYS: usize = 15;

/// One law's recorded drive.
struct RecordedDrive {
    told: Vehicle<f32>,
    records: Vec<FlightRecord>,
    least_s: f64,
}

/// The cost of a tick under each law over that under the first, replaying `course` as each of them drove it. The laws take
/// turns, so that what the host does besides meets all of them.
///
/// # Errors
/// The course's ground or the board refuses the vehicle.
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
    // A drive that ends early is recorded until then.
    let _ended = run_into(&course.scenario, &mut backend, |_| {}, |_| {});
    let mut records = backend.take_records();
    records.truncate(TICKS);
    Ok(RecordedDrive {
        told: vehicle_f32(&law.told)?,
        records,
        least_s: f64::INFINITY,
    })
}
