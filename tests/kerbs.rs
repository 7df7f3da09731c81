//! Kerbs and ledges, single and as stairs.

use model::supervise::arming::Mode;
use model::supervise::codes::{FaultSet, Limit};
use model::vehicle::GRAVITY_M_S2;
use rayon::prelude::*;
use virtual_board::scenario::trace::TraceRow;

mod support;
use support::generated::shown;
use support::kerbs::{KerbDrive, drive_over};
use support::reference;
use support::slopes::{drive, from};

/// Number of the stairs' steps, and the place of the first step, m.
const STEPS: usize = 8;
const FIRST_M: f64 = 2.0;
/// Speed over the command that is allowed on stairs, apart from the speed that the fall from a step gives by itself, m/s: the speed
/// allowed behind a single kerb, and a little more, because the vehicle still has the previous step's excess when it meets the
/// next.
const STAIRS_OVERSPEED_M_S: f64 = 0.6;

/// Kerbs of 5 to 50 mm and ledges, level and on slopes, at 0.3 to 2.5 m/s: the whole grid's short form, with the cells that were
/// the worst.
#[test]
fn no_kerb_ends_the_drive_or_lets_the_vehicle_run_away() {
    let cells = [
        (0.3, 0.005, 0.0),
        (0.3, 0.01, -10.0),
        (0.3, 0.02, -10.0),
        (0.3, -0.03, 10.0),
        (0.3, -0.05, -5.0),
        (0.5, 0.01, 5.0),
        (0.8, 0.01, 0.0),
        (0.8, 0.02, -5.0),
        (0.8, 0.02, 10.0),
        (1.2, 0.03, 0.0),
        (1.5, 0.03, 0.0),
        (1.5, 0.05, 10.0),
        (2.5, 0.005, -10.0),
        (2.5, 0.02, -10.0),
        (2.5, -0.05, 0.0),
        (1.1, 0.024, -8.5),
        (1.1, 0.024, -3.0),
        (1.75, 0.044, -8.5),
    ];
    let drives = kerbs(&cells);
    let complaints: Vec<&String> = drives.iter().flat_map(|drive| &drive.complaints).collect();
    assert!(complaints.is_empty(), "{complaints:#?}");
    let fastest_m_s = drives.iter().map(|drive| drive.excess_m_s).fold(0.0, f64::max);
    let come_over = drives.iter().filter(|drive| drive.comes_over).count();
    shown(
        "eighteen of these drives",
        &format!(
            "no fault in {} drives; {come_over} come over, the others stop in front and report it (*Stall*); behind kerb and ledge at most {fastest_m_s:.2} m/s too fast",
            drives.len()
        ),
    );
}

/// The drives over these kerbs: speed, height, slope.
fn kerbs(cells: &[(f64, f64, f64)]) -> Vec<KerbDrive> {
    cells
        .par_iter()
        .map(|(speed_m_s, height_m, slope_deg)| drive_over(*speed_m_s, *height_m, *slope_deg))
        .collect()
}

/// The whole grid of 400 drives: `cargo test -p hil-sim --test kerbs the_whole_grid -- --ignored`.
#[test]
#[ignore = "takes minutes; its short form runs with the others"]
fn the_whole_grid_of_kerbs() {
    let mut cells = Vec::new();
    for slope_deg in [0.0, 10.0, 5.0, -5.0, -10.0] {
        for height_mm in [5.0, 10.0, 20.0, 30.0, 50.0] {
            for speed_m_s in [0.3, 0.5, 0.8, 1.0, 1.2, 1.5, 2.0, 2.5] {
                cells.push((speed_m_s, 0.001 * height_mm, slope_deg));
                cells.push((speed_m_s, -0.001 * height_mm, slope_deg));
            }
        }
    }
    let drives = kerbs(&cells);
    let come_over = drives.iter().filter(|drive| drive.comes_over).count();
    let good = drives.iter().filter(|drive| drive.complaints.is_empty()).count();
    let complaints: Vec<&String> = drives.iter().flat_map(|drive| &drive.complaints).collect();
    let others = but(&complaints);
    shown(
        "kerbs of 5 to 50 mm",
        &format!(
            "{good} of {} drives without a fault, over it ({come_over}) or stopped in front and reported (*Stall*), no more than 0.5 m/s too fast behind it{others}",
            drives.len()
        ),
    );
    assert!(complaints.is_empty(), "{complaints:#?}");
}

