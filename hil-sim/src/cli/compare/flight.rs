//! One law on one course: driven by the firmware's tasks, and measured.

use model::supervise::arming::Mode;
use serde::Serialize;
use theory::analysis::settling::{Settling, SpeedSample};
use virtual_board::scenario::trace::TraceRow;
use virtual_board::scenario::{VirtualBackend, run_into};

use super::contenders::Contender;
use super::courses::{COMMAND_AT_S, Course};

/// A law's result on a course. All quantities are true values of the plant.
#[derive(Debug, Clone, Serialize)]
pub struct Flight {
    /// The law.
    pub law: &'static str,
    /// The course.
    pub course: String,
    /// Settling of the speed step, s; `None` if the course is not a step.
    pub settling: Option<Settling>,
    /// Distance that the vehicle rolls back before the first command, m.
    pub roll_back_m: f64,
    /// Distance from the vehicle's start to its end, forward positive, m.
    pub drives_m: f64,
    /// Largest speed beyond the commanded speed, in either direction, from the command on, m/s.
    pub overspeed_m_s: f64,
    /// Largest angle of the arm, deg.
    pub arm_peak_deg: f64,
    /// Largest angle of the spar from the command on, deg; `None` without a spar.
    pub spar_peak_deg: Option<f64>,
    /// Time in which a wheel slides, s.
    pub sliding_s: f64,
    /// Net energy from the battery over the whole drive, J; regenerated energy is subtracted.
    pub energy_j: f64,
    /// Faults that were latched.
    pub faults: String,
    /// Whether the drive ended armed, without a fault that stops the vehicle or opens the bridges.
    pub finished: bool,
    /// Why the simulation of the run ended early.
    pub stopped: Option<String>,
    /// Time, s, and speed, m/s, from a second before the command on.
    #[serde(skip)]
    pub speed: (Vec<f64>, Vec<f64>),
}

/// Drives `course` under `law`.
///
/// # Errors
/// The course's ground or the board refuses the vehicle.
pub fn fly(course: &Course, law: &Contender) -> Result<Flight, String> {
    let plant = course
        .scenario
        .plant(&course.simulated)
        .map_err(|error| format!("{}: {error}", course.name))?;
    let mut backend = VirtualBackend::boot(&law.told, plant).map_err(|error| error.to_string())?;
    let mut rows: Vec<TraceRow> = Vec::new();
    let end = run_into(&course.scenario, &mut backend, |row| rows.push(*row), |_| {});
    let (before, after) = rows.split_at(rows.partition_point(|row| row.time_s() < COMMAND_AT_S));
    let downhill = -course.scenario.terrain.plane().slope_x_rad.signum();
    let most = |rows: &[TraceRow], value: &dyn Fn(&TraceRow) -> f64| rows.iter().map(value).fold(0.0, f64::max);
    let last = rows.last();
    let faults = last.map(|row| row.status.faults).unwrap_or_default();
    let shown = &rows[rows.partition_point(|row| row.time_s() < COMMAND_AT_S - 1.0)..];
    Ok(Flight {
        law: law.name,
        course: course.name.clone(),
        settling: course.step.map(|[from, to]| {
            let samples = after.iter().map(|row| SpeedSample {
                time: row.time_s(),
                speed: row.truth.speed_m_s,
            });
            Settling::of(samples, from, to)
        }),
        roll_back_m: most(before, &|row| downhill * row.truth.x_m),
        drives_m: last.map_or(0.0, |row| row.truth.x_m),
        overspeed_m_s: most(after, &|row| {
            let along = if row.commanded[0] < 0.0 { -1.0 } else { 1.0 };
            let beyond = along * row.truth.speed_m_s - row.commanded[0].abs();
            if row.commanded[0] == 0.0 {
                row.truth.speed_m_s.abs()
            } else {
                beyond
            }
        }),
        arm_peak_deg: most(&rows, &|row| row.truth.phi_rad.abs().to_degrees()),
        spar_peak_deg: law
            .told
            .parameters()
            .spar
            .is_some()
            .then(|| most(after, &|row| row.truth.spar_rad.abs().to_degrees())),
        sliding_s: ROW_S * rows.iter().filter(|row| row.truth.sliding.contains(&true)).count() as f64,
        energy_j: ROW_S
            * rows
                .iter()
                .map(|row| row.truth.battery_v * row.truth.battery_a)
                .sum::<f64>(),
        faults: faults.to_string(),
        finished: end.is_ok() && last.is_some_and(|row| row.status.mode == Mode::Armed),
        stopped: end.err().map(|error| error.to_string()),
        speed: (
            shown.iter().map(TraceRow::time_s).collect(),
            shown.iter().map(|row| row.truth.speed_m_s).collect(),
        ),
    })
}

/// Time between two rows of a trace, s.
const ROW_S: f64 = 0.01;
