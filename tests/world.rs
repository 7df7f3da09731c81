//! The world's influence on the vehicle: every step and every table of `[plant]` shows in a run.

use model::supervise::arming::Mode;
use virtual_board::scenario::trace::TraceRow;
use virtual_board::scenario::wire::LinkStep;
use virtual_board::scenario::world::WorldStep;
use virtual_board::scenario::{self, DriveOutcome, Scenario, VirtualBackend};

mod support;
use support::reference;

/// A scenario that arms at 2 s, drives off at 4 s and stops at 9 s, with these tables, and with these steps before the stop.
fn scenario(tables: &str, steps: &str) -> Scenario {
    let step = |at_s: f64, rest: &str| format!("[[step]]\nat_s = {at_s:?}\n{rest}\n");
    let text = [
        "title = \"t\"\nduration_s = 12.0\nseed = 3\n",
        tables,
        &step(2.0, "action = \"arm\""),
        &step(4.0, "action = \"drive\"\nspeed_m_s = 0.5"),
        steps,
        &step(9.0, "action = \"drive\""),
    ]
    .concat();
    Scenario::parse("t.toml", &text).unwrap_or_else(|error| panic!("{error}"))
}

fn drive(scenario: &Scenario) -> DriveOutcome {
    let vehicle = reference();
    let plant = scenario.plant(&vehicle).expect("a plant");
    let mut backend = VirtualBackend::boot(&vehicle, plant).expect("boots");
    scenario::run(scenario, &mut backend, |_| {}).expect("valid")
}

/// The largest difference of a quantity between two runs, at equal times.
fn difference(a: &DriveOutcome, b: &DriveOutcome, of: fn(&TraceRow) -> f64) -> f64 {
    let rows = &b.trace.rows;
    a.trace
        .rows
        .iter()
        .filter_map(|row| {
            let twin = rows.iter().find(|twin| (twin.time_s() - row.time_s()).abs() < 4e-3)?;
            Some((of(row) - of(twin)).abs())
        })
        .fold(0.0, f64::max)
}

