//! Tests of the story, row by row.

use model::status::Status;
use model::supervise::codes::{Blocker, BlockerSet, Fault, LimitSet};
use plant::Truth;

use super::*;

/// The observation at one instant.
struct Row {
    status: Status,
    truth: Truth,
}

/// A row at a tick of 1 ms, modified by `change`.
fn row(tick: u32, change: impl FnOnce(&mut Row)) -> Row {
    let mut row = Row {
        status: Status {
            tick,
            time_us: u64::from(tick) * 1000,
            ..Status::default()
        },
        truth: Truth::default(),
    };
    change(&mut row);
    row
}

fn told(rows: impl IntoIterator<Item = Row>) -> RunStory {
    let mut story = Story::default();
    for Row { status, truth } in rows {
        story.add(Sight {
            status: &status,
            truth: Some(&truth),
        });
    }
    story.told()
}

#[test]
fn a_fault_a_refusal_and_a_mode_are_told_with_time_and_reason() {
    let mut faults = FaultSet::EMPTY;
    faults.insert(Fault::ImuStale);
    let mut blockers = BlockerSet::EMPTY;
    blockers.insert(Blocker::NotAtRest);
    let told = told([
        row(10, |_| {}),
        row(20, |row| {
            row.status.refused_arms = 1;
            row.status.blockers = blockers;
        }),
        row(30, |row| {
            row.status.refused_arms = 1;
            row.status.mode = Mode::Armed;
        }),
        row(40, |row| {
            row.status.refused_arms = 1;
            row.status.faults = faults;
        }),
        row(50, |row| row.status.refused_arms = 1),
    ]);
    let lines: Vec<_> = told.events.iter().map(StoryEvent::to_string).collect();
    let expected = [
        "     0.02 s  refusal  not armed: NotAtRest",
        "     0.03 s  mode     armed",
        "     0.04 s  fault    ImuStale: The arm IMU gave no sample in time.",
        "     0.04 s  mode     disarmed, the bridges are open",
        "     0.05 s  cleared  cleared: ImuStale",
    ];
    assert_eq!(lines, expected);
}

#[test]
fn a_slide_in_jerks_is_one_and_a_later_one_another() {
    let slides = |tick: u32| (100..200).contains(&tick) || (350..360).contains(&tick) || tick >= 900;
    let told = told((0..100).map(|n| {
        row(n * 10, |row| {
            row.truth.sliding = [slides(n * 10), false];
            if n == 50 {
                row.status.limits = LimitSet::EMPTY;
                row.status.limits.insert(Limit::Stall);
            }
        })
    }));
    let spans: Vec<_> = told.events.iter().map(|e| (e.kind, e.at_s, e.for_s)).collect();
    let near = |a: f64, b: f64| (a - b).abs() < 1e-9;
    assert_eq!(spans.len(), 3, "{spans:?}");
    assert!(spans[0].0 == EventKind::Slide && near(spans[0].1, 0.1) && near(spans[0].2.unwrap_or(0.0), 0.26));
    assert!(spans[1].0 == EventKind::Stall && near(spans[1].1, 0.5) && near(spans[1].2.unwrap_or(0.0), 0.01));
    assert!(spans[2].0 == EventKind::Slide && near(spans[2].1, 0.9) && near(spans[2].2.unwrap_or(0.0), 0.1));
}

#[test]
fn a_whirl_is_told_once_a_turn_and_a_restart_once() {
    let told = told([
        row(10, |_| {}),
        row(20, |row| row.truth.phi_rad = 3.2),
        row(30, |row| row.truth.phi_rad = 4.0),
        row(5, |row| row.status.time_us = 40_000),
    ]);
    let kinds: Vec<_> = told.events.iter().map(|event| event.kind).collect();
    assert_eq!(kinds, [EventKind::Whirl, EventKind::Restart]);
}

#[test]
fn what_is_too_much_is_counted() {
    let modes = [Mode::Armed, Mode::Disarmed];
    let told = told((0..EVENTS_MAX as u32 + 11).map(|n| row(n, |row| row.status.mode = modes[n as usize % 2])));
    assert_eq!((told.events.len(), told.dropped), (EVENTS_MAX, 10));
}

