//! The scenario files of `tests/cases`, unchanged and at other values, for the virtual board and the flashed ELF.

use super::outcomes::{last, sound, unless};
use model::supervise::arming::Mode;
use model::supervise::codes::{Fault, FaultSet};
use virtual_board::scenario::trace::TraceRow;
use virtual_board::scenario::{DriveOutcome, Scenario};

/// A file, the values at which it is flown, and the check of an outcome.
pub struct CaseFile {
    /// Name in `tests/cases`, without `.toml`.
    pub name: &'static str,
    /// The values; the first are the file's own.
    pub values: &'static [Value],
    /// Changes for the flashed ELF's shorter run, which ends once the file's event is over.
    pub shorter: &'static [(&'static str, &'static str)],
    /// What is wrong with an outcome, if anything.
    wrong: fn(&Value, &DriveOutcome) -> Option<String>,
}

/// The changes of a run to its file.
pub struct Value {
    /// Texts of the file and their replacements.
    replaced: &'static [(&'static str, &'static str)],
    /// Tables in TOML that the file lacks.
    added: &'static str,
    /// The commanded speed, m/s, of the last `drive` step with a speed.
    speed_m_s: f64,
}

/// The unchanged file.
const fn as_it_stands(speed_m_s: f64) -> Value {
    Value {
        replaced: &[],
        added: "",
        speed_m_s,
    }
}

impl CaseFile {
    /// The file at `value`, with the changes `further`.
    pub fn scenario(&self, value: &Value, seed: u64, further: &[(&str, &str)]) -> Scenario {
        let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR"))
            .ancestors()
            .map(|folder| folder.join("tests/cases").join(format!("{}.toml", self.name)))
            .find(|path| path.exists())
            .unwrap_or_else(|| panic!("no file {}", self.name));
        let mut text = std::fs::read_to_string(path).expect("a case");
        for (from, to) in value.replaced.iter().chain(further) {
            assert!(text.contains(from), "{}: {from} is not in the file", self.name);
            text = text.replace(from, to);
        }
        let text = format!("seed = {seed}\n{}\n{text}", value.added);
        Scenario::parse(self.name, &text).unwrap_or_else(|error| panic!("{}: {error}\n{text}", self.name))
    }

    /// Fails if the outcome is not the one that the table of files demands.
    pub fn check(&self, value: &Value, seed: u64, outcome: &DriveOutcome) {
        if let Some(wrong) = (self.wrong)(value, outcome) {
            let (changed, added) = (value.replaced, value.added);
            panic!("{} {changed:?} {added}, seed {seed}: {wrong}", self.name);
        }
    }
}

/// Nothing if the vehicle is armed without a fault at the end and the bridges were on ever since it was armed at 2 s.
fn undisturbed(outcome: &DriveOutcome) -> Option<String> {
    let mut driven = outcome.trace.rows.iter().filter(|row| row.time_s() > 2.1);
    sound(outcome).or_else(|| {
        let opened_s = driven.find(|row| !row.bridges_on).map(TraceRow::time_s);
        unless(opened_s.is_none(), "a bridge opens, s", opened_s)
    })
}

fn heading_error_deg(row: &TraceRow) -> f64 {
    (f64::from(row.status.estimate.heading_rad) - row.truth.heading_rad).to_degrees()
}