/// A step at 6 s, what it changes, and by how much at least.
type Shown = (&'static str, fn(&TraceRow) -> f64, f64);

const STEPS: &[Shown] = &[
    (
        "action = \"jam\"\nside = \"left\"\njammed = true",
        |r| r.truth.wheel_rate_rad_s[0],
        0.5,
    ),
    (
        "action = \"payload\"\nmass_kg = 3.0\nahead_m = 0.1\nbelow_m = 0.2",
        |r| r.truth.phi_rad,
        0.02,
    ),
    (
        "action = \"push\"\non = \"axle\"\nforward_n = 40.0\nfor_s = 0.3",
        |r| r.truth.speed_m_s,
        0.05,
    ),
    (
        "action = \"push\"\non = \"arm\"\nforward_n = 40.0\nfor_s = 0.3",
        |r| r.truth.phi_rad,
        0.03,
    ),
    (
        "action = \"push\"\non = \"spar\"\nforward_n = 10.0\nfor_s = 0.3",
        |r| r.truth.spar_rad,
        0.02,
    ),
    ("action = \"stand\"\nraised = true", |r| r.truth.height_m, 0.049),
    (
        "action = \"temperature\"\nto_c = 70.0\nover_s = 1.0",
        |r| f64::from(r.status.estimate.phi_rad),
        0.005,
    ),
    (
        "action = \"vibration\"\namplitude_rad_s = 0.5\nfrequency_hz = 30.0",
        |r| f64::from(r.status.estimate.yaw_rate_rad_s),
        0.05,
    ),
    (
        "action = \"analog-fault\"\nsensor = \"left-current\"\noffset = 59.0",
        |r| f64::from(!r.status.faults.is_empty()),
        1.0,
    ),
    (
        "action = \"encoder-loss\"\nmotor = \"left\"\nshare = 0.2",
        |r| f64::from(r.status.estimate.x_m),
        0.01,
    ),
    (
        "action = \"motor-leads\"\nmotor = \"left\"\nleads = \"open\"",
        |r| r.truth.current_a[0],
        0.3,
    ),
    (
        "action = \"motor-leads\"\nmotor = \"right\"\nleads = \"shorted\"",
        |r| r.truth.current_a[1],
        1.0,
    ),
    (
        "action = \"half-bridge\"\nmotor = \"left\"\ndead = \"forward\"",
        |r| r.truth.current_a[0],
        0.3,
    ),
    (
        "action = \"battery-contact\"\nconnected = false",
        |r| r.truth.speed_m_s,
        0.0,
    ),
    (
        "action = \"link\"\ndirection = \"to-board\"\nlatency_ms = 1500.0",
        |r| f64::from(r.status.speed_reference_m_s),
        0.1,
    ),
    ("action = \"stuck-operator\"\nstuck = true", |r| r.truth.speed_m_s, 0.4),
];

const TABLES: &[Shown] = &[
    ("[plant.left]\nbacklash_deg = 1.0\n", |r| r.truth.current_a[0], 0.05),
    (
        "[plant.right]\ntorque_constant_factor = 0.7\nfriction_factor = 5.0\n",
        |r| r.truth.current_a[1],
        0.2,
    ),
    (
        "[plant.left]\nwheel_radius_factor = 1.03\n",
        |r| r.truth.wheel_rate_rad_s[0] - r.truth.wheel_rate_rad_s[1],
        0.04,
    ),
    (
        "[plant.arm_imu]\nmisalignment_y_deg = 2.0\n",
        |r| f64::from(r.status.estimate.phi_rad),
        0.02,
    ),
    (
        "[plant.spar_imu]\nmisalignment_y_deg = 5.0\n",
        |r| r.truth.spar_rad,
        0.02,
    ),
    // The arm swings at up to 1 rad/s when the vehicle drives off, and its IMU's sample is up to half a millisecond older.
    (
        "[plant.arm_imu]\nclock_error = -0.01\n",
        |r| f64::from(r.status.estimate.phi_rad),
        1e-5,
    ),
    ("[plant.vehicle]\nbody.arm_mass_kg = 9.0\n", |r| r.truth.phi_rad, 0.005),
    (
        "[plant.battery]\ncapacity_ah = 0.01\nopen_circuit_v = [[0.0, 20.0], [1.0, 25.2]]\n",
        |r| r.truth.battery_v,
        0.2,
    ),
];

#[test]
fn every_step_of_the_world_shows() {
    let drift = "[plant.arm_imu]\naccel_drift_m_s2_per_k = 0.005\n";
    let plain = drive(&scenario(drift, ""));
    for (step, of, least) in STEPS {
        let other = drive(&scenario(drift, &format!("[[step]]\nat_s = 6.0\n{step}\n")));
        if step.contains("battery-contact") {
            // The board has no supply: it sends no further status.
            let last = other.trace.rows.last().expect("rows").time_s();
            assert!((5.9..6.1).contains(&last), "{last}");
            continue;
        }
        let found = difference(&plain, &other, *of);
        assert!(found >= *least, "{step}: {found}");
    }
    for name in WorldStep::NAMES.iter().chain(&LinkStep::NAMES) {
        let action = format!("action = \"{name}\"");
        assert!(
            STEPS.iter().any(|(step, ..)| step.starts_with(&action)),
            "{name} is not shown"
        );
    }
}

#[test]
fn every_table_of_the_plant_shows() {
    let plain = drive(&scenario("", ""));
    for (table, of, least) in TABLES {
        let found = difference(&plain, &drive(&scenario(table, "")), *of);
        assert!(found >= *least, "{table}: {found}");
    }
}

#[test]
fn a_brown_out_resets_the_board_which_boots_and_arms_again() {
    let text = r#"
        title = "t"
        duration_s = 24.0
        plant.board.brown_out_v = 12.0
        step = [
            { at_s = 2.0, action = "arm" },
            { at_s = 4.0, action = "drive", speed_m_s = 0.5 },
            { at_s = 7.0, action = "battery", open_circuit_v = 11.0 },
            { at_s = 9.0, action = "battery", open_circuit_v = 25.0 },
            { at_s = 9.5, action = "drive" },
            { at_s = 18.0, action = "arm" },
            { at_s = 20.0, action = "drive", speed_m_s = 0.5 },
        ]
    "#;
    let scenario = Scenario::parse("t.toml", text).expect("a scenario");
    let outcome = drive(&scenario);
    let boots: Vec<&String> = outcome.log.iter().filter(|line| line.contains("reset by")).collect();
    assert_eq!(boots.len(), 2, "{boots:?}");
    assert!(boots[1].contains("brown-out"), "{boots:?}");
    let rows = &outcome.trace.rows;
    assert!(
        !rows.iter().any(|row| (7.02..9.0).contains(&row.time_s())),
        "the board sends a status without its supply"
    );
    let at = |s: f64| rows.iter().find(|row| row.time_s() >= s).expect("a row");
    assert_eq!(
        (at(6.9).status.mode, at(9.2).status.mode),
        (Mode::Armed, Mode::Disarmed)
    );
    assert!(!at(9.2).bridges_on && at(9.2).status.tick < at(6.9).status.tick);
    assert_eq!(at(19.0).status.mode, Mode::Armed, "{:?}", outcome.log);
    let speed_m_s = at(23.0).truth.speed_m_s;
    assert!((speed_m_s - 0.5).abs() < 0.02, "{speed_m_s}");
    assert_eq!(outcome.counts.unarmed_drive_ms, 0);
}

#[test]
fn a_battery_that_comes_back_boots_the_board() {
    let text = r#"
        title = "t"
        duration_s = 6.0
        step = [
            { at_s = 1.0, action = "battery-contact", connected = false },
            { at_s = 1.2, action = "battery-contact", connected = false },
            { at_s = 2.0, action = "battery-contact", connected = true },
            { at_s = 4.0, action = "arm" },
        ]
    "#;
    let outcome = drive(&Scenario::parse("t.toml", text).expect("a scenario"));
    assert_eq!(outcome.trace.rows.last().expect("rows").status.mode, Mode::Armed);
    let dead = |row: &&TraceRow| (1.02..2.0).contains(&row.time_s());
    assert_eq!(outcome.trace.rows.iter().filter(dead).count(), 0);
}

#[test]
fn frames_lost_doubled_and_overtaken_are_as_reproducible_as_a_clear_link() {
    let steps = "[[step]]\nat_s = 5.0\naction = \"link\"\nlatency_ms = 15.0\njitter_ms = 20.0\nloss = 0.2\n\
                 duplication = 0.1\nreordering = 0.1\n";
    let run = || drive(&scenario("", steps));
    let (a, b) = (run(), run());
    assert_eq!(a.trace.hash(), b.trace.hash());
    let links = |outcome: &DriveOutcome| outcome.trace.rows.iter().map(|row| row.link).collect::<Vec<_>>();
    assert_eq!(links(&a), links(&b));
    // The trace has every status that the board sent, whatever reached the operator.
    let within = |row: &&TraceRow| (6.0..8.0).contains(&row.time_s());
    assert_eq!(a.trace.rows.iter().filter(within).count(), 200);
    // Of 100 commands in 2 s four fifths reach the board; a tenth arrives twice.
    let heard = |at_s: f64| {
        let row = a.trace.rows.iter().find(|row| row.time_s() >= at_s).expect("a row");
        (row.link.frames, row.link.repeated_frames)
    };
    let (before, after) = (heard(6.0), heard(8.0));
    let frames = after.0 - before.0;
    assert!((60..100).contains(&frames), "{frames} of 100 commands came");
    assert!(after.1 > before.1, "no frame came twice");
}
