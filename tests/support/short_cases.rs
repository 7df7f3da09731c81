//! Kinds of faults in a few simulated seconds each, for the virtual board and the flashed ELF.

use super::outcomes::{last, sound, unless};
use model::supervise::arming::Mode;
use model::supervise::codes::{Fault, Limit};
use virtual_board::scenario::trace::TraceRow;
use virtual_board::scenario::{DriveOutcome, Scenario};

#[path = "heat.rs"]
mod heat;

/// One case: its scenario, and the check of the outcome.
pub struct ShortCase {
    /// Number of its kind in `tests/cases/README.md`.
    pub kind: u32,
    /// A scenario in TOML, without title and seed.
    text: &'static str,
    /// What is wrong with an outcome, if anything.
    wrong: fn(&DriveOutcome) -> Option<String>,
}

impl ShortCase {
    pub fn scenario(&self, seed: u64) -> Scenario {
        let text = format!("title = \"kind {}\"\nseed = {seed}\n{}", self.kind, self.text);
        Scenario::parse("short-case.toml", &text).unwrap_or_else(|error| panic!("kind {}: {error}", self.kind))
    }

    /// Fails if the outcome is not the one that this kind demands.
    pub fn check(&self, seed: u64, outcome: &DriveOutcome) {
        if let Some(wrong) = (self.wrong)(outcome) {
            panic!("kind {}, seed {seed}: {wrong}: {:?}", self.kind, outcome.log);
        }
    }
}

/// The time from `from_s` until the first row for which `shows` holds, s.
fn first(outcome: &DriveOutcome, from_s: f64, shows: impl Fn(&TraceRow) -> bool) -> Option<f64> {
    let mut rows = outcome.trace.rows.iter().filter(|row| row.time_s() >= from_s);
    rows.find(|row| shows(row)).map(|row| row.time_s() - from_s)
}

/// The largest speed in either direction from `from_s` on, m/s.
fn fastest(outcome: &DriveOutcome, from_s: f64) -> f64 {
    let rows = outcome.trace.rows.iter().filter(|row| row.time_s() >= from_s);
    rows.map(|row| row.truth.speed_m_s.abs()).fold(0.0, f64::max)
}