/// The only event's text.
fn text(rows: impl IntoIterator<Item = Row>) -> String {
    let told = told(rows);
    let [event] = told.events.as_slice() else {
        panic!("{:?}", told.events)
    };
    event.text.clone()
}

/// The left wheel, loaded with 100 N, slides on ground with grip 0.05: 5 N against the slip.
fn sliding(speed_m_s: f64, slip_m_s: f64, slope_rad: f64) -> Truth {
    Truth {
        sliding: [true, false],
        slip_m_s: [slip_m_s, 0.0],
        normal_n: [100.0; 2],
        longitudinal_n: [-5.0 * slip_m_s.signum(), 0.0],
        speed_m_s,
        slope_rad,
        ..Truth::default()
    }
}

#[test]
fn a_slide_tells_which_wheel_how_fast_and_what_asked_for_more_grip_than_there_is() {
    for (truth, expected) in [
        (
            sliding(0.3, -0.5, 0.0),
            "the left wheel slides at up to 0.50 m/s, turning faster than the vehicle drives, at 0.30 m/s: \
             the ground gives a grip of 0.05 on 0.0 deg, and speeding up asks for more",
        ),
        (
            sliding(1.0, 0.6, 0.0),
            "the left wheel slides at up to 0.60 m/s, turning slower than the vehicle drives, at 1.00 m/s: \
             the ground gives a grip of 0.05 on 0.0 deg, and braking asks for more",
        ),
        (
            sliding(-0.4, -0.9, 0.1),
            "the left wheel slides at up to 0.90 m/s, turning against the vehicle's motion, at -0.40 m/s: \
             the ground gives a grip of 0.05, and its slope of 5.7 deg asks for 0.10",
        ),
        (
            Truth {
                side_speed_m_s: 0.8,
                ..sliding(1.0, 0.1, 0.0)
            },
            "the left wheel slides at up to 0.81 m/s, sideways, at 1.00 m/s: \
             the motion sideways asks for more grip than the ground gives",
        ),
    ] {
        assert_eq!(text([row(10, |row| row.truth = truth)]), expected);
    }
}

/// The first instant shows the cause, the fastest instant the extent.
#[test]
fn a_slide_is_told_by_how_it_began_and_how_far_it_went() {
    let told = text([
        row(10, |row| row.truth = sliding(0.0, -0.1, 0.0)),
        row(20, |row| row.truth = sliding(0.4, -0.9, 0.0)),
        row(30, |row| row.truth = sliding(0.5, 0.2, 0.0)),
    ]);
    assert!(
        told.contains("up to 0.90 m/s") && told.contains("driving off"),
        "{told}"
    );
}

#[test]
fn friction_across_the_heading_counts_as_grip() {
    // With a slip of 3 along and 4 across, the force along is three fifths of the friction.
    let truth = Truth {
        side_speed_m_s: 0.4,
        ..sliding(1.0, 0.3, 0.0)
    };
    let contact = slide::SlidingContact::of(&truth).expect("it slides");
    assert!((contact.grip.expect("known") - 0.05 / 0.6).abs() < 1e-12);
}

/// A row in which the vehicle is blocked while it is commanded to drive forward.
fn blocked(change: impl FnOnce(&mut Row)) -> Row {
    row(10, |row| {
        row.status.limits.insert(Limit::Stall);
        row.status.speed_reference_m_s = 0.4;
        row.status.estimate.phi_rad = 1.0;
        row.status.current_a = [3.0, -4.0, 9.0];
        change(row);
    })
}