/// Kerbs and slopes between those of the grid: in at most one drive of a hundred the vehicle is too fast behind the kerb, and
/// nothing else goes wrong.
#[test]
#[ignore = "takes minutes"]
fn kerbs_between_those_of_the_whole_grid() {
    /// Speed beyond the allowed excess that the one drive in a hundred may reach, m/s: as much again.
    const BEYOND_M_S: f64 = 0.5;
    let mut cells = Vec::new();
    for slope_deg in [-8.5, -3.0, 2.5, 4.0, 7.5, 9.0] {
        for height_mm in [6.0, 8.0, 12.0, 16.0, 24.0, 27.0, 36.0, 44.0] {
            for speed_m_s in [0.35, 0.45, 0.55, 0.65, 0.9, 1.1, 1.35, 1.75, 2.2] {
                cells.push((speed_m_s, 0.001 * height_mm, slope_deg));
                cells.push((speed_m_s, -0.001 * height_mm, slope_deg));
            }
        }
    }
    let drives = kerbs(&cells);
    let come_over = drives.iter().filter(|drive| drive.comes_over).count();
    let complaints: Vec<&String> = drives.iter().flat_map(|drive| &drive.complaints).collect();
    let good = drives.iter().filter(|drive| drive.complaints.is_empty()).count();
    shown(
        "kerbs and slopes between these",
        &format!(
            "{good} of {} drives, over it ({come_over}) or stopped in front and reported{}",
            drives.len(),
            but(&complaints)
        ),
    );
    assert!(
        complaints.iter().all(|what| what.contains("m/s too fast")),
        "{complaints:#?}"
    );
    let slow_enough =
        |drive: &KerbDrive| drive.excess_m_s <= 0.5 + BEYOND_M_S && drive.falling_excess_m_s <= BEYOND_M_S;
    assert!(drives.iter().all(slow_enough), "{complaints:#?}");
    assert!(100 * (drives.len() - good) <= drives.len(), "{complaints:#?}");
}

/// The end of a table's cell: the complaints, if there are any.
fn but(complaints: &[&String]) -> String {
    let complaints: Vec<&str> = complaints.iter().map(|what| what.as_str()).collect();
    if complaints.is_empty() {
        String::new()
    } else {
        format!("; not so: {}", complaints.join("; "))
    }
}

/// Flights of eight steps of 5 to 30 mm, up and down, 0.3 and 0.6 m apart, at 0.5 to 2.5 m/s: the vehicle drives over all steps,
/// or stops in front of a step and reports it. Nothing ends the drive, and the vehicle does not run away.
#[test]
fn stairs_are_climbed_or_told() {
    let mut cells = Vec::new();
    for height_m in [0.005, 0.01, 0.02, 0.03, -0.005, -0.01, -0.02, -0.03] {
        for apart_m in [0.3, 0.6] {
            for speed_m_s in [0.5, 1.0, 1.5, 2.5] {
                cells.push((speed_m_s, height_m, apart_m));
            }
        }
    }
    let drives: Vec<(bool, f64)> = cells
        .into_par_iter()
        .map(|(speed_m_s, height_m, apart_m)| climb(speed_m_s, height_m, apart_m))
        .collect();
    let come_over = drives.iter().filter(|(over, _)| *over).count();
    let fastest_m_s = drives.iter().map(|(_, excess_m_s)| *excess_m_s).fold(0.0, f64::max);
    shown(
        "stairs of eight steps",
        &format!(
            "no fault in {} drives; {come_over} come over, the others stop in front of a step and report it (*Stall*); at most \
             {fastest_m_s:.2} m/s too fast",
            drives.len()
        ),
    );
}

/// Drives up or down the stairs. Returns whether the vehicle drives over all steps, and by how much it is too fast, m/s.
fn climb(speed_m_s: f64, height_m: f64, apart_m: f64) -> (bool, f64) {
    let story = format!("{speed_m_s} m/s, {:.0} mm, {apart_m} m apart", 1000.0 * height_m);
    let steps: Vec<String> = (0..STEPS)
        .map(|n| {
            let at_m = FIRST_M + apart_m * n as f64;
            format!("{{ kind = 'step', at_m = {at_m:?}, height_m = {height_m:?} }}")
        })
        .collect();
    let last_m = FIRST_M + apart_m * STEPS as f64;
    let seconds = 12.0 + 1.8 * last_m / speed_m_s;
    let outcome = drive(
        &reference(),
        seconds,
        0.0,
        &format!("terrain.profile = [{}]", steps.join(", ")),
        &format!("{{ at_s = 4.0, action = 'drive', speed_m_s = {speed_m_s:?} }}"),
    );
    let rows = from(&outcome, 4.0);
    let last = &rows[rows.len() - 1];
    assert_eq!(
        (last.status.mode, last.status.faults),
        (Mode::Armed, FaultSet::EMPTY),
        "{story}"
    );
    let fall_m_s = (speed_m_s.powi(2) + 2.0 * GRAVITY_M_S2 * (-height_m).max(0.0)).sqrt() - speed_m_s;
    let excess_m_s = rows
        .iter()
        .map(|row| row.truth.speed_m_s - speed_m_s)
        .fold(0.0, f64::max);
    assert!(
        excess_m_s <= STAIRS_OVERSPEED_M_S.max(fall_m_s + 0.2),
        "{story}: {excess_m_s} m/s too fast"
    );
    let over = last.truth.x_m > last_m;
    let told = |row: &TraceRow| row.status.limits.contains(Limit::Stall);
    assert!(
        over || rows[rows.len() - 50..].iter().any(told),
        "{story}: the vehicle ends at {} m and reports nothing",
        last.truth.x_m
    );
    (over, excess_m_s)
}