/// The files that are scenarios of the reference vehicle.
pub const CASE_FILES: &[CaseFile] = &[
    CaseFile {
        name: "ballast-encoder-dies-downhill",
        values: &[
            as_it_stands(1.0),
            Value {
                replaced: &[("fault=\"off\"", "fault=\"stuck\"")],
                ..as_it_stands(1.0)
            },
            Value {
                replaced: &[
                    ("fault=\"off\"", "fault=\"garbage\""),
                    ("speed_m_s=1.0", "speed_m_s=-0.5"),
                ],
                ..as_it_stands(-0.5)
            },
            Value {
                replaced: &[("-0.0873", "-0.2"), ("speed_m_s=1.0", "speed_m_s=0.6")],
                ..as_it_stands(0.6)
            },
        ],
        shorter: &[("duration_s=30.0", "duration_s=17.0")],
        // The drive continues at its speed; a fault may end only the levelling.
        wrong: |value, outcome| {
            let row = last(outcome);
            let others = row.status.faults.bits() & !FaultSet::SPAR.bits();
            unless(
                (row.status.mode, others) == (Mode::Armed, 0),
                "the drive ends",
                row.status.faults,
            )
            .or_else(|| {
                let speed_m_s = row.truth.speed_m_s;
                unless((speed_m_s - value.speed_m_s).abs() < 0.1, "speed", speed_m_s)
            })
        },
    },
    CaseFile {
        name: "battery-over-range",
        values: &[
            as_it_stands(0.5),
            Value {
                replaced: &[("open_circuit_v=90.0", "open_circuit_v=66.0")],
                ..as_it_stands(0.5)
            },
            Value {
                replaced: &[
                    ("open_circuit_v=90.0", "open_circuit_v=40.0"),
                    ("speed_m_s=0.5", "speed_m_s=-2.0"),
                ],
                ..as_it_stands(-2.0)
            },
        ],
        shorter: &[("duration_s=14.0", "duration_s=9.0")],
        // The sensors can measure the reference vehicle's limit: the bridges open within 150 ms, and stay open.
        wrong: |_, outcome| {
            let rows = &outcome.trace.rows;
            let early = rows
                .iter()
                .find(|row| row.time_s() < 8.0 && row.status.faults != FaultSet::EMPTY);
            let mut after = rows.iter().filter(|row| row.time_s() >= 8.15);
            let on = after.find(|row| row.bridges_on).map(TraceRow::time_s);
            let faults = last(outcome).status.faults;
            unless(early.is_none(), "a fault before, s", early.map(TraceRow::time_s))
                .or_else(|| unless(on.is_none(), "bridges on, s", on))
                .or_else(|| unless(faults.contains(Fault::BatteryHigh), "faults", faults))
        },
    },
    CaseFile {
        name: "kerb-surge",
        values: &[
            as_it_stands(0.3),
            Value {
                replaced: &[("height_m=0.02", "height_m=0.012")],
                ..as_it_stands(0.3)
            },
            Value {
                replaced: &[("height_m=0.02", "height_m=0.015"), ("speed_m_s=0.3", "speed_m_s=1.0")],
                ..as_it_stands(1.0)
            },
            Value {
                replaced: &[
                    ("at_m=2.0,height_m=0.02", "at_m=-2.0,height_m=-0.01"),
                    ("speed_m_s=0.3", "speed_m_s=-0.8"),
                ],
                ..as_it_stands(-0.8)
            },
        ],
        shorter: &[("duration_s=40.0", "duration_s=18.0")],
        wrong: |value, outcome| {
            let speeds = outcome.trace.rows.iter().map(|row| row.truth.speed_m_s.abs());
            let excess_m_s = speeds.fold(0.0, f64::max) - value.speed_m_s.abs();
            let came_m = outcome.trace.rows.iter().map(|row| row.truth.x_m.abs());
            let came_m = came_m.fold(0.0, f64::max);
            // At 0.3 m/s the kerb stops the vehicle. Its wheels touch the file's kerb with the axle at 1.902 m.
            let least_m = if value.speed_m_s.abs() > 0.3 { 2.0 } else { 1.9 };
            unless(excess_m_s <= 0.5, "too fast by, m/s", excess_m_s)
                .or_else(|| unless(came_m > least_m, "comes to the kerb or over it, m", came_m))
                .or_else(|| undisturbed(outcome))
        },
    },
    CaseFile {
        name: "ledge-down",
        values: &[
            as_it_stands(2.0),
            Value {
                replaced: &[("height_m=-0.01", "height_m=-0.04"), ("speed_m_s=2.0", "speed_m_s=2.5")],
                ..as_it_stands(2.5)
            },
            Value {
                replaced: &[
                    ("height_m=-0.01", "height_m=-0.025"),
                    ("speed_m_s=2.0", "speed_m_s=0.7"),
                ],
                ..as_it_stands(0.7)
            },
        ],
        shorter: &[("duration_s=20.0", "duration_s=8.0")],
        wrong: |_, outcome| {
            let x_m = last(outcome).truth.x_m;
            unless(x_m > 4.3, "beyond the ledge, m", x_m).or_else(|| undisturbed(outcome))
        },
    },
    CaseFile {
        name: "spin-then-straight",
        values: &[
            as_it_stands(1.0),
            Value {
                replaced: &[("yaw_rate_rad_s=1.9", "yaw_rate_rad_s=-1.3")],
                ..as_it_stands(1.0)
            },
            Value {
                replaced: &[("speed_m_s=1.0", "speed_m_s=-0.6")],
                added: "plant.arm_imu.gyro_bias_z_deg_s = -0.5",
                ..as_it_stands(-0.6)
            },
        ],
        shorter: &[
            ("duration_s=60.0", "duration_s=37.0"),
            (",{at_s=54.0,action=\"drive\"}", ""),
        ],
        // Judged at rest and straight on: while the vehicle turns, a status in transit is 0.1 deg old.
        wrong: |_, outcome| {
            let straight = outcome.trace.rows.iter().filter(|row| row.time_s() > 35.5);
            let worst_deg = straight.map(|row| heading_error_deg(row).abs()).fold(0.0, f64::max);
            let turned_rad = last(outcome).truth.heading_rad.abs();
            unless(worst_deg < 0.5, "heading error, deg", worst_deg)
                .or_else(|| unless(turned_rad > 30.0, "turned, rad", turned_rad))
                .or_else(|| undisturbed(outcome))
        },
    },
    CaseFile {
        name: "straight-120-m",
        values: &[
            as_it_stands(1.0),
            Value {
                added: "plant.left.wheel_radius_factor = 1.01",
                ..as_it_stands(1.0)
            },
            Value {
                added: "plant.right.wheel_radius_factor = 1.02",
                ..as_it_stands(1.0)
            },
            Value {
                replaced: &[("speed_m_s=1.0", "speed_m_s=-1.0")],
                added: "plant.right.wheel_radius_factor = 0.995",
                ..as_it_stands(-1.0)
            },
        ],
        shorter: &[
            ("duration_s=140.0", "duration_s=30.0"),
            (",{at_s=124.0,action=\"drive\"}", ""),
        ],
        wrong: |_, outcome| {
            let row = last(outcome);
            let (way_m, heading_deg) = (row.truth.x_m.abs(), row.truth.heading_rad.to_degrees());
            let estimate = &row.status.estimate;
            let off_m = (f64::from(estimate.x_m) - row.truth.x_m).hypot(f64::from(estimate.y_m) - row.truth.y_m);
            unless(heading_deg.abs() < 1.0, "heading, deg", heading_deg)
                .or_else(|| {
                    unless(
                        heading_error_deg(row).abs() < 1.0,
                        "heading error, deg",
                        heading_error_deg(row),
                    )
                })
                .or_else(|| unless(off_m < 0.02 * way_m, "position off, way, m", (off_m, way_m)))
                .or_else(|| unless(way_m > 20.0, "way, m", way_m))
                .or_else(|| undisturbed(outcome))
        },
    },
    CaseFile {
        name: "wall-back-off",
        values: &[
            as_it_stands(-0.3),
            Value {
                replaced: &[("height_m=0.075", "height_m=0.06"), ("at_s=12.0", "at_s=24.0")],
                ..as_it_stands(-0.3)
            },
            Value {
                replaced: &[
                    ("speed_m_s=0.3", "speed_m_s=0.8"),
                    ("speed_m_s=-0.3", "speed_m_s=-0.5"),
                    ("at_s=12.0", "at_s=9.0"),
                ],
                ..as_it_stands(-0.5)
            },
        ],
        shorter: &[("duration_s=60.0", "duration_s=15.0")],
        wrong: |value, outcome| {
            let rows = &outcome.trace.rows;
            // The vehicle reaches the wall and comes no further than the wall's edge.
            let place_m = rows.iter().map(|row| row.truth.x_m).fold(0.0, f64::max);
            let Some(told) = rows.iter().find(|row| row.commanded[0] < 0.0) else {
                return Some("the vehicle is never commanded to back off".to_owned());
            };
            let told_s = told.time_s();
            let after = || rows.iter().filter(|row| row.time_s() >= told_s);
            let backs_s = after().find(|row| row.truth.speed_m_s < 0.5 * value.speed_m_s);
            let backs_s = backs_s.map(|row| row.time_s() - told_s);
            let fastest_m_s = after().map(|row| row.truth.speed_m_s.abs()).fold(0.0, f64::max);
            unless((0.6..1.0).contains(&place_m), "stands at the wall, m", place_m)
                .or_else(|| unless(backs_s.is_some_and(|s| s <= 1.5), "backs off after, s", backs_s))
                .or_else(|| unless(fastest_m_s <= value.speed_m_s.abs() + 0.2, "speed, m/s", fastest_m_s))
                .or_else(|| undisturbed(outcome))
        },
    },
];