#[test]
fn a_stall_tells_what_is_in_the_way_and_how_hard_the_vehicle_pushes() {
    let edge = text([blocked(|row| row.truth.slope_rad = 0.8)]);
    assert_eq!(
        edge,
        "told to drive at 0.40 m/s, the vehicle is blocked: an edge rises at 46 deg under its wheels; \
         its arm leans up to 57 deg, its wheels' motors draw up to 4.0 A"
    );
    let hill = |row: &mut Row| {
        row.truth.slope_rad = 0.3;
        row.status.estimate.slope_rad = 0.3;
    };
    for (change, cause) in [
        (&hill as &dyn Fn(&mut Row), "the ground rises at 17.2 deg"),
        (&|row: &mut Row| row.truth.chocked = true, "chocks stand at its wheels"),
        (&|row: &mut Row| row.truth = sliding(0.0, -0.1, 0.0), "its wheels slide"),
        // While the vehicle drives backward, a rise ahead in the heading's direction is behind it.
        (
            &|row: &mut Row| {
                row.status.speed_reference_m_s = -0.4;
                row.truth.slope_rad = 0.8;
            },
            "no ground rises in its way: a wheel is seized, or something holds it",
        ),
    ] {
        let told = told([blocked(|row| change(row))]);
        let stall = told.events.iter().find(|event| event.kind == EventKind::Stall);
        let text = &stall.expect("told").text;
        assert!(text.contains(&format!("is blocked: {cause}; ")), "{text}");
    }
}

#[test]
fn a_whirl_tells_who_did_the_work() {
    // The arm swings up from its hanging position in steps of half a rad.
    let swing = |torque_n_m: f64, wheel_rad_s: f64| {
        text((0..8).map(|n| {
            row(10 * n, |row| {
                row.truth.time_s = 0.01 * f64::from(n);
                row.truth.phi_rad = 0.5 * f64::from(n);
                row.truth.phi_rate_rad_s = 5.0;
                row.truth.wheel_rate_rad_s = [wheel_rad_s; 2];
                row.truth.torque_n_m = [torque_n_m, torque_n_m, 7.0];
            })
        }))
    };
    for (torque_n_m, wheel_rad_s, cause) in [
        (
            1.5,
            4.0,
            "the motors, which drive the wheels with up to 3.0 N m, lift it",
        ),
        (
            1.5,
            -4.0,
            "the motors, which brake the wheels with up to 3.0 N m, lift it",
        ),
        (
            -1.5,
            4.0,
            "a push or a jolt threw it up, the motors, which brake the wheels with up to 3.0 N m, hold against it",
        ),
        (0.0, 4.0, "the motors have no part in it, a push or a jolt threw it up"),
    ] {
        assert_eq!(
            swing(torque_n_m, wheel_rad_s),
            format!("the arm turns over forward at 5.0 rad/s: {cause}")
        );
    }
}

/// For a real vehicle the truth is unknown, so its story uses the vehicle's own estimate.
#[test]
fn without_the_truth_the_vehicle_s_own_findings_are_told() {
    let mut story = Story::default();
    let Row { mut status, .. } = blocked(|row| row.status.estimate.slope_rad = 0.2);
    status.estimate.sliding = true;
    story.add(Sight {
        status: &status,
        truth: None,
    });
    let texts: Vec<_> = story.told().events.into_iter().map(|event| event.text).collect();
    assert_eq!(
        texts,
        [
            "the wheels slide, as the vehicle finds: they turn otherwise than it moves",
            "told to drive at 0.40 m/s, the vehicle is blocked: it finds a slope of 11.5 deg and does not come up; \
             its arm leans up to 57 deg, its wheels' motors draw up to 4.0 A",
        ]
    );
}

/// The story reports how much a motor's heat and a full supply take from the drive.
#[test]
fn hot_motors_and_a_full_supply_are_told() {
    let told = told((1..=20).map(|n| {
        row(n * 10, |row| {
            row.status.limits = LimitSet::EMPTY;
            row.status.current_a = [-8.25, 8.0, 0.5];
            row.status.battery_v = 29.5 + 0.01 * n as f32;
            row.status.estimate.slope_rad = -0.5;
            if n > 10 {
                row.status.limits.insert(Limit::MotorHeat);
            }
            if n > 15 {
                row.status.limits.insert(Limit::Regeneration);
            }
        })
    }));
    let lines: Vec<_> = told.events.iter().map(StoryEvent::to_string).collect();
    assert_eq!(
        lines,
        [
            "     0.11 s  heat     MotorHeat: the heat of a motor or its bridge, or more current than its limit, bounds its current: left 8.2 A, \
             right 8.0 A, ballast 0.5 A at most, on -28.6 deg at most, for 0.10 s",
            "     0.16 s  supply   Regeneration: the supply, up to 29.7 V, takes back no more power, and the vehicle brakes less, \
             for 0.05 s"
        ]
    );
}