/// The cases, each of another kind.
pub const SHORT_CASES: &[ShortCase] = &[
    ShortCase {
        kind: 3,
        text: r#"duration_s = 7.0
            step = [{ at_s = 1.0, action = "arm" }, { at_s = 1.2, action = "drive", yaw_rate_rad_s = -1.9 },
                    { at_s = 5.7, action = "drive" }]"#,
        // 0.5 deg in 30 s. Judged at rest: while the vehicle turns, a status in transit is 0.1 deg old.
        wrong: |outcome| {
            let row = last(outcome);
            let error = (f64::from(row.status.estimate.heading_rad) - row.truth.heading_rad).to_degrees();
            let turned = row.truth.heading_rad < -7.5 && error.abs() < 0.083;
            unless(turned, "heading", (row.truth.heading_rad, error)).or_else(|| sound(outcome))
        },
    },
    ShortCase {
        kind: 4,
        text: r#"duration_s = 4.0
            terrain.profile = [{ kind = "step", at_m = 1.0, height_m = -0.02 }]
            step = [{ at_s = 1.0, action = "arm" }, { at_s = 1.2, action = "drive", speed_m_s = 1.0 }]"#,
        wrong: |outcome| {
            let fell = last(outcome).truth.x_m > 1.3;
            unless(fell, "place", last(outcome).truth.x_m).or_else(|| sound(outcome))
        },
    },
    ShortCase {
        kind: 5,
        text: r#"duration_s = 6.0
            terrain.profile = [{ kind = "step", at_m = 0.4, height_m = 0.015 }]
            step = [{ at_s = 1.0, action = "arm" }, { at_s = 1.2, action = "drive", speed_m_s = 0.4 }]"#,
        wrong: |outcome| {
            let (fastest, x_m) = (fastest(outcome, 0.0), last(outcome).truth.x_m);
            let came_m = outcome.trace.rows.iter().map(|row| row.truth.x_m);
            let came_m = came_m.fold(0.0, f64::max);
            // The kerb stops the vehicle. Its wheels touch the kerb's edge with the axle at 0.3147 m.
            let right = fastest <= 0.9 && came_m > 0.313 && x_m > 0.25;
            unless(right, "speed and places", (fastest, came_m, x_m)).or_else(|| sound(outcome))
        },
    },
    ShortCase {
        kind: 6,
        text: r#"duration_s = 6.5
            terrain.profile = [{ kind = "step", at_m = 0.4, height_m = 0.075 }]
            step = [{ at_s = 1.0, action = "arm" }, { at_s = 1.2, action = "drive", speed_m_s = 0.4 },
                    { at_s = 4.5, action = "drive", speed_m_s = -0.4 }]"#,
        wrong: |outcome| {
            let backs = first(outcome, 4.5, |row| row.truth.speed_m_s < -0.2);
            let right = backs.is_some_and(|s| s <= 1.5) && fastest(outcome, 4.5) < 0.6;
            unless(right, "backs off", (backs, fastest(outcome, 4.5))).or_else(|| sound(outcome))
        },
    },
    ShortCase {
        kind: 7,
        text: r#"duration_s = 4.5
            step = [{ at_s = 1.0, action = "arm" }, { at_s = 1.2, action = "drive", speed_m_s = 0.5 },
                    { at_s = 3.0, action = "analog-fault", sensor = "left-current", reads = "dead" }]"#,
        wrong: |outcome| {
            let found = first(outcome, 3.0, |row| row.status.faults.contains(Fault::CurrentSensor));
            let stops = last(outcome).status.mode != Mode::Armed;
            unless(stops && found.is_some_and(|s| s < 1.0), "found after", found)
        },
    },
    ShortCase {
        kind: 9,
        text: r#"duration_s = 4.0
            step = [{ at_s = 1.0, action = "arm" }, { at_s = 1.2, action = "drive", speed_m_s = 0.5 },
                    { at_s = 2.5, action = "sensor-fault", sensor = "ballast-encoder", fault = "garbage" }]"#,
        wrong: |outcome| {
            let found = first(outcome, 2.5, |row| row.status.faults.contains(Fault::BallastEncoder));
            let row = last(outcome);
            let drives = row.status.mode == Mode::Armed && row.truth.speed_m_s > 0.4;
            unless(
                drives && found.is_some_and(|s| s < 0.2),
                "found after",
                (found, row.truth.speed_m_s),
            )
        },
    },
    ShortCase {
        kind: 10,
        text: r#"duration_s = 4.0
            step = [{ at_s = 1.0, action = "arm" }, { at_s = 1.2, action = "drive", speed_m_s = 0.5 },
                    { at_s = 2.5, action = "link", direction = "to-board", latency_ms = 3000.0 }]"#,
        wrong: |outcome| {
            let stops = first(outcome, 2.5, |row| row.status.mode != Mode::Armed);
            let named = last(outcome).status.faults.contains(Fault::CommandTimeout);
            // The dead-man time is 250 ms, and the status comes every 10 ms.
            unless(named && stops.is_some_and(|s| s < 0.27), "stops after", stops)
        },
    },
    ShortCase {
        kind: 18,
        text: r#"duration_s = 3.5
            step = [{ at_s = 1.0, action = "arm" }, { at_s = 1.2, action = "drive", speed_m_s = 0.3 },
                    { at_s = 2.5, action = "sensor-fault", sensor = "right-encoder", fault = "stuck" }]"#,
        wrong: |outcome| {
            let found = first(outcome, 2.5, |row| row.status.mode == Mode::Disarmed);
            unless(found.is_some_and(|s| s <= 0.6), "found after", found)
        },
    },
    ShortCase {
        kind: 19,
        text: r#"duration_s = 5.0
            chocked_until_armed = true
            terrain.plane = { slope_x_rad = -0.0873 }
            terrain.patch = [{ from_m = 1.0, to_m = 20.0, left = 0.03, right = 0.03 }]
            step = [{ at_s = 1.0, action = "arm" }, { at_s = 1.5, action = "drive", speed_m_s = 0.8 }]"#,
        wrong: |outcome| {
            let from_s = first(outcome, 0.0, |row| row.truth.sliding == [true; 2]);
            let told = from_s.and_then(|s| first(outcome, s, |row| row.status.limits.contains(Limit::Slip)));
            unless(told.is_some_and(|s| s < 0.5), "slip told after", (from_s, told))
        },
    },
    ShortCase {
        kind: 20,
        // The hold takes 15 A of each motor.
        text: r#"duration_s = 9.0
            chocked_until_armed = true
            terrain.plane = { slope_x_rad = 0.35 }
            terrain.friction = { left = 1.0, right = 1.0 }
            plant.left = { torque_constant_factor = 0.4 }
            plant.right = { torque_constant_factor = 0.4 }
            step = [{ at_s = 1.0, action = "arm" }]"#,
        wrong: |outcome| {
            let heat = heat::heats(&outcome.trace.rows, 0, 5.8, 41.6);
            let hot_s = first(outcome, 0.0, |row| row.status.limits.contains(Limit::MotorHeat));
            let told = hot_s
                .and_then(|s| heat.iter().find(|(at_s, _)| *at_s >= s))
                .map(|(_, heat)| *heat);
            let hottest = heat.iter().map(|(_, heat)| *heat).fold(0.0, f64::max);
            // The limit falls from a heat of 0.9 on. A sensor's gain is known to 2 %, and the heat grows with its square.
            let right = told.is_some_and(|heat| (0.86..=1.0).contains(&heat)) && hottest < 1.04;
            unless(right, "told at a heat of, hottest", (told, hottest)).or_else(|| sound(outcome))
        },
    },
    ShortCase {
        kind: 21,
        // A full battery with old cells: stopping on the way down would return 40 W.
        text: r#"duration_s = 9.0
            chocked_until_armed = true
            terrain.plane = { slope_x_rad = -0.26 }
            plant.vehicle = { battery.resistance_ohm = 1.0 }
            plant.battery = { charge = 1.0, capacity_ah = 10.0, open_circuit_v = [[0.0, 27.0], [1.0, 29.2]] }
            step = [{ at_s = 1.0, action = "arm" }, { at_s = 3.0, action = "drive", speed_m_s = 2.0 },
                    { at_s = 6.0, action = "drive" }]"#,
        wrong: |outcome| {
            let rows = &outcome.trace.rows;
            let highest_v = rows.iter().map(|row| row.truth.battery_v).fold(0.0, f64::max);
            let told = first(outcome, 6.0, |row| row.status.limits.contains(Limit::Regeneration));
            // The vehicle brakes, but less hard.
            let speed_m_s = last(outcome).truth.speed_m_s;
            let right = highest_v < 30.0 && told.is_some_and(|s| s < 0.1) && (1.5..1.95).contains(&speed_m_s);
            unless(right, "supply, limit, speed", (highest_v, told, speed_m_s)).or_else(|| sound(outcome))
        },
    },
];
